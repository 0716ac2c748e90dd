"""Hears topics without decoding what comes, and without being woken by it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from florence_bt.core.interfaces import load_interface
from florence_bt.ros.qos import NO_EVENTS

Taken = tuple[int, str, bytes]
"""When a message was received (nanoseconds since 1970), its topic, and it, serialised."""


class Intake:
    """Subscriptions whose messages wait in the middleware until they are taken, all at once.

    An executor that is woken for every message needs four times the processor time that the messages
    themselves do. So these subscriptions are of a node that no executor serves, with a name that tools hide.

    Args:
        name: Of the node.
        context: The ROS context.
    """

    def __init__(self, name: str, context: Context) -> None:
        self._node = Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        self._subscriptions: dict[str, Subscription] = {}
        self._left: list[Taken] = []

    def __contains__(self, topic: str) -> bool:
        """Tell whether a topic is subscribed to."""
        return topic in self._subscriptions

    def subscribe(self, topic: str, type_name: str, qos: QoSProfile) -> None:
        """Subscribe to a topic, once more if need be: its latched message comes again."""
        self.unsubscribe(topic)
        self._subscriptions[topic] = self._node.create_subscription(
            load_interface(type_name), topic, _never_called, qos, raw=True, event_callbacks=NO_EVENTS
        )

    def unsubscribe(self, topic: str) -> None:
        """End the subscription to a topic; what came before is still taken."""
        subscription = self._subscriptions.pop(topic, None)
        if subscription is not None:
            self._left += _taken_from(topic, subscription)
            self._node.destroy_subscription(subscription)

    def take(self) -> list[Taken]:
        """Return what came since the last time, in the order in which it was received."""
        taken, self._left = self._left, []
        for topic, subscription in self._subscriptions.items():
            taken += _taken_from(topic, subscription)
        taken.sort(key=lambda each: each[0])
        return taken

    def close(self) -> None:
        """End the node."""
        self._node.destroy_node()


def _taken_from(topic: str, subscription: Subscription) -> Iterator[Taken]:
    handle = subscription.handle
    with handle:
        while (taken := handle.take_message(subscription.msg_type, True)) is not None:
            message, info = taken
            yield info["received_timestamp"], topic, message


def _never_called(message: Any) -> None:
    """Is what a subscription must have; no executor calls it."""
