"""A skill that is one call of a service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.client import Client

from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.ros._runs import RemoteSkill, ServiceRun
from florence_bt.ros.node import FlorenceNode


class ServiceSkill(RemoteSkill):
    """A skill whose runs are calls of a service."""

    def __init__(
        self,
        node: FlorenceNode,
        srv_type: Any,
        name: str,
        *,
        to_request: Callable[[Inputs], Any],
        to_result: Callable[[Any], Result],
        deadline_s: float = 5.0,
        judge: Callable[[Inputs, Result], Result] | None = None,
    ) -> None:
        """Make a client of a service.

        Args:
            node: The node that talks to the server.
            srv_type: The service.
            name: Its name.
            to_request: The request message from the inputs; raises FlorenceError, KeyError, TypeError or
                ValueError when they do not fit.
            to_result: The result from the response message.
            deadline_s: Seconds from the start to the answer, the search for the server included.
            judge: The result of the skill, from the inputs and a success of the service; the success itself
                when not given.
        """
        if not deadline_s > 0.0:
            raise ConfigError(f"the deadline of service {name} must be above zero, not {deadline_s}")
        self._node = node
        self._to_result = to_result
        self._deadline_s = deadline_s
        self._client = node.create_client(srv_type, name)
        self._judge = judge
        super().__init__(f"service {node.resolve_service_name(name)}", "request", to_request)

    def server_is_there(self) -> bool:
        """Tell whether a server has been discovered."""
        return bool(self._client.service_is_ready())

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        call = _Call(self._node, self._client, message, lambda answer: self._result(inputs, answer))
        call.run = ServiceRun(self._node.steady, call, self._deadline_s, self.label)
        return call.run

    def _result(self, inputs: Inputs, answer: Any) -> Result:
        result = self._to_result(answer)
        return self._judge(inputs, result) if self._judge is not None and result.succeeded else result


@dataclass(slots=True)
class _Call:
    """The way to the server for one call."""

    node: FlorenceNode
    client: Client
    request: Any
    to_result: Callable[[Any], Result]
    future: Any = None
    run: ServiceRun | None = None

    def server_is_there(self) -> bool:
        return bool(self.client.service_is_ready())

    def send(self) -> None:
        self.future = self.client.call_async(self.request)
        self.future.add_done_callback(self.node.guarded(self._on_answer))

    def stop(self) -> None:
        self.client.remove_pending_request(self.future)

    def _on_answer(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.finished(self.to_result(future.result()))
