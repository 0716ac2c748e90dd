"""A skill that is one call of a service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.client import Client

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.outcome import Result, failure
from florence_bt.core.skill import FinishedRun, Inputs, SkillRun
from florence_bt.ros._service_run import ServiceRun
from florence_bt.ros.node import FlorenceNode


class ServiceSkill:
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
        """
        if not deadline_s > 0.0:
            raise ConfigError(f"the deadline of service {name} must be above zero, not {deadline_s}")
        self._node = node
        self._to_request = to_request
        self._to_result = to_result
        self._deadline_s = deadline_s
        self._client = node.create_client(srv_type, name)
        self._label = f"service {node.resolve_service_name(name)}"

    @property
    def label(self) -> str:
        """The service's name, for people."""
        return self._label

    def server_is_there(self) -> bool:
        """Whether a server is in sight."""
        return bool(self._client.service_is_ready())

    def start(self, inputs: Inputs) -> SkillRun:
        """Call as soon as the server is there."""
        try:
            request = self._to_request(inputs)
        except (FlorenceError, KeyError, TypeError, ValueError) as error:
            return FinishedRun(failure("bad_input", f"no request for {self._label}: {error}"))
        channel = _Channel(self._node, self._client, request, self._to_result)
        run = ServiceRun(self._node.steady, channel, self._deadline_s, self._label)
        channel.run = run
        return run


class _Channel:
    """The way to the server for one call."""

    def __init__(
        self, node: FlorenceNode, client: Client, request: Any, to_result: Callable[[Any], Result]
    ) -> None:
        self._node = node
        self._client = client
        self._request = request
        self._to_result = to_result
        self._future: Any = None
        self.run: ServiceRun | None = None

    def server_is_there(self) -> bool:
        return bool(self._client.service_is_ready())

    def send_request(self) -> None:
        self._future = self._client.call_async(self._request)
        self._future.add_done_callback(self._node.guarded(self._on_answer))

    def drop_request(self) -> None:
        self._client.remove_pending_request(self._future)

    def _on_answer(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.answered(self._to_result(future.result()))
