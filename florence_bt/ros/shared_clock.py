"""One subscription to ``/clock`` for all nodes of a process.

Every rclpy node subscribes to the simulated time by itself, and each of these subscriptions costs a call into
Python a hundred times a second. Nodes that one loop serves can share the first one's message.
"""

from __future__ import annotations

import struct
from typing import Any

from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage

CLOCK_TOPIC = "/clock"
QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""As in rclpy."""


class SharedClock:
    """Hands the simulated time to the nodes that follow it; those on the wall clock are left alone.

    A node belongs to it from :meth:`add` to :meth:`remove`; before and after it follows ``/clock`` by itself.
    """

    def __init__(self) -> None:
        self._nodes: list[Node] = []
        self._subscription: Any = None
        self._time: Time | None = None

    def add(self, node: Node) -> None:
        """Tell a node the time from now on; nothing happens when it does not follow the simulated time."""
        source: Any = node._time_source
        if source._clock_sub is None:
            return
        node.destroy_subscription(source._clock_sub)
        source._clock_sub = None
        self._nodes.append(node)
        if len(self._nodes) == 1:
            self._subscribe(node)
        elif self._time is not None:
            source.clock_callback(ClockMessage(clock=self._time.to_msg()))

    def remove(self, node: Node) -> None:
        """Let a node follow the time by itself again; another one takes over its part."""
        if node not in self._nodes:
            return
        first = self._nodes[0]
        self._nodes.remove(node)
        if node is first:
            node.destroy_subscription(self._subscription)
            self._subscription = None
            if self._nodes:
                self._subscribe(self._nodes[0])
        source: Any = node._time_source
        if source.ros_time_is_active:
            source._subscribe_to_clock_topic()

    def _subscribe(self, node: Node) -> None:
        # Raw: the message object costs more than all the rest, a hundred times a second in every process.
        self._subscription = node.create_subscription(
            ClockMessage, CLOCK_TOPIC, self._on_clock, QOS, raw=True
        )

    def _on_clock(self, message: bytes) -> None:
        seconds, nanoseconds = _STAMP[message[1] & 1].unpack_from(message, _HEADER)
        time = self._time = Time(seconds=seconds, nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
        for node in self._nodes:
            clock: Any = node.get_clock()
            clock.set_ros_time_override(time)


_HEADER = 4
"""Bytes before the first field of a serialised message; the second one says whether the low byte is first."""
_STAMP = (struct.Struct(">iI"), struct.Struct("<iI"))
"""``builtin_interfaces/Time``: seconds and nanoseconds, by the byte order."""
