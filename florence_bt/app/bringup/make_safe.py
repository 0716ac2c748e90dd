"""Makes the robot stand still without any mission: cancels all goals, commands zero, waits until it stands.

For the first moment after a crash: the goals of the process that died may still be running on their servers
(docs/manual/runtime.md, restart).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.skill import BaseRun, Event, Phase
from florence_bt.core.topic_names import CMD_VEL, ODOMETRY
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.open_goals import OpenGoals
from florence_bt.ros.qos import RELIABLE, SENSOR

MAKE_SAFE_LIMIT_S = 15.0
"""Limit of the wait for the answers and for the base to stand, in steady time."""
SERVERS_SEARCH_S = 3.0
"""Time for finding servers; one that comes into sight later has restarted, without goals."""
ZERO_PERIOD_S = 0.1
"""Period of looking for servers, and of commanding zero."""
STANDING_SPEED = 0.01
"""Below this the base stands: m/s, and rad/s."""
STANDING_READINGS = 3
"""Odometry messages in a row that must say so."""


class BaseSafety:
    """Stops whatever moves the base.

    Args:
        node: The node that talks to the servers and to the base.
        goals: The goals that move the robot.
        limit_s: How long :meth:`make_safe` takes at most, in steady time.
    """

    def __init__(self, node: FlorenceNode, goals: OpenGoals, limit_s: float = MAKE_SAFE_LIMIT_S) -> None:
        self._node = node
        self._limit_s = limit_s
        self._goals = goals
        self._velocity = node.create_publisher(Twist, CMD_VEL, RELIABLE)

    def make_safe(self) -> StandStill:
        """Stop everything and watch the base until it stands."""
        return StandStill(self._node, self._goals, lambda: self._velocity.publish(Twist()), self._limit_s)


class StandStill(BaseRun):
    """A run that ends when all goals are cancelled and the base stands; in any case within its limit."""

    def __init__(
        self, node: FlorenceNode, goals: OpenGoals, command_zero: Callable[[], None], limit_s: float
    ) -> None:
        super().__init__("waiting for the base to stop")
        self._node = node
        self._goals = goals
        self._command_zero = command_zero
        self._unasked = list(goals.actions)
        self._unanswered: list[str] = []
        self._standing = 0
        self._received = False
        self._limit_s = limit_s
        now = node.steady.now()
        self._search_until, self._end = now + min(SERVERS_SEARCH_S, limit_s), now + limit_s
        # Only the speed counts; the supervisor's clock is not that of a simulated robot.
        self._odometry = node.create_subscription(
            Odometry, ODOMETRY, self._on_odometry, SENSOR, judge_stamps=False
        )
        self._step()

    def cancel(self) -> None:
        """Wait no longer; what was asked for stays asked for."""
        self._finish(failure("cancelled", "the wait for the base to stop was cancelled"))

    def _step(self) -> None:
        """Ask the servers that have come into sight, and command zero again."""
        if self.phase is Phase.DONE:
            return
        for action in tuple(self._unasked):
            if self._goals.server_is_there(action):
                self._unasked.remove(action)
                self._unanswered.append(action)
                self._goals.cancel_all(action, partial(self._answered, action))
        self._command_zero()
        now = self._node.steady.now()
        if now >= self._search_until:
            self._unasked.clear()
            self._finish_if_safe()
        if now >= self._end:
            self._finish(failure("timed_out", self._what_is_not_known()))
        else:
            self._node.steady.call_at(now + ZERO_PERIOD_S, self._step)

    def _answered(self, action: str) -> None:
        if action in self._unanswered:
            self._unanswered.remove(action)
        self._finish_if_safe()

    def _on_odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        stands = abs(twist.linear.x) < STANDING_SPEED and abs(twist.angular.z) < STANDING_SPEED
        self._received = True
        self._standing = self._standing + 1 if stands else 0
        self._finish_if_safe()

    def _finish_if_safe(self) -> None:
        if self._standing >= STANDING_READINGS and not self._unasked and not self._unanswered:
            self._finish(success())

    def _what_is_not_known(self) -> str:
        parts = [f"no answer from {', '.join(self._unanswered)}"] if self._unanswered else []
        if not self._received:
            parts.append("no odometry")
        elif self._standing < STANDING_READINGS:
            parts.append("the base is still moving")
        return f"not known to be safe after {self._limit_s:g} s: {'; '.join(parts)}"

    def _finish(self, result: Result) -> None:
        if self.phase is Phase.DONE:
            return
        self.handle(Event.FINISHED, result)
        # Perhaps this is a callback of that very subscription.
        self._node.call_soon(self._forget_odometry)

    def _forget_odometry(self) -> None:
        self._node.destroy_subscription(self._odometry)
