"""Skills over topics: conditions, publications, and waiting for a message."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from florence_bt.core.message_skills import AnswerWait, MessageCondition, MessageWait
from florence_bt.core.outcome import Result
from florence_bt.core.serving import QuestionBinding, WaitBinding
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.ros._runs import Deadlines, PublicationRun, RemoteSkill
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE


class TopicCondition(MessageCondition):
    """A skill that answers at once from the last message of a topic, and reports changes of the answer.

    Its declaration says ``instant=True, reports_changes=True``.
    """

    def __init__(
        self,
        node: FlorenceNode,
        source: tuple[Any, str],
        *,
        to_result: Callable[[Inputs, Any], Result],
        max_age_s: float,
        qos: QoSProfile = RELIABLE,
    ) -> None:
        """Make a subscription.

        Args:
            node: The node that subscribes.
            source: Message type and topic.
            to_result: Judges a message by the inputs, as of :class:`MessageCondition`.
            max_age_s: Seconds after which a message does not count any more.
            qos: Of the topic.
        """
        self._node = node
        self._topic = node.resolve_topic_name(source[1])
        self.label = f"topic {self._topic}"
        super().__init__(node.timebase, self.label, to_result, max_age_s)
        node.create_subscription(source[0], source[1], self.take, qos)

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher."""
        return bool(self._node.count_publishers(self._topic) > 0)


class TopicPublication(RemoteSkill):
    """A skill that publishes one message, as soon as somebody listens."""

    external = True

    def __init__(
        self,
        node: FlorenceNode,
        topic: tuple[Any, str],
        to_message: Callable[[Inputs], Any],
        qos: QoSProfile = RELIABLE,
    ) -> None:
        """Make a publisher.

        Args:
            node: The node that publishes.
            topic: Message type and topic.
            to_message: The message from the inputs; raises FlorenceError, KeyError, TypeError or ValueError
                when they do not fit.
            qos: Of the topic.
        """
        self._node = node
        self._publisher = node.create_publisher(topic[0], topic[1], qos)
        super().__init__(f"topic {self._publisher.topic_name}", "message", to_message)

    def server_is_there(self) -> bool:
        """Tell whether somebody listens."""
        return bool(self._publisher.get_subscription_count() > 0)

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        channel = _Channel(self._publisher, message)
        return PublicationRun(self._node.steady, channel, Deadlines().accept_s, self.label)


class TopicWait(MessageWait):
    """A skill that waits for the next message of a topic."""

    external = True

    def __init__(
        self, node: FlorenceNode, message_type: Any, served: WaitBinding, qos: QoSProfile = RELIABLE
    ) -> None:
        """Make a subscription.

        Args:
            node: The node that subscribes.
            message_type: The type of the messages.
            served: The topic, what a message means, and how long to wait for one.
            qos: Of the topic.
        """
        self._node = node
        self._topic = node.resolve_topic_name(served.name)
        self.label = f"topic {self._topic}"
        super().__init__(node.timebase, self.label, served)
        node.create_subscription(message_type, served.name, self.take, qos)

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher."""
        return bool(self._node.count_publishers(self._topic) > 0)


class TopicAnswerWait(AnswerWait):
    """A skill that waits for the answer to what the robot says."""

    def __init__(self, node: FlorenceNode, served: QuestionBinding) -> None:
        """Make the subscriptions.

        Args:
            node: The node that subscribes.
            served: The topics, what an answer means, and how long to wait for one.
        """
        label = f"topic {node.resolve_topic_name(served.name)}"
        super().__init__(node.timebase, label, served, node.get_logger().warning)
        node.create_subscription(String, served.said, lambda message: self.hear(message.data), LATCHED)
        node.create_subscription(String, served.name, self.take, RELIABLE)


@dataclass(frozen=True, slots=True)
class _Channel:
    """The way of one message."""

    publisher: Publisher
    message: Any

    def server_is_there(self) -> bool:
        return bool(self.publisher.get_subscription_count() > 0)

    def send(self) -> None:
        self.publisher.publish(self.message)

    def stop(self) -> None:
        """Do nothing: what was published is out."""
