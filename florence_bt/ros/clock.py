"""The core's clock over the clocks of rclpy: the ROS time of a node, simulated or not, and the steady time.

Everything here belongs to the executor's thread; other threads use ``FlorenceNode.call_soon``.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.clock import Clock as RclClock
from rclpy.clock import ClockChange, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from florence_bt.core.clock import Callback
from florence_bt.ros._timer_queue import NANO, TimerQueue

FIRST_TIME_S = 1.0
"""A simulated clock that starts below this is taken to have been known from the beginning."""


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
    """

    def __init__(self, node: Node, call_soon: Callable[[Callback], None]) -> None:
        """Make the clock.

        Args:
            node: The node whose clock it is.
            call_soon: Runs a callback on the node's executor.
        """
        ros_clock = node.get_clock()
        super().__init__(node, ros_clock)
        self._call_soon = call_soon
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

    def close(self) -> None:
        """Forget every callback and stop listening to time jumps; what is asked for later never comes."""
        self._jumps.unregister()
        super().close()

    def _before_time_jump(self) -> None:
        self._before_jump = self.now()

    def _after_time_jump(self, jump: TimeJump) -> None:
        now = self.now()
        new_epoch = jump.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)
        if new_epoch or now < self._before_jump or self._before_jump == 0.0:
            self.shift(now - self._before_jump)
            # The ROS timer is in the midst of the jump itself; it is set when that is over.
            self._call_soon(self.rearm)
