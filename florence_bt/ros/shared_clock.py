"""One subscription to ``/clock`` for all nodes of a process.

Every rclpy node subscribes to the simulated time by itself, and each of these subscriptions costs a call into
Python a hundred times a second. Nodes that one loop serves can share the first one's message.

While no callback waits for a moment, an idle process does not subscribe at all. Reading the time, or setting
a timer, makes it subscribe again and wait for the next message. That takes some ten milliseconds, once.

A simulation that starts over sets the clock back. But a message that is far from the time known may come from
another program. It is believed when others have gone on from it for a while, and nobody from the time known.
"""

from __future__ import annotations

import struct
import threading
import time
from typing import Any

from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage

from florence_bt.core.clock import Timer
from florence_bt.core.topic_names import CLOCK
from florence_bt.ros.elapsed_time import MOST_STEP_S
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.rclpy_internals import join_clock_topic, leave_clock_topic, set_time, start_time
from florence_bt.ros.validation import BadMessage, check_time

QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""As in rclpy."""
IDLE_S = 5.0
"""Period of looking whether anybody has asked for the time since, or waits for a moment; steady time."""
FIRST_S = 0.5
"""Limit of the wait for the first message when it is needed again: the simulation may be standing."""
DEVICE_WAIT_S = 0.1
"""Limit of the wait of a thread that reads a device for the next message; steady time."""
_PAUSE_S = 0.0005
JUMP_S = 0.5
"""A longer step than :data:`MOST_STEP_S`, or one back, counts when for so long (steady time) messages have
gone on from there, and none from before. Chosen: at the lowest ``--speed``, 0.05, one comes every 0.2 s."""


class SharedClock:
    """Hands the simulated time to the nodes that follow it; those on the wall clock are left alone.

    A node belongs to it from :meth:`add` to :meth:`remove`; before and after it follows ``/clock`` by itself.

    Attributes:
        listens: Whether each message is received. If not, :meth:`listen` must be called before the clocks are
            read; :class:`florence_bt.ros.clock.RosClock` does.
        follows: Whether the message before the next one was received, so that the time between them is known.
    """

    def __init__(self) -> None:
        self.listens = True
        self._nodes: list[Node] = []
        self._subscription: Any = None
        self._time: Time | None = None
        self._suspect: Time | None = None
        self._suspected_since = 0.0
        self.follows = False
        self._look: Timer | None = None
        self._message_came = threading.Condition()

    def add(self, node: Node) -> None:
        """Give a node the time from now on; nothing happens when it does not follow the simulated time."""
        if not leave_clock_topic(node):
            return
        if self._nodes:
            self.listen()
        self._nodes.append(node)
        if len(self._nodes) == 1:
            self.listens = True
            self._subscribe(node)
        elif self._time is not None:
            start_time(node, self._time)
        if isinstance(node, FlorenceNode):
            node.ros_timebase.follow(self)
        self._look_later()

    def remove(self, node: Node) -> None:
        """Let a node follow the time by itself again; another one takes over its part."""
        if node not in self._nodes:
            return
        if isinstance(node, FlorenceNode):
            node.ros_timebase.follow(None)
        self._forget_look()
        if self._subscription is not None and node is self._nodes[0]:
            self._unsubscribe()
        self._nodes.remove(node)
        if self.listens and self._nodes and self._subscription is None:
            self._subscribe(self._nodes[0])
        self._look_later()
        join_clock_topic(node)

    def listen(self) -> None:
        """Receive each message from now on, and wait for the first one if there is a publisher.

        For the loop's thread only. The threads that read devices ask for the time too: that is safe, because
        a driver always waits for its next diagnostics, so its process never rests.
        """
        if self.listens:
            return
        self.listens = True
        node = self._nodes[0]
        self._subscribe(node)
        self._look_later()
        end = time.monotonic() + FIRST_S
        topic = node.resolve_topic_name(CLOCK)
        while node.count_publishers(topic) > 0 and time.monotonic() < end:
            taken = self._subscription.handle.take_message(ClockMessage, True)
            if taken is not None:
                self._on_clock(taken[0])
                return
            time.sleep(_PAUSE_S)
        self.follows = True  # the simulation stands: what it says next is measured from here

    def wait_for_message(self) -> None:
        """Wait for the next message, but no longer than DEVICE_WAIT_S: the simulation may be standing.

        For the threads that read devices: while the loop's own thread waits, no message comes.
        """
        with self._message_came:
            self._message_came.wait(DEVICE_WAIT_S)

    def _rest(self) -> None:
        """Unsubscribe, unless a timer runs or the time was read lately."""
        self._look = None
        asked = [node.ros_timebase.was_asked() for node in self._nodes if isinstance(node, FlorenceNode)]
        if self._time is None or any(asked):
            self._look_later()
        else:
            self._unsubscribe()
            self.listens = False

    def _look_later(self) -> None:
        ours = all(isinstance(node, FlorenceNode) for node in self._nodes)
        if self._look is None and self.listens and self._nodes and ours:
            steady = self._nodes[0].steady  # type: ignore[attr-defined]
            self._look = steady.call_at(steady.now() + IDLE_S, self._rest)

    def _forget_look(self) -> None:
        if self._look is not None:
            self._look.cancel()
            self._look = None

    def _subscribe(self, node: Node) -> None:
        self.follows = False
        # Raw: the message object costs more than all the rest, a hundred times a second in every process.
        self._subscription = node.create_subscription(ClockMessage, CLOCK, self._on_clock, QOS, raw=True)

    def _unsubscribe(self) -> None:
        self._nodes[0].destroy_subscription(self._subscription)
        self._subscription = None

    def _on_clock(self, message: bytes) -> None:
        seconds, nanoseconds = _STAMP[message[1] & 1].unpack_from(message, _HEADER)
        try:
            check_time(seconds, nanoseconds)
        except BadMessage as error:
            self._refuse(str(error))
            return
        now = Time(seconds=seconds, nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
        if not self._is_believed(now):
            self._refuse(
                f"the time jumps to {seconds} s (would have worked: to be the only one for {JUMP_S:g} s)"
            )
            return
        self._suspect = None
        self._time = now
        for node in self._nodes:
            set_time(node, now)
            if isinstance(node, FlorenceNode):
                node.ros_timebase.ros_time_came()
        self.follows = True
        with self._message_came:
            self._message_came.notify_all()

    def _is_believed(self, now: Time) -> bool:
        """Tell whether this time follows from the known one, or only others have come for long enough."""
        if self._time is None or not self.follows or _goes_on(self._time, now):
            return True
        before, self._suspect = self._suspect, now
        if before is None or not _goes_on(before, now):
            self._suspected_since = time.monotonic()
        return time.monotonic() - self._suspected_since >= JUMP_S

    def _refuse(self, problem: str) -> None:
        node = self._nodes[0]
        if isinstance(node, FlorenceNode):
            node.health.count_refused(CLOCK, problem)


def _goes_on(before: Time, now: Time) -> bool:
    return 0 <= now.nanoseconds - before.nanoseconds <= MOST_STEP_S * 1e9


_HEADER = 4
"""Bytes before the first field of a serialised message; the second one says whether the low byte is first."""
_STAMP = (struct.Struct(">iI"), struct.Struct("<iI"))
"""``builtin_interfaces/Time``: seconds and nanoseconds, by the byte order."""
