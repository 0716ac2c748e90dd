"""Contacts felt by bumpers, cliff sensors or the wheels alone: the robot backs off and remembers them."""

from __future__ import annotations

from collections import deque

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState

_GET_OFF_TIME_S = 2.0
"""Limit of backing off to release a bumper, whose travel is a centimetre or two."""
_BACK_OFF_TIME_S = 25.0
_MOST_BACK_OFFS = 3
"""So often a goal backs off from what only the bumpers feel; then it ends, as it would touch it again."""


_SLIP_S, _SLIP_M, _SLIP_SHARE = 2.0, 0.2, 0.3
"""The wheels slip when in so many seconds the odometry drives so far, and the robot this share of it."""
_FOUND_ELSEWHERE_M = 0.3
"""A localiser that moves the robot so far at once has found it elsewhere."""
_SLIPPING = BaseStop(
    "blocked", "the wheels turn and the robot stays where it is: something that no sensor sees is in the way"
)


class SlipWatch:
    """Compares the odometry with the place in the map, which the laser corrects: a glass top holds the robot
    above its bumper.
    """

    def __init__(self) -> None:
        self._past: deque[tuple[float, Pose2, Pose2]] = deque()
        self._place = Pose2()

    def slips(self, state: CycleState) -> bool:
        """Take the state of a cycle; whether the robot drives forward and gets nowhere. Then begins anew."""
        found_elsewhere = self._place.distance_to(state.map_from_odom) > _FOUND_ELSEWHERE_M
        self._place = state.map_from_odom
        if not state.localised or found_elsewhere:
            self._past.clear()
            return False
        self._past.append((state.now, state.pose, state.map_pose))
        while state.now - self._past[0][0] > _SLIP_S:
            self._past.popleft()
        since, odometry, in_map = self._past[0]
        ahead, _ = odometry.inverse().apply(state.pose.x, state.pose.y)
        long_enough = state.now - since > 0.8 * _SLIP_S and ahead > _SLIP_M
        slips = long_enough and in_map.distance_to(state.map_pose) < _SLIP_SHARE * ahead
        if slips:
            self._past.clear()
        return slips


class BackUp:
    """Drive straight back a little, over floor where the robot was: nothing sees what stands low behind it.

    Args:
        state: Where it begins.
        parameters: How far and how fast.
        time_allowance: Seconds it may take.
    """

    def __init__(self, state: CycleState, parameters: RecoveryParameters, time_allowance: float) -> None:
        self._start = state.pose
        self._p = parameters
        self._deadline = state.now + time_allowance

    def step(self, state: CycleState) -> Twist2:
        """Return the velocity; standstill when it is over, or what is behind is not free, or not known."""
        left = self._p.back_up_distance - self._start.distance_to(state.pose)
        over = left <= 0.01 or state.now > self._deadline
        way, bend = min(left + 0.05, 0.15), state.driven.curvature(state.pose)
        if over or not state.clearance.is_free(-way, -way * bend):
            return STANDSTILL
        if not state.driven.covers(state.pose, 0.0):
            return STANDSTILL
        return state.people.slowed(state.pose, Twist2(-self._p.back_up_speed, -self._p.back_up_speed * bend))


class ContactRecovery:
    """Backs off from what holds the robot; :mod:`contact_marks` remembers it, so the next path goes round it.

    Attributes:
        last: What was touched last.
        back_offs: How often the robot backed off.
    """

    def __init__(self, costmaps: Costmaps, parameters: RecoveryParameters) -> None:
        self._costmaps = costmaps
        self._p = parameters
        self._since: float | None = None
        self._backing: BackUp | None = None
        self._slip = SlipWatch()
        self.last = BaseStop()
        self.back_offs = 0

    @property
    def text(self) -> str:
        """Say what the robot does, for people."""
        return f"backing off: {self.last.text}"

    def step(self, state: CycleState) -> Twist2 | Result | None:
        """Return the velocity while backing off, a failure if that does not help, None without contact."""
        stuck = self._watch(state)
        if stuck is not None:
            return stuck
        if self._backing is not None:
            command = self._backing.step(state)
            if not command.is_zero():
                return command
            self._backing = None
        return None

    def _watch(self, state: CycleState) -> Result | None:
        stop = state.stop
        if not stop.holds_forward:
            self._since = None
            return self._touch(state, _SLIPPING) if self._slip.slips(state) else None
        if self._since is None:
            self._since = state.now
            result = self._touch(state, stop)
            if result is not None:
                return result
        if state.now - self._since > _GET_OFF_TIME_S:
            return stop.failure(f"{stop.text}, and backing off did not help")
        return None

    def _touch(self, state: CycleState, stop: BaseStop) -> Result | None:
        if self.back_offs == _MOST_BACK_OFFS:
            return stop.failure(f"{stop.text}, again after backing off {_MOST_BACK_OFFS} times")
        self.back_offs += 1
        self._costmaps.contacts.touch(state)
        self.last = stop
        self._backing = BackUp(state, self._p, _BACK_OFF_TIME_S)
        return None
