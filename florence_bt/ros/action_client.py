"""The client side of an action: its three services, and its feedback, which is read on demand.

The action client of rclpy 7.1 makes an event for the executor of each feedback message, so a server that
sends more than Python can read holds every other callback up without bound. It also raises when two servers
of the same name answer one goal, which ends the process. The protocol is that of
https://design.ros2.org/articles/actions.html.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import QoSProfile
from rclpy.task import Future
from rclpy.type_support import check_is_valid_msg_type
from unique_identifier_msgs.msg import UUID

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.server_processes import DiscoveredServers


class LatestMessages:
    """A subscription without a callback: the middleware keeps the latest messages until they are taken.

    The executor of rclpy handles an event for each message that arrives, so a publisher that is faster than
    Python holds every other callback up without bound. This subscription is not served by an executor.

    Args:
        node: The node that subscribes; the subscription ends with it.
        message_type: The type of the messages.
        topic: The topic, resolved like every name of the node.
        depth: How many messages are kept; older ones are dropped.
        qos: The quality of service; reliable when not given.
    """

    def __init__(
        self, node: FlorenceNode, message_type: Any, topic: str, depth: int, qos: QoSProfile | None = None
    ) -> None:
        self._type = message_type
        self._depth = depth
        profile = QoSProfile(depth=depth) if qos is None else qos
        check_is_valid_msg_type(message_type)  # imports its type support
        with node.handle:
            self._subscription = _rclpy.Subscription(
                node.handle, message_type, topic, profile.get_c_qos_profile()
            )
        node.on_destroy(self._subscription.destroy_when_not_in_use)

    def take(self) -> Iterator[Any]:
        """Yield the messages since the last call, the oldest first; at most as many as are kept."""
        with self._subscription:
            for _ in range(self._depth):
                taken = self._subscription.take_message(self._type, False)
                if taken is None:
                    return
                yield taken[0]


FEEDBACK_DEPTH = 10
"""Feedback messages that are kept for the next look; several goals may share the topic."""


class ActionClient:
    """Talks to the server of an action.

    Args:
        node: The node that talks.
        action_type: The action.
        name: Its name.

    Attributes:
        name: The resolved name of the action.
    """

    def __init__(self, node: FlorenceNode, action_type: Any, name: str) -> None:
        self._node = node
        self._types = action_type.Impl
        self.name = name = node.resolve_action_name(name)
        self._status_topic = f"{name}/_action/status"
        self._goals = node.create_client(self._types.SendGoalService, f"{name}/_action/send_goal")
        self._results = node.create_client(self._types.GetResultService, f"{name}/_action/get_result")
        self._cancels = node.create_client(CancelGoal, f"{name}/_action/cancel_goal")
        self._feedback = LatestMessages(
            node, self._types.FeedbackMessage, f"{name}/_action/feedback", FEEDBACK_DEPTH
        )
        self._servers = DiscoveredServers(lambda: node.get_publishers_info_by_topic(self._status_topic))

    def server_is_ready(self) -> bool:
        """Tell whether every part of a server has been discovered, and its process has not ended since."""
        services = (self._goals, self._results, self._cancels)
        return all(service.service_is_ready() for service in services) and self.servers() > 0

    def servers(self) -> int:
        """Return how many servers of this name are there."""
        return len(self.server_ids())

    def server_ids(self) -> set[bytes]:
        """Return the ids of the servers that are there."""
        return self._servers.ids()

    def send_goal(self, goal_id: UUID, goal: Any) -> Future:
        """Send a goal; the answer has ``accepted``."""
        return self._goals.call_async(self._types.SendGoalService.Request(goal_id=goal_id, goal=goal))

    def ask_result(self, goal_id: UUID) -> Future:
        """Ask for the result of a goal, which comes when it has ended: ``status`` and ``result``."""
        return self._results.call_async(self._types.GetResultService.Request(goal_id=goal_id))

    def cancel(self, goal_id: UUID) -> Future:
        """Ask for the end of a goal, also before its acceptance; the answer is a ``CancelGoal.Response``."""
        return self._cancels.call_async(CancelGoal.Request(goal_info=GoalInfo(goal_id=goal_id)))

    def feedback(self) -> Iterator[Any]:
        """Return the latest feedback messages since the last call, of any goal, the oldest first."""
        return self._feedback.take()
