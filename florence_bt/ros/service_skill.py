"""A skill that is one call of a service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.client import Client

from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import name_of_interface
from florence_bt.core.outcome import Result
from florence_bt.core.server_comparison import SERVICE, Lack, Wanted
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.ros._runs import RemoteSkill, ServiceRun
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.server_processes import DiscoveredServers


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
            deadline_s: Seconds from the start to the answer, the search for the server included
                (:func:`~florence_bt.ros._runs.search_limit`).
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
        whole = node.resolve_service_name(name)
        # The topic of the answers, as the middlewares of ROS 2 name it.
        self._servers = DiscoveredServers(
            lambda: node.get_publishers_info_by_topic(f"rr{whole}Reply", no_mangle=True)
        )
        self._wanted = Wanted(SERVICE, whole, name_of_interface(srv_type))
        super().__init__(f"service {whole} ({self._wanted.interface})", "request", to_request)

    def server_is_there(self) -> bool:
        """Tell whether a server has been discovered, and its process has not ended since."""
        return bool(self._client.service_is_ready()) and not self._servers.all_ended()

    def lack(self) -> Lack:
        """Return why the server cannot be reached, as far as the graph tells it."""
        return self._node.server_graph.lack(self._wanted)

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        call = _Call(
            self._client,
            message,
            self.server_is_there,
            self.lack,
            lambda answer: self._result(inputs, answer),
            self._node,
        )
        call.run = ServiceRun(self._node.steady, call, self._deadline_s, self.label)
        return call.run

    def _result(self, inputs: Inputs, answer: Any) -> Result:
        result = self._to_result(answer)
        return self._judge(inputs, result) if self._judge is not None and result.succeeded else result


@dataclass(slots=True)
class _Call:
    """The way to the server for one call."""

    client: Client
    request: Any
    server_is_there: Callable[[], bool]
    lack: Callable[[], Lack]
    to_result: Callable[[Any], Result]
    node: FlorenceNode
    future: Any = None
    run: ServiceRun | None = None

    def send(self) -> None:
        self.future = self.client.call_async(self.request)
        self.future.add_done_callback(self.node.guarded(self._on_answer))

    def stop(self) -> None:
        self.client.remove_pending_request(self.future)

    def _on_answer(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.finished(self.to_result(future.result()))
