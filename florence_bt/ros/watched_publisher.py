"""A latched publisher whose messages are made only while somebody listens.

Making a message can cost more than what it tells of. So nothing is published without a listener; who joins
is given the state of the moment, and when the last one has left, the old message is forgotten: a late joiner
must not be given a state that has passed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED


class WatchedPublisher:
    """A latched publisher that knows its listeners.

    Args:
        node: The node that publishes.
        message_type: Type of the messages.
        topic: Name of the topic.
        on_join: Called when somebody has begun to listen; should publish the state of the moment.
        on_leave: Called when the last one has stopped listening.
    """

    def __init__(
        self,
        node: FlorenceNode,
        message_type: Any,
        topic: str,
        on_join: Callable[[], None],
        on_leave: Callable[[], None] | None = None,
    ) -> None:
        self._node = node
        self._type = message_type
        self._topic = topic
        self._on_join = on_join
        self._on_leave = on_leave
        self._holds = False
        self._publisher: Publisher | None = self._make()

    @property
    def topic(self) -> str:
        """The full name of the topic, empty when it is closed."""
        return self._publisher.topic_name if self._publisher is not None else ""

    @property
    def holds(self) -> bool:
        """Whether who joins is given a message by the topic itself."""
        return self._holds

    @property
    def listeners(self) -> int:
        """How many listen now."""
        return self._publisher.get_subscription_count() if self._publisher is not None else 0

    def publish(self, message: Any) -> None:
        """Publish a message; after :meth:`close` nothing happens."""
        if self._publisher is not None:
            self._holds = True
            self._publisher.publish(message)

    def close(self) -> None:
        """Publish no more."""
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            self._node.destroy_publisher(publisher)

    def _make(self) -> Publisher:
        self._holds = False
        return self._node.create_publisher(
            self._type,
            self._topic,
            LATCHED,
            event_callbacks=PublisherEventCallbacks(matched=self._on_matched),
        )

    def _on_matched(self, status: Any) -> None:
        if status.current_count_change > 0:
            # Not from within the event of the publisher itself, which the callback may want to close.
            self._node.call_soon(self._joined)
        elif status.current_count == 0:
            self._node.call_soon(self._left)

    def _joined(self) -> None:
        if self._publisher is not None:
            self._on_join()

    def _left(self) -> None:
        if self._publisher is None or self.listeners:
            return
        if self._holds:
            self._node.destroy_publisher(self._publisher)
            self._publisher = self._make()
        if self._on_leave is not None:
            self._on_leave()
