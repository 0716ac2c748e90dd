"""What only the bumpers and cliff sensors feel: back off from it, and remember where it is."""

from __future__ import annotations

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters
from florence_bt.skills.navigation.navigate.results import BaseStop
from florence_bt.skills.navigation.navigate.state import Costmaps, RobotState

_GET_OFF_TIME_S = 2.0
"""How long backing off may take to release a bumper, whose travel is a centimetre or two."""
_BACK_OFF_TIME_S = 25.0
_MOST_BACK_OFFS = 3
"""So often a goal backs off from what only the bumpers feel; then it ends, as it would touch it again."""


class BackUp:
    """Drive straight back a little.

    Args:
        state: Where it begins.
        parameters: How far and how fast.
        time_allowance: Seconds it may take.
    """

    def __init__(self, state: RobotState, parameters: RecoveryParameters, time_allowance: float) -> None:
        self._start = state.pose
        self._p = parameters
        self._deadline = state.now + time_allowance

    def step(self, state: RobotState) -> Twist2:
        """The velocity of this moment; standstill when it is over or something or somebody is behind."""
        left = self._p.back_up_distance - self._start.distance_to(state.pose)
        over = left <= 0.01 or state.now > self._deadline
        if over or not state.clearance.is_free(-min(left + 0.05, 0.15), 0.0):
            return STANDSTILL
        return state.people.slowed(state.pose, Twist2(-self._p.back_up_speed, 0.0))


class ContactRecovery:
    """Backs off from what holds the base, and marks it in the costmaps: the next path goes round it.

    Attributes:
        last: What was touched last.
        back_offs: How often the robot backed off.
    """

    def __init__(self, costmaps: Costmaps, parameters: RecoveryParameters) -> None:
        self._costmaps = costmaps
        self._p = parameters
        self._since: float | None = None
        self._backing: BackUp | None = None
        self._touched: RobotState | None = None
        self.last = BaseStop()
        self.back_offs = 0

    @property
    def text(self) -> str:
        """What the robot does, for people."""
        return f"backing off: {self.last.text}"

    def step(self, state: RobotState) -> Twist2 | Result | None:
        """The velocity while backing off, a failure when that does not help, None without a contact."""
        stuck = self._watch(state)
        if stuck is not None:
            return stuck
        if self._backing is not None:
            command = self._backing.step(state)
            if not command.is_zero():
                return command
            self._backing = None
        if self._touched is not None and not state.stop.holds_forward:
            there, self._touched = self._touched, None
            self._costmaps.local_costmap.add_contact(there.pose, state.now)
            if there.localised:
                self._costmaps.global_costmap.add_contact(there.map_pose, state.now)
        return None

    def _watch(self, state: RobotState) -> Result | None:
        stop = state.stop
        if not stop.holds_forward:
            self._since = None
            return None
        if self._since is None:
            if self.back_offs == _MOST_BACK_OFFS:
                return stop.failure(f"{stop.text}, again after backing off {_MOST_BACK_OFFS} times")
            self._since = state.now
            self.back_offs += 1
            self._touched, self.last = state, stop
            self._backing = BackUp(state, self._p, _BACK_OFF_TIME_S)
        if state.now - self._since > _GET_OFF_TIME_S:
            return stop.failure(f"{stop.text}, and backing off did not help")
        return None
