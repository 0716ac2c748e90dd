"""Open goals of some action servers, also those of other programs; and their end."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.client import Client
from rclpy.qos import qos_profile_action_status_default
from unique_identifier_msgs.msg import UUID

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.server_processes import DiscoveredServers

OPEN = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)


@dataclass(frozen=True, slots=True)
class OpenGoal:
    """A goal without an end.

    Attributes:
        action: Name of the action.
        goal_id: Its 16 bytes, in hexadecimal.
    """

    action: str
    goal_id: str

    def __str__(self) -> str:
        """Show for people the action and the beginning of the id."""
        return f"{self.action} (goal {self.goal_id[:8]})"


class OpenGoals:
    """Watches and cancels the goals of some actions; one per node.

    Args:
        node: The node that listens and asks.
        actions: Names of the actions.
    """

    def __init__(self, node: FlorenceNode, actions: Iterable[str]) -> None:
        self._node = node
        self._open: dict[str, tuple[str, ...]] = {}
        self._clients: dict[str, Client] = {}
        self._publishers: dict[str, DiscoveredServers] = {}
        self._told_by: dict[str, set[bytes]] = {}
        for action in actions:
            name = node.resolve_action_name(action)
            status = f"{name}/_action/status"
            self._publishers[action] = DiscoveredServers(partial(node.get_publishers_info_by_topic, status))
            self._clients[action] = node.create_client(CancelGoal, f"{name}/_action/cancel_goal")
            node.create_subscription(
                GoalStatusArray,
                status,
                partial(self._on_status, action),
                qos_profile_action_status_default,
            )

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the actions."""
        return tuple(self._clients)

    def open(self) -> list[OpenGoal]:
        """Return the open goals; those of a server that went away are over, also when another one came."""
        return [
            OpenGoal(action, goal_id)
            for action, goal_ids in self._open.items()
            if goal_ids and self._is_served(action)
            for goal_id in goal_ids
        ]

    def _is_served(self, action: str) -> bool:
        """Tell whether a server that told of the open goals of an action is still there."""
        there = self._publishers[action].ids()
        # Discovery may learn of a server after its first status.
        told_by = self._told_by[action] = self._told_by.get(action) or there
        return bool(told_by & there)

    def server_is_there(self, action: str) -> bool:
        """Tell whether the server of an action has been discovered."""
        return bool(self._clients[action].service_is_ready())

    def cancel(self, goal: OpenGoal) -> None:
        """Ask for the end of one goal."""
        request = CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(uuid=list(bytes.fromhex(goal.goal_id)))))
        self._clients[goal.action].call_async(request)

    def cancel_all(self, action: str, on_answer: Callable[[], None] | None = None) -> None:
        """Ask a server to end all its goals.

        Args:
            action: Its name.
            on_answer: Called when it has answered, whatever it says: it knows of the request then.
        """
        # A zero id with a zero stamp means all goals (REFERENCE 10, cancel message).
        future: Any = self._clients[action].call_async(CancelGoal.Request())
        if on_answer is not None:
            future.add_done_callback(self._node.guarded(lambda _: on_answer()))

    def _on_status(self, action: str, message: GoalStatusArray) -> None:
        self._open[action] = tuple(
            bytes(status.goal_info.goal_id.uuid).hex()
            for status in message.status_list
            if status.status in OPEN
        )
        if self._open[action]:
            self._told_by[action] = self._publishers[action].ids()  # whose process is known from now on
