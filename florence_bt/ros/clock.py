"""The core's clock over the clocks of rclpy: the ROS time of a node, simulated or not, and the steady time.

Everything here belongs to the executor's thread; other threads use ``FlorenceNode.call_soon``.
"""

from __future__ import annotations

import heapq
import itertools
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock as RclClock
from rclpy.clock import ClockChange, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Callback

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.shared_clock import SharedClock

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
            node: The node whose executor runs the callbacks, and which takes their exceptions.
            clock: The source of the time.
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
        """Forget every callback; what is requested later never comes."""
        self._closed = True
        self._queue.clear()
        self._node.destroy_timer(self._timer)

    def shift(self, seconds: float) -> None:
        """Move every waiting moment; :meth:`rearm` has to follow when the clock has settled."""
        self._queue = [(when + seconds, order, timer) for when, order, timer in self._queue]

    def rearm(self) -> None:
        """Set the rclpy timer again."""
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


SET_BACK_S = 0.1
"""A wall clock that is behind what it said by more than this was set back; ntpd slews smaller errors."""
FIRST_TIME_S = 1.0
"""A simulated clock that starts below this is taken to have been known from the beginning."""


class SteadyClock(TimerQueue):
    """The time of this machine, whatever the simulated time does.

    For what depends on machines and networks and not on the robot: whether another process answers.
    """

    def __init__(self, node: FlorenceNode) -> None:
        super().__init__(node, RclClock(clock_type=ClockType.STEADY_TIME))

    def now(self) -> float:
        """The time in seconds, on the same scale as rclpy's steady clock."""
        return time.monotonic()


class RosClock(TimerQueue):
    """The ROS time of a node, the wall clock or a simulated one.

    With simulated time, the time is zero until the first message on ``/clock``. A wait across that moment,
    or while the clock is set back (a simulation that starts over, a wall clock that is corrected), keeps its
    remaining length: only the epoch changes.

    Attributes:
        source: What gives the simulated time; None when rclpy does, and for the wall clock.
        sure: Whether the time is known to go on from here. If not, the next message begins a new epoch.
    """

    _read = TimerQueue.now

    def __init__(self, node: FlorenceNode, call_soon: Callable[[Callback], None]) -> None:
        """Make the clock.

        Args:
            node: The node whose clock it is.
            call_soon: Runs a callback on the node's executor.
        """
        ros_clock = node.get_clock()
        super().__init__(node, ros_clock)
        self._call_soon = call_soon
        self.source: SharedClock | None = None
        self.sure = True
        self._asked = False
        self._latest = 0.0
        self._on_reset: list[Callback] = []
        self._before_jump = 0.0
        self._jumps = ros_clock.create_jump_callback(
            JumpThreshold(
                min_forward=Duration(nanoseconds=int(FIRST_TIME_S * NANO)),
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=True,
            ),
            pre_callback=self._before_time_jump,
            post_callback=self._after_time_jump,
        )

    def now(self) -> float:
        """The time in seconds."""
        self.refresh()
        now, latest = self._read(), self._latest
        self._latest = now
        if now < latest - SET_BACK_S:
            # Only a wall clock: rclpy reports jumps of the simulated one. Another thread may have asked.
            self._call_soon(lambda: self._wall_clock_set_back(latest - now))
        return now

    def now_near(self, stamp: float, within_s: float) -> float:
        """The time, or the simulated time known last when a stamp is near that already.

        To ask for the simulated time of this moment would keep an idle process listening to the clock.
        """
        if self.source is not None and abs(stamp - self._read()) <= within_s:
            return self._read()
        return self.now()

    def arrival_time(self) -> float:
        """The time of what a device has just sent; for the thread that reads it.

        The bytes of a simulated device overtake the message on ``/clock`` of their moment: a scan would be
        stamped earlier than it was taken. So the next message is waited for.
        """
        if self.source is not None:
            self.source.wait_for_message()
        return self.now()

    def on_reset(self, callback: Callback) -> None:
        """Call back, on the executor, when the time starts or was set back: known stamps are useless then."""
        self._on_reset.append(callback)

    def forget_reset(self, callback: Callback) -> None:
        """Call back no more."""
        self._on_reset.remove(callback)

    def refresh(self) -> None:
        """Bring the clock of rclpy up to date, also when it was not read for long."""
        self._asked = True
        source = self.source
        if source is not None and not source.listens:
            source.listen()

    def was_asked(self) -> bool:
        """Whether a timer runs, or the time was read since the last call of this."""
        asked, self._asked = self._asked, False
        return asked or self.waiting > 0 or self._others_wait()

    def close(self) -> None:
        """Forget every callback and stop listening to time jumps; what is requested later never comes."""
        self._jumps.unregister()
        super().close()

    def _others_wait(self) -> bool:
        """Whether a timer of rclpy runs on this clock beside ours, e.g. one of a third-party skill."""
        return any(
            timer is not self._timer
            and timer.clock.clock_type == ClockType.ROS_TIME
            and not timer.is_canceled()
            for timer in self._node.timers
        )

    def _before_time_jump(self) -> None:
        self._before_jump = self._read()

    def _after_time_jump(self, jump: TimeJump) -> None:
        now, before = self._read(), self._before_jump
        new_epoch = jump.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)
        self._latest = now
        if new_epoch or now < before or before == 0.0:
            self.shift(now - before)
            # The ROS timer is in the midst of the jump itself; it is set when that is over.
            self._call_soon(self._begin_epoch)
        elif not self.sure:
            self.shift(now - before)
            self._call_soon(self.rearm)

    def _wall_clock_set_back(self, seconds: float) -> None:
        self.shift(-seconds)
        self._begin_epoch()

    def _begin_epoch(self) -> None:
        """Timers keep their remaining length; what was stamped before is useless."""
        self.rearm()
        for callback in self._on_reset:
            callback()
