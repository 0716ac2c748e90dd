"""The core's clock over the clocks of rclpy: the ROS time of a node, simulated or not, and the steady time.

Everything here belongs to the executor's thread; other threads use ``FlorenceNode.call_soon``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from rclpy.clock import Clock as RclClock
from rclpy.clock import ClockChange, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from florence_bt.core.clock import Callback
from florence_bt.ros._timer_queue import NANO, TimerQueue

FIRST_TIME_S = 1.0
"""A simulated clock that starts below this is taken to have been known from the beginning."""


class TimeSource(Protocol):
    """Who tells a node the simulated time; see :mod:`florence_bt.ros.shared_clock`."""

    @property
    def listens(self) -> bool:
        """Whether the time is told."""

    def listen(self) -> None:
        """Tell the time now and from now on."""


class SteadyClock(TimerQueue):
    """The time of this machine, whatever the simulated time does.

    For what depends on machines and networks and not on the robot: whether another process answers.
    """

    def __init__(self, node: Node) -> None:
        super().__init__(node, RclClock(clock_type=ClockType.STEADY_TIME))

    def now(self) -> float:
        """The time in seconds, on the same scale as rclpy's steady clock."""
        return time.monotonic()


class RosClock(TimerQueue):
    """The ROS time of a node, the wall clock or a simulated one.

    With simulated time, the time is zero until the first message on ``/clock``. Who waits across that moment,
    or across a simulation that starts over, keeps the rest of the wait: only the epoch changes.

    Attributes:
        source: Who tells the simulated time; None when rclpy does, and for the wall clock.
        sure: Whether the time is known to go on from here. If not, the next message begins a new epoch.
    """

    _read = TimerQueue.now

    def __init__(self, node: Node, call_soon: Callable[[Callback], None]) -> None:
        """Make the clock.

        Args:
            node: The node whose clock it is.
            call_soon: Runs a callback on the node's executor.
        """
        ros_clock = node.get_clock()
        super().__init__(node, ros_clock)
        self._call_soon = call_soon
        self.source: TimeSource | None = None
        self.sure = True
        self._asked = False
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
        return self._read()

    def refresh(self) -> None:
        """Have the clock of rclpy tell the time of this moment, also when nobody has asked for long."""
        self._asked = True
        source = self.source
        if source is not None and not source.listens:
            source.listen()

    def was_asked(self) -> bool:
        """Whether somebody waits, or has asked for the time since the last call of this."""
        asked, self._asked = self._asked, False
        return asked or self.waiting > 0 or self._others_wait()

    def close(self) -> None:
        """Forget every callback and stop listening to time jumps; what is asked for later never comes."""
        self._jumps.unregister()
        super().close()

    def _others_wait(self) -> bool:
        """Whether a timer of rclpy runs on this clock beside ours, e.g. one of somebody's skill."""
        return any(
            timer is not self._timer
            and timer.clock.clock_type == ClockType.ROS_TIME
            and not timer.is_canceled()
            for timer in self._node.timers
        )

    def _before_time_jump(self) -> None:
        self._before_jump = self._read()

    def _after_time_jump(self, jump: TimeJump) -> None:
        now = self._read()
        new_epoch = jump.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)
        if new_epoch or now < self._before_jump or self._before_jump == 0.0 or not self.sure:
            self.shift(now - self._before_jump)
            # The ROS timer is in the midst of the jump itself; it is set when that is over.
            self._call_soon(self.rearm)
