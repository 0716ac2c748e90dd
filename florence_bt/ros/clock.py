"""The core's clock over the clocks of rclpy: the time of a node, simulated or not, and the steady time.

The time of a node goes on whatever happens to the clock that tells it: see :class:`RosClock`. Everything here
belongs to the executor's thread, except reading the time; other threads use ``FlorenceNode.call_soon``.
"""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from rclpy.clock import Clock as RclClock
from rclpy.clock import ClockType, JumpHandle, JumpThreshold, ROSClock
from rclpy.duration import Duration
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Callback
from florence_bt.ros.elapsed_time import TOLERANCE_S, ElapsedTime, machine_step, simulated_step

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.shared_clock import SharedClock

NANO = 1_000_000_000
"""Nanoseconds of a second."""


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


class TimerQueue(ABC):
    """Time and timers of a node."""

    def __init__(self, node: FlorenceNode, clock: RclClock | None) -> None:
        """Make the queue.

        Args:
            node: The node whose executor runs the callbacks, and which takes their exceptions.
            clock: The clock by which rclpy waits for the next moment; None when the owner calls
                :meth:`serve_soon` whenever the time has changed.
        """
        self._node = node
        self._order = itertools.count()
        self._queue: list[tuple[float, int, QueueTimer]] = []
        self._cancelled = 0
        self._timer: RclTimer | None = None
        if clock is not None:
            self._timer = node.create_timer(1.0, self._serve, clock=clock, autostart=False)
        self._armed_for: float | None = None
        self._closed = False

    @abstractmethod
    def now(self) -> float:
        """Return the time in seconds."""

    def call_at(self, when: float, callback: Callback) -> QueueTimer:
        """Call back once at ``when``, on the executor; equal moments in the order of the calls."""
        timer = QueueTimer(self, callback)
        heapq.heappush(self._queue, (when, next(self._order), timer))
        if self._armed_for is None or when < self._armed_for:
            self._arm()
        return timer

    @property
    def waiting(self) -> int:
        """Count the callbacks that wait."""
        return len(self._queue) - self._cancelled

    def forget_one(self) -> None:
        """Note that a waiting timer was cancelled; clear up when there are many."""
        self._cancelled += 1
        if self._cancelled > 32 and self._cancelled > len(self._queue) // 2:
            self._queue = [entry for entry in self._queue if entry[2].callback is not None]
            heapq.heapify(self._queue)
            self._cancelled = 0

    def close(self) -> None:
        """Forget every callback; what is requested later never comes."""
        self._closed = True
        self._queue.clear()
        if self._timer is not None:
            self._node.destroy_timer(self._timer)

    def shift(self, seconds: float) -> None:
        """Move every waiting moment."""
        self._queue = [(when + seconds, order, timer) for when, order, timer in self._queue]

    def serve_soon(self, now: float) -> None:
        """Have the callbacks run that are due, after what the executor is about."""
        if self._queue and self._queue[0][0] <= now:
            self._node.call_soon(self._serve)

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
        if self._timer is None:
            self.serve_soon(self.now())
            return
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


FIRST_TIME_S = 1.0
"""A simulated clock that starts below this is taken to have been known from the beginning."""
SETTLED_S = 0.5
"""For so long after a jump, messages may arrive whose sender or receiver did not know of it (chosen: many
times what a message takes)."""
TOLD_AGAIN_S = 10.0
"""A clock that jumps again and again is told of so often (chosen)."""


class SteadyClock(TimerQueue):
    """The time of this machine, whatever the simulated time does.

    For what depends on machines and networks and not on the robot: whether another process answers.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self.rcl_clock = RclClock(clock_type=ClockType.STEADY_TIME)
        super().__init__(node, self.rcl_clock)

    def now(self) -> float:
        """Return the time in seconds, on the same scale as rclpy's steady clock."""
        return time.monotonic()


class RosClock(TimerQueue):
    """The time of a node: that of its ROS clock, the wall clock or a simulated one, without the jumps.

    Waits, ages and deadlines are of this time. It stands still when a simulation does, and runs as fast. When
    the ROS clock is set (a simulation that starts over, a second ``/clock``, a machine whose clock is
    corrected), this time goes on as if nothing had happened. Stamps of messages are on the ROS clock's scale:
    :meth:`stamp_of` and :meth:`time_of` convert where a message leaves or comes in. As long as the clock has
    not jumped, both are the same number.

    With simulated time, the time is zero until the first message on ``/clock``, and begins with what that
    says; a wait across that moment keeps its length.

    Attributes:
        source: What gives the simulated time; None when rclpy does, and for the wall clock.
        simulated: Whether the time comes from ``/clock``.
    """

    _told_at: ClassVar[float] = -TOLD_AGAIN_S
    """Steady time of the last line about a jump: one line for all nodes of a process."""

    def __init__(self, node: FlorenceNode, call_soon: Callable[[Callback], None]) -> None:
        """Make the clock.

        Args:
            node: The node whose clock it is.
            call_soon: Runs a callback on the node's executor.
        """
        ros_clock = node.get_clock()
        self.simulated = isinstance(ros_clock, ROSClock) and ros_clock.ros_time_is_active
        # No timer of rclpy on the ROS clock. On the wall clock it would wait an hour longer when that is set
        # back by an hour. On a simulated one, setting it again and again before its moment doubles what the
        # events executor of rclpy 7.1 does: after 20 times it is busy for seconds.
        super().__init__(node, None if self.simulated else RclClock(clock_type=ClockType.STEADY_TIME))
        self._handle: Any = ros_clock.handle
        self._call_soon = call_soon
        self.source: SharedClock | None = None
        self._asked = False
        self._on_reset: list[Callback] = []
        self._reading = threading.Lock()
        counted = simulated_step if self.simulated else machine_step
        self._elapsed = ElapsedTime(counted, self._read(), time.monotonic())
        self._began = not self.simulated
        self._start = 0.0
        self._jumps = self._watch(ros_clock)

    def follow(self, source: SharedClock | None) -> None:
        """Let this give the simulated time, and call :meth:`ros_time_came`, or rclpy when it is None.

        What rclpy makes of each new time to tell of it costs six times as much as that call.
        """
        self.source = source
        self._jumps.unregister()
        if source is None:
            self._jumps = self._watch(self._node.get_clock())

    def now(self) -> float:
        """Return the time in seconds; it never goes back and never leaps."""
        self.refresh()
        return self._update()[1]

    def ros_now(self) -> float:
        """Return what the ROS clock says, in seconds, which is what messages are stamped with."""
        self.refresh()
        return self._update()[0]

    def stamp_of(self, when: float) -> float:
        """Return the stamp of a moment, for a message that leaves."""
        return when + self._elapsed.offset

    def time_of(self, stamp: float) -> float:
        """Return the moment that a stamp names, for a message that has come."""
        return stamp - self._elapsed.offset

    def ros_now_near(self, stamp: float, within_s: float) -> float:
        """Return what the ROS clock says, or what it said last if a stamp is near that already.

        To ask for the simulated time of this moment would keep an idle process listening to the clock.
        """
        if self.source is not None and abs(stamp - self._read()) <= within_s:
            return self._read()
        return self.ros_now()

    def arrival_time(self) -> float:
        """Return the time of what a device has just sent; for the thread that reads it.

        The bytes of a simulated device overtake the message on ``/clock`` of their moment: a scan would be
        stamped earlier than it was taken. So the next message is waited for.
        """
        if self.source is not None:
            self.source.wait_for_message()
        return self.now()

    def on_reset(self, callback: Callback) -> None:
        """Call back, on the executor, when the ROS clock starts or has jumped, and once more soon after.

        What was on its way then may lie in the future, and would stay the newest until that comes.
        """
        self._on_reset.append(callback)

    def forget_reset(self, callback: Callback) -> None:
        """Call back no more."""
        self._on_reset.remove(callback)

    def ros_time_came(self) -> None:
        """Serve what is due by a new simulated time; on the executor's thread."""
        _, now = self._update()
        if self._start:
            self.shift(self._start)
            self._start = 0.0
            self._call_soon(self._reset)
        self.serve_soon(now)

    def refresh(self) -> None:
        """Bring the clock of rclpy up to date, also when it was not read for long."""
        self._asked = True
        source = self.source
        if source is not None and not source.listens:
            source.listen()

    def was_asked(self) -> bool:
        """Tell whether a timer runs, or the time was read since the last call of this."""
        asked, self._asked = self._asked, False
        return asked or self.waiting > 0 or self._others_wait()

    def close(self) -> None:
        """Forget every callback and stop listening to time jumps; what is requested later never comes."""
        self._jumps.unregister()
        super().close()

    def _watch(self, ros_clock: RclClock) -> JumpHandle:
        return ros_clock.create_jump_callback(
            JumpThreshold(
                min_forward=Duration(nanoseconds=1),
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=False,
            ),
            post_callback=lambda _jump: self.ros_time_came(),
        )

    def _others_wait(self) -> bool:
        """Tell whether a timer of rclpy runs on this clock beside ours, e.g. one of a third-party skill."""
        return any(
            timer is not self._timer
            and timer.clock.clock_type == ClockType.ROS_TIME
            and not timer.is_canceled()
            for timer in self._node.timers
        )

    def _read(self) -> float:
        # Asked several times in each reaction: without the objects that Clock.now() makes.
        return float(self._handle.get_now().nanoseconds) / NANO

    def _update(self) -> tuple[float, float]:
        """Read the ROS clock, on any thread; give what it says, and the time."""
        with self._reading:
            told, jump = self._read(), 0.0
            if self._began:
                jump = self._elapsed.read(told, time.monotonic())
            elif told > 0.0:
                self._began = True
                self._elapsed.begin_again(told, time.monotonic())
                self._start = told if told >= FIRST_TIME_S else 0.0
            now = self._elapsed.now
        if abs(jump) > TOLERANCE_S:
            self._call_soon(partial(self._after_jump, jump))
        return told, now

    def _after_jump(self, seconds: float) -> None:
        steady = self._node.steady
        if steady.now() - RosClock._told_at >= TOLD_AGAIN_S:
            RosClock._told_at = steady.now()
            self._node.get_logger().warning(
                f"the clock has jumped by {seconds:+.1f} s: waits, ages and deadlines go on as if it had not;"
                " new messages have its stamps, what was stamped before is forgotten"
            )
        self._reset()
        steady.call_at(steady.now() + SETTLED_S, self._reset)

    def _reset(self) -> None:
        for callback in self._on_reset:
            callback()
