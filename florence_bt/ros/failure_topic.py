"""Why goals fail of an action whose result has no field for a reason: a topic beside the action."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from florence_interfaces.msg import StopReason
from rclpy.duration import Duration

from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.skill import Inputs
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE

_ToGoal = Callable[[Inputs], Any]
_ToResult = Callable[[Any, Outcome], Result]
_ARRIVES_S = 0.1
"""The server waits no longer for its clients to have the reason."""


class FailurePublisher:
    """The server's side.

    Args:
        node: The node of the server.
        topic: The topic.
    """

    def __init__(self, node: FlorenceNode, topic: str) -> None:
        self._publisher = node.create_publisher(StopReason, topic, RELIABLE)

    def publish(self, code: str, reason: str) -> None:
        """Say why; afterwards, end the goal: its client has the reason then."""
        self._publisher.publish(StopReason(code=code, text=reason))
        self._publisher.wait_for_all_acked(Duration(seconds=_ARRIVES_S))


class FailureTopic:
    """The client's side.

    Args:
        node: The node of the client.
        topic: The topic.
    """

    def __init__(self, node: FlorenceNode, topic: str) -> None:
        self._last = StopReason()
        node.create_subscription(StopReason, topic, self._take, RELIABLE)

    def _take(self, message: StopReason) -> None:
        self._last = message

    def wrapped(self, to_goal: _ToGoal, to_result: _ToResult) -> tuple[_ToGoal, _ToResult]:
        """What makes goals, which forgets older failures; what reads results, given the failure instead."""

        def make(inputs: Inputs) -> Any:
            self._last = StopReason()
            return to_goal(inputs)

        return make, lambda message, outcome: to_result(self._last, outcome)
