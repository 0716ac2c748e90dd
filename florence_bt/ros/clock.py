"""The core's clock over the ROS clock of a node, the wall clock or a simulated one.

One ROS timer serves all waiting callbacks: it is set to the next moment, and stands still when nobody waits.
Everything here belongs to the executor's thread; other threads use ``FlorenceNode.call_soon``.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable

from rclpy.clock import ClockChange, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Callback

NANO = 1_000_000_000
FIRST_TIME_S = 1.0
"""A simulated clock that starts below this is taken to have been known from the beginning."""


class RosTimer:
    """A timer of :class:`RosClock`."""

    __slots__ = ("_clock", "callback")

    def __init__(self, clock: RosClock, callback: Callback) -> None:
        self._clock = clock
        self.callback: Callback | None = callback

    def cancel(self) -> None:
        """Forget the callback."""
        if self.callback is not None:
            self.callback = None
            self._clock.forget_one()


class RosClock:
    """Time and timers of a node.

    With simulated time, the time is zero until the first message on ``/clock``. Who waits across that moment,
    or across a simulation that starts over, keeps the rest of the wait: only the epoch changes.
    """

    def __init__(self, node: Node, call_soon: Callable[[Callback], None]) -> None:
        """Make the clock.

        Args:
            node: The node whose clock it is.
            call_soon: Runs a callback on the node's executor.
        """
        self._node = node
        self._call_soon = call_soon
        self._ros_clock = node.get_clock()
        self._order = itertools.count()
        self._queue: list[tuple[float, int, RosTimer]] = []
        self._cancelled = 0
        self._before_jump = 0.0
        self._timer: RclTimer = node.create_timer(1.0, self._serve, clock=self._ros_clock, autostart=False)
        self._armed_for: float | None = None
        self._closed = False
        self._jumps = self._ros_clock.create_jump_callback(
            JumpThreshold(
                min_forward=Duration(nanoseconds=int(FIRST_TIME_S * NANO)),
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=True,
            ),
            pre_callback=self._before_time_jump,
            post_callback=self._after_time_jump,
        )

    def now(self) -> float:
        """The ROS time in seconds."""
        return float(self._ros_clock.now().nanoseconds) / NANO

    def call_at(self, when: float, callback: Callback) -> RosTimer:
        """Call back once at ``when``, on the executor; equal moments in the order of the calls."""
        timer = RosTimer(self, callback)
        heapq.heappush(self._queue, (when, next(self._order), timer))
        if self._queue[0][2] is timer:
            self._arm()
        return timer

    def forget_one(self) -> None:
        """A waiting timer was cancelled; clear up when those are many."""
        self._cancelled += 1
        if self._cancelled > 32 and self._cancelled > len(self._queue) // 2:
            self._queue = [entry for entry in self._queue if entry[2].callback is not None]
            heapq.heapify(self._queue)
            self._cancelled = 0
            self._arm()

    def close(self) -> None:
        """Forget every callback and stop listening to time jumps; what is asked for later never comes."""
        self._closed = True
        self._jumps.unregister()
        self._queue.clear()
        self._node.destroy_timer(self._timer)

    def _serve(self) -> None:
        self._armed_for = None
        now = self.now()
        due: list[RosTimer] = []
        while self._queue and self._queue[0][0] <= now:
            due.append(heapq.heappop(self._queue)[2])
        # Armed before the callbacks run, so that one that raises does not stop the others of later moments.
        self._arm()
        for timer in due:
            callback, timer.callback = timer.callback, None
            if callback is None:
                self._cancelled -= 1
            else:
                callback()

    def _arm(self) -> None:
        if self._closed:
            return
        while self._queue and self._queue[0][2].callback is None:
            heapq.heappop(self._queue)
            self._cancelled -= 1
        if not self._queue:
            self._armed_for = None
            self._timer.cancel()
            return
        when = self._queue[0][0]
        if when != self._armed_for:
            self._armed_for = when
            # Rounded up: a timer that fires a nanosecond early would find nothing due.
            self._timer.timer_period_ns = max(1, int((when - self.now()) * NANO) + 1)
            self._timer.reset()

    def _before_time_jump(self) -> None:
        self._before_jump = self.now()

    def _after_time_jump(self, jump: TimeJump) -> None:
        now = self.now()
        new_epoch = jump.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)
        if new_epoch or now < self._before_jump or self._before_jump == 0.0:
            shift = now - self._before_jump
            self._queue = [(when + shift, order, timer) for when, order, timer in self._queue]
            # The ROS timer is in the midst of the jump itself; it is set when that is over.
            self._call_soon(self._rearm)

    def _rearm(self) -> None:
        self._armed_for = None
        self._arm()
