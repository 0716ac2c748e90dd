"""Cancels every goal of some action servers, whoever sent them, also goals of a process that has died."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from action_msgs.srv import CancelGoal
from rclpy.client import Client

from florence_bt.ros.node import FlorenceNode


class CancelAll:
    """Clients of the cancel services of some actions; one per node.

    Args:
        node: The node that asks.
        actions: Names of the actions.
    """

    def __init__(self, node: FlorenceNode, actions: Sequence[str]) -> None:
        self._node = node
        self._clients: dict[str, Client] = {
            action: node.create_client(CancelGoal, f"{action}/_action/cancel_goal") for action in actions
        }

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the actions."""
        return tuple(self._clients)

    def there(self, action: str) -> bool:
        """Whether the server of an action is in sight."""
        return bool(self._clients[action].service_is_ready())

    def ask(self, action: str, on_answer: Callable[[], None] | None = None) -> None:
        """Ask a server to end all its goals.

        Args:
            action: Its name.
            on_answer: Called when it has answered, whatever it says: it knows of the request then.
        """
        # A zero id with a zero stamp means all goals (REFERENCE 10, cancel message).
        future: Any = self._clients[action].call_async(CancelGoal.Request())
        if on_answer is not None:
            future.add_done_callback(self._node.guarded(lambda _: on_answer()))
