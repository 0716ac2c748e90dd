"""Callbacks at given moments on one rclpy clock.

One rclpy timer serves all waiting callbacks: it is set to the next moment, and stands still when nobody
waits. Setting it costs more than the rest of a reaction, so it is set only when a moment comes before the one
it is set to; when that one was cancelled, it fires for nothing, once.

Everything here belongs to the executor's thread.
"""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock as RclClock
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Callback

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode

NANO = 1_000_000_000


class QueueTimer:
    """A timer of a :class:`TimerQueue`."""

    __slots__ = ("_queue", "callback")

    def __init__(self, queue: TimerQueue, callback: Callback) -> None:
        self._queue = queue
        self.callback: Callback | None = callback

    def cancel(self) -> None:
        """Forget the callback."""
        if self.callback is not None:
            self.callback = None
            self._queue.forget_one()


class TimerQueue:
    """Time and timers of a node on one of the clocks of rclpy."""

    def __init__(self, node: FlorenceNode, clock: RclClock) -> None:
        """Make the queue.

        Args:
            node: The node whose executor runs the callbacks, and which is told of their exceptions.
            clock: What tells the time.
        """
        self._node = node
        self._handle: Any = clock.handle
        self._order = itertools.count()
        self._queue: list[tuple[float, int, QueueTimer]] = []
        self._cancelled = 0
        self._timer: RclTimer = node.create_timer(1.0, self._serve, clock=clock, autostart=False)
        self._armed_for: float | None = None
        self._closed = False

    def now(self) -> float:
        """The time in seconds."""
        # Asked several times in each reaction: without the objects that Clock.now() makes.
        return float(self._handle.get_now().nanoseconds) / NANO

    def call_at(self, when: float, callback: Callback) -> QueueTimer:
        """Call back once at ``when``, on the executor; equal moments in the order of the calls."""
        timer = QueueTimer(self, callback)
        heapq.heappush(self._queue, (when, next(self._order), timer))
        if self._armed_for is None or when < self._armed_for:
            self._arm()
        return timer

    @property
    def waiting(self) -> int:
        """How many callbacks wait."""
        return len(self._queue) - self._cancelled

    def forget_one(self) -> None:
        """A waiting timer was cancelled; clear up when those are many."""
        self._cancelled += 1
        if self._cancelled > 32 and self._cancelled > len(self._queue) // 2:
            self._queue = [entry for entry in self._queue if entry[2].callback is not None]
            heapq.heapify(self._queue)
            self._cancelled = 0

    def close(self) -> None:
        """Forget every callback; what is asked for later never comes."""
        self._closed = True
        self._queue.clear()
        self._node.destroy_timer(self._timer)

    def shift(self, seconds: float) -> None:
        """Move every waiting moment; :meth:`rearm` has to follow when the clock has settled."""
        self._queue = [(when + seconds, order, timer) for when, order, timer in self._queue]

    def rearm(self) -> None:
        """Set the rclpy timer anew."""
        self._armed_for = None
        self._arm()

    def _serve(self) -> None:
        self._armed_for = None
        now = self.now()
        due: list[QueueTimer] = []
        while self._queue and self._queue[0][0] <= now:
            due.append(heapq.heappop(self._queue)[2])
        self._arm()
        for timer in due:
            callback, timer.callback = timer.callback, None
            if callback is None:
                self._cancelled -= 1
            else:
                self._node.attempt(callback)

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
