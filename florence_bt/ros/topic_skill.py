"""Skills over topics: conditions, publications, and waiting for a message."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from florence_bt.core.interfaces import name_of_interface
from florence_bt.core.message_skills import AnswerWait, MessageCondition, MessageWait
from florence_bt.core.outcome import Result
from florence_bt.core.serving import QuestionBinding, WaitBinding
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.ros._runs import PublicationRun, RemoteSkill, search_limit
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, STATE
from florence_bt.ros.server_processes import DiscoveredServers


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
        self._topic = node.resolve_topic_name(source[1])
        self._publishers = DiscoveredServers(lambda: node.get_publishers_info_by_topic(self._topic))
        self.label = _label(self._topic, source[0])
        super().__init__(node.timebase, self.label, to_result, max_age_s, self.server_is_there)
        # A publisher that keeps nothing for who comes later is heard by a subscription that asks for nothing.
        also = (STATE,) if qos is LATCHED else ()
        quiet = SubscriptionEventCallbacks(use_default_callbacks=not also)
        for each in (qos, *also):
            node.create_subscription(*source, self.take, each, judge_stamps=not also, event_callbacks=quiet)

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher whose process has not ended."""
        return bool(self._publishers.ids())


class TopicPublication(RemoteSkill):
    """A skill that publishes one message, as soon as somebody listens."""

    def __init__(
        self,
        node: FlorenceNode,
        topic: tuple[Any, str],
        to_message: Callable[[Inputs], Any],
        qos: QoSProfile = RELIABLE,
        *,
        deadline_s: float = 60.0,
    ) -> None:
        """Make a publisher.

        Args:
            node: The node that publishes.
            topic: Message type and topic.
            to_message: The message from the inputs; raises FlorenceError, KeyError, TypeError or ValueError
                when they do not fit.
            qos: Of the topic.
            deadline_s: What the skill declares; a subscriber is looked for within
                :func:`~florence_bt.ros._runs.search_limit`.
        """
        self._node = node
        self._within_s = search_limit(deadline_s)
        self._publisher = node.create_publisher(topic[0], topic[1], qos)
        self._listeners = _listeners(node, self._publisher)
        super().__init__(_label(self._publisher.topic_name, topic[0]), "message", to_message)

    def server_is_there(self) -> bool:
        """Tell whether somebody listens."""
        return bool(self._listeners.ids())

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        channel = _Channel(self._publisher, self._listeners, message)
        return PublicationRun(self._node.steady, channel, self._within_s, self.label)


class TopicWait(MessageWait):
    """A skill that waits for the next message of a topic."""

    def __init__(
        self,
        node: FlorenceNode,
        message_type: Any,
        served: WaitBinding,
        qos: QoSProfile = RELIABLE,
        *,
        deadline_s: float = 60.0,
    ) -> None:
        """Make a subscription.

        Args:
            node: The node that subscribes.
            message_type: The type of the messages.
            served: The topic, what a message means, and how long to wait for one.
            qos: Of the topic.
            deadline_s: What the skill declares; a publisher is looked for within
                :func:`~florence_bt.ros._runs.search_limit`.
        """
        self._topic = node.resolve_topic_name(served.name)
        self._publishers = DiscoveredServers(lambda: node.get_publishers_info_by_topic(self._topic))
        self.label = _label(self._topic, message_type)
        search_s = search_limit(deadline_s)
        super().__init__(node.timebase, self.label, served, self.server_is_there, search_s)
        # Each may be the one that is waited for, such as the press of a button.
        node.create_subscription(message_type, served.name, self.take, qos, newest_only=False)

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher whose process has not ended."""
        return bool(self._publishers.ids())


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
    listeners: DiscoveredServers
    message: Any

    def server_is_there(self) -> bool:
        return bool(self.listeners.ids())

    def send(self) -> None:
        self.publisher.publish(self.message)

    def stop(self) -> None:
        """Do nothing: what was published is out."""


def _listeners(node: FlorenceNode, publisher: Publisher) -> DiscoveredServers:
    return DiscoveredServers(lambda: node.get_subscriptions_info_by_topic(publisher.topic_name))


def _label(topic: str, message_type: type) -> str:
    return f"topic {topic} ({name_of_interface(message_type)})"
