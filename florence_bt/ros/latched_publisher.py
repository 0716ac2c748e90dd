"""A latched publisher that knows its subscribers, for messages that are expensive to make."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED


class LatchedPublisher:
    """A latched publisher that knows its subscribers.

    One that is notified of new subscribers must live as long as its node: the events executor of rclpy 7.1
    crashes when a publisher goes while it has not yet reported that a subscriber joined or left.

    Args:
        node: The node that publishes.
        message_type: Type of the messages.
        topic: Name of the topic.
        on_join: Called when a subscriber has joined; should publish the present state.

    Attributes:
        topic: The resolved name of the topic.
        holds: Whether a new subscriber gets a message from the topic itself, perhaps an old one.
    """

    def __init__(
        self, node: FlorenceNode, message_type: Any, topic: str, on_join: Callable[[], None] | None = None
    ) -> None:
        self._node = node
        self._on_join = on_join
        events = PublisherEventCallbacks(matched=self._on_matched) if on_join is not None else None
        self._publisher: Publisher | None = node.create_publisher(
            message_type, topic, LATCHED, event_callbacks=events
        )
        self.topic = str(self._publisher.topic_name)
        self.holds = False

    @property
    def serves_new_subscribers(self) -> bool:
        """Tell whether every subscriber gets the last message from the topic itself.

        Not before there is one, and not when a subscriber does not ask for earlier messages.
        """
        return self.holds and not self._has_volatile_subscriber()

    @property
    def listeners(self) -> int:
        """Count the subscribers."""
        return self._publisher.get_subscription_count() if self._publisher is not None else 0

    def publish(self, message: Any) -> None:
        """Publish a message; after :meth:`close` nothing happens."""
        if self._publisher is not None:
            self.holds = True
            self._publisher.publish(message)

    def close(self) -> None:
        """Publish no more."""
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            self._node.destroy_publisher(publisher)

    def _has_volatile_subscriber(self) -> bool:
        listeners = self._node.get_subscriptions_info_by_topic(self.topic)
        return any(one.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL for one in listeners)

    def _on_matched(self, status: Any) -> None:
        if status.current_count_change > 0 and self._on_join is not None:
            self._node.call_soon(self._on_join)
