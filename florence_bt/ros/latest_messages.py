"""A subscription that wakes nobody: the middleware keeps the latest messages until somebody takes them.

The executor of rclpy handles an event for each message that arrives, so a publisher that is faster than
Python holds every other callback up without bound. This subscription is not served by an executor.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type

from florence_bt.ros.node import FlorenceNode


class LatestMessages:
    """The latest messages of a topic.

    Args:
        node: The node that subscribes; the subscription ends with it.
        message_type: The type of the messages.
        topic: The topic, resolved like every name of the node.
        depth: How many messages are kept; older ones are dropped.
    """

    def __init__(self, node: FlorenceNode, message_type: Any, topic: str, depth: int) -> None:
        self._type = message_type
        self._depth = depth
        check_is_valid_msg_type(message_type)  # imports its type support
        with node.handle:
            self._subscription = _rclpy.Subscription(
                node.handle, message_type, topic, QoSProfile(depth=depth).get_c_qos_profile()
            )
        node.on_destroy(self._subscription.destroy_when_not_in_use)

    def take(self) -> Iterator[Any]:
        """The messages since the last call, the oldest first; at most as many as are kept."""
        with self._subscription:
            for _ in range(self._depth):
                taken = self._subscription.take_message(self._type, False)
                if taken is None:
                    return
                yield taken[0]
