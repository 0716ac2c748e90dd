"""Hears topics without decoding what comes, and without being woken by it."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from florence_bt.core.interfaces import load_interface
from florence_bt.ros.qos import NO_EVENTS

Taken = tuple[int, str, bytes]
"""A message with the time when it was received (nanoseconds since 1970) and its topic, serialised."""
OVERLAP_S = 0.9
"""So long a subscription that is replaced goes on: the new one has yet to find its publishers."""


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
        self._replaced: dict[str, _Replaced] = {}
        self._left: list[Taken] = []

    def __contains__(self, topic: str) -> bool:
        """Tell whether a topic is subscribed to."""
        return topic in self._subscriptions

    def subscribe(self, topic: str, type_name: str, qos: QoSProfile) -> None:
        """Subscribe to a topic, once more if need be: its latched message comes again."""
        self._end(topic)
        before = self._subscriptions.pop(topic, None)
        if before is not None:
            self._replaced[topic] = _Replaced(before, time.monotonic() + OVERLAP_S)
        self._subscriptions[topic] = self._node.create_subscription(
            load_interface(type_name), topic, _never_called, qos, raw=True, event_callbacks=NO_EVENTS
        )

    def unsubscribe(self, topic: str) -> None:
        """End the subscription to a topic; what came before is still taken."""
        self._end(topic)
        subscription = self._subscriptions.pop(topic, None)
        if subscription is not None:
            self._left += (taken for _, taken in _taken_from(topic, subscription))
            self._node.destroy_subscription(subscription)

    def take(self) -> list[Taken]:
        """Return what came since the last time, in the order in which it was received."""
        taken, self._left = self._left, []
        for topic, subscription in self._subscriptions.items():
            came = list(_taken_from(topic, subscription))
            replaced = self._replaced.get(topic)
            if replaced is not None:
                came = [
                    *replaced.not_twice(_taken_from(topic, replaced.subscription)),
                    *replaced.not_twice(came),
                ]
            taken += (message for _, message in came)
        over = [topic for topic, each in self._replaced.items() if time.monotonic() > each.until]
        for topic in over:
            self._end(topic)
        taken.sort(key=lambda each: each[0])
        return taken

    def _end(self, topic: str) -> None:
        """End the subscription to a topic that was replaced, if there is one."""
        replaced = self._replaced.pop(topic, None)
        if replaced is not None:
            left = replaced.not_twice(_taken_from(topic, replaced.subscription))
            self._left += (taken for _, taken in left)
            self._node.destroy_subscription(replaced.subscription)

    def close(self) -> None:
        """End the node."""
        self._node.destroy_node()


_Sent = tuple[int, bytes]
"""A message with the time when its publisher sent it: the same for every subscription."""


class _Replaced:
    """A subscription that another one takes the place of, until that has found its publishers.

    Args:
        subscription: It.
        until: When it ends, steady seconds.
    """

    def __init__(self, subscription: Subscription, until: float) -> None:
        self.subscription = subscription
        self.until = until
        self._seen: set[_Sent] = set()

    def not_twice(self, came: Iterable[tuple[_Sent, Taken]]) -> Iterator[tuple[_Sent, Taken]]:
        """Leave out what the other one of the two brought already."""
        for sent, taken in came:
            if sent not in self._seen:
                self._seen.add(sent)
                yield sent, taken


def _taken_from(topic: str, subscription: Subscription) -> Iterator[tuple[_Sent, Taken]]:
    handle = subscription.handle
    with handle:
        while (taken := handle.take_message(subscription.msg_type, True)) is not None:
            message, info = taken
            yield (info["source_timestamp"], message), (info["received_timestamp"], topic, message)


def _never_called(message: Any) -> None:
    """Is what a subscription must have; no executor calls it."""
