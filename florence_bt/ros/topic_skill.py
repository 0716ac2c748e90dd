"""Skills over topics: conditions, publications, and waiting for a message."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_msgs.msg import String

from florence_bt.core.interfaces import name_of_interface
from florence_bt.core.message_skills import AnswerWait, MessageCondition, MessageWait
from florence_bt.core.outcome import Result
from florence_bt.core.server_comparison import PUBLISHER, SUBSCRIBER, Lack, Wanted
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
        limits: bool = True,
    ) -> None:
        """Make a subscription.

        Args:
            node: The node that subscribes.
            source: Message type and topic.
            to_result: Judges a message by the inputs, as of :class:`MessageCondition`.
            max_age_s: Seconds after which a message does not count any more.
            qos: Of the topic.
            limits: Whether messages are held against the limits of their type.
        """
        self._publishers = _TopicPublishers(node, source[1], source[0])
        self.label = self._publishers.label
        super().__init__(
            node.timebase, self.label, to_result, max_age_s, self.server_is_there, self._publishers.why_silent
        )
        # A publisher that keeps nothing for who comes later is heard by a subscription that asks for nothing.
        also = (STATE,) if qos is LATCHED else ()
        quiet = SubscriptionEventCallbacks(use_default_callbacks=not also)
        for each in (qos, *also):
            node.create_subscription(
                *source,
                self.take,
                each,
                judge_stamps=not also,
                limits=limits,
                refused=self.refuse,
                event_callbacks=quiet,
            )

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher whose process has not ended."""
        return self._publishers.are_there()

    def lack(self) -> Lack:
        """Return why nobody publishes, as far as the graph tells it."""
        return self._publishers.lack()


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
        self._wanted = Wanted(SUBSCRIBER, self._publisher.topic_name, name_of_interface(topic[0]))
        self._listeners = _listeners(node, self._wanted)
        super().__init__(_label(self._publisher.topic_name, topic[0]), "message", to_message)

    def server_is_there(self) -> bool:
        """Tell whether somebody listens."""
        return bool(self._listeners.ids())

    def lack(self) -> Lack:
        """Return why nobody listens, as far as the graph tells it."""
        return self._node.server_graph.lack(self._wanted)

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        channel = _Channel(self._publisher, self._listeners, message, self.lack)
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
        self._publishers = publishers = _TopicPublishers(node, served.name, message_type)
        self.label = publishers.label
        search_s = search_limit(deadline_s)
        super().__init__(
            node.timebase, self.label, served, publishers.are_there, search_s, publishers.why_silent
        )
        # Each may be the one that is waited for, such as the press of a button.
        node.create_subscription(
            message_type,
            served.name,
            self.take,
            qos,
            limits=not served.foreign,
            refused=self.refuse,
            newest_only=False,
        )

    def server_is_there(self) -> bool:
        """Tell whether the topic has a publisher whose process has not ended."""
        return self._publishers.are_there()

    def lack(self) -> Lack:
        """Return why nobody publishes, as far as the graph tells it."""
        return self._publishers.lack()


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
    lack: Callable[[], Lack]

    def server_is_there(self) -> bool:
        return bool(self.listeners.ids())

    def send(self) -> None:
        self.publisher.publish(self.message)

    def stop(self) -> None:
        """Do nothing: what was published is out."""


class _TopicPublishers:
    """Those who publish a topic with messages of a type."""

    def __init__(self, node: FlorenceNode, name: str, message_type: type) -> None:
        topic = node.resolve_topic_name(name)
        self.label = _label(topic, message_type)
        self._node = node
        self._wanted = wanted = Wanted(PUBLISHER, topic, name_of_interface(message_type))
        self._publishers = DiscoveredServers(
            lambda: _of_type(node.get_publishers_info_by_topic(topic), wanted.interface)
        )

    def are_there(self) -> bool:
        """Tell whether there is one whose process has not ended."""
        return bool(self._publishers.ids())

    def lack(self) -> Lack:
        """Return why there is none."""
        return self._node.server_graph.lack(self._wanted)

    def why_silent(self) -> str:
        """Return the same for people."""
        return str(self.lack())


def _listeners(node: FlorenceNode, wanted: Wanted) -> DiscoveredServers:
    return DiscoveredServers(
        lambda: _of_type(node.get_subscriptions_info_by_topic(wanted.name), wanted.interface)
    )


def _of_type(endpoints: list[TopicEndpointInfo], interface: str) -> list[TopicEndpointInfo]:
    """Return the endpoints that can be talked to: those of another type never meet."""
    return [each for each in endpoints if each.topic_type == interface]


def _label(topic: str, message_type: type) -> str:
    return f"topic {topic} ({name_of_interface(message_type)})"
