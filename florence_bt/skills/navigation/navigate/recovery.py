"""Recovery of a drive: the state machine of move_base as a table, and what counts as progress.

Source: REFERENCE 7.3.
"""

from __future__ import annotations

import enum
import math

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters


class DriveState(enum.Enum):
    """The states of a drive."""

    PLANNING = "planning"
    CONTROLLING = "controlling"
    CLEARING = "clearing"
    BACKING_OFF = "backing off"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"


class DriveEvent(enum.Enum):
    """The events of a drive."""

    PLAN_FOUND = "a plan was found"
    PLAN_LOST = "the newest plan fails"
    PLANNER_PATIENCE = "no plan for planner_patience, and a recovery behaviour is left"
    CONTROLLER_PATIENCE = "no velocity for controller_patience, and a recovery behaviour is left"
    NO_PROGRESS = "not moved or not nearer for the time allowed, and a recovery behaviour is left"
    UNSEEN = "something was seen at the goal, not from near"
    CLEARED = "the recovery behaviour is over"
    TOUCHED = "a bumper or cliff sensor, or wheels that slip"
    BACKED_OFF = "backed off"
    REACHED = "the goal is reached"
    HOPELESS = "no way on the map itself, or only one that was too tight, or the third touch"
    OFF = "a precise drive does not get nearer to its goal"
    OCCUPIED = "something stands at the goal for goal_patience"
    TIME_OVER = "give_up_time without progress"


_AT_WORK = (DriveState.PLANNING, DriveState.CONTROLLING, DriveState.CLEARING)

TRANSITIONS: dict[tuple[DriveState, DriveEvent], DriveState] = {
    (DriveState.PLANNING, DriveEvent.PLAN_FOUND): DriveState.CONTROLLING,
    (DriveState.PLANNING, DriveEvent.PLANNER_PATIENCE): DriveState.CLEARING,
    (DriveState.PLANNING, DriveEvent.HOPELESS): DriveState.ABORTED,
    (DriveState.PLANNING, DriveEvent.UNSEEN): DriveState.CLEARING,
    (DriveState.CONTROLLING, DriveEvent.REACHED): DriveState.SUCCEEDED,
    (DriveState.CONTROLLING, DriveEvent.PLAN_LOST): DriveState.PLANNING,
    (DriveState.CONTROLLING, DriveEvent.CONTROLLER_PATIENCE): DriveState.CLEARING,
    (DriveState.CONTROLLING, DriveEvent.NO_PROGRESS): DriveState.CLEARING,
    (DriveState.CONTROLLING, DriveEvent.OFF): DriveState.ABORTED,
    (DriveState.CLEARING, DriveEvent.CLEARED): DriveState.PLANNING,
    (DriveState.PLANNING, DriveEvent.OCCUPIED): DriveState.ABORTED,
    **{(state, DriveEvent.TOUCHED): DriveState.BACKING_OFF for state in _AT_WORK},
    (DriveState.BACKING_OFF, DriveEvent.BACKED_OFF): DriveState.PLANNING,
    (DriveState.BACKING_OFF, DriveEvent.HOPELESS): DriveState.ABORTED,
    **{(state, DriveEvent.TIME_OVER): DriveState.ABORTED for state in _AT_WORK},
}
"""(state, event) -> next state; nothing else can happen."""


class RecoveryBehaviour(enum.Enum):
    """One thing to try while clearing."""

    CONSERVATIVE_RESET = "forgetting obstacles that are far away"  # both: those that the laser marked
    CLEARING_ROTATION = "looking around"
    AGGRESSIVE_RESET = "forgetting obstacles that are not close"
    BACK_UP = "backing up"


RECOVERY_BEHAVIOURS = (
    RecoveryBehaviour.CONSERVATIVE_RESET,
    RecoveryBehaviour.CLEARING_ROTATION,
    RecoveryBehaviour.AGGRESSIVE_RESET,
    RecoveryBehaviour.BACK_UP,
    RecoveryBehaviour.CLEARING_ROTATION,
)
"""In this order, each followed by a new attempt (REFERENCE 7.3; backing up comes from Nav2, 7.9). What
is close is never forgotten: the Kinect cannot see it again from here."""

_DETOUR_M = 1.0
"""A path that is so much longer than the last one is another way: what is left of it counts from there."""
_GAIN_M = 0.002
_NEARER_M = 0.1
_SAME_PLACE_M = 0.5
"""A robot that is stuck again so near is stuck at the same place: it has backed up, and crept on."""
_STILL_S = 0.25
"""Moments that are no further apart are one span of time: two cycles of the controller."""


class ProgressWatch:
    """A watch that tells whether the robot moves, and gets nearer to its goal.

    Args:
        parameters: How far and how soon it has to.
        nearer_within: Seconds in which it has to get nearer; None takes ``approach_time_allowance``.
    """

    def __init__(self, parameters: RecoveryParameters, nearer_within: float | None = None) -> None:
        self._p = parameters
        self._nearer_within = nearer_within or parameters.approach_time_allowance
        self._anchor: Pose2 | None = None
        self._anchor_time = 0.0
        self._least = math.inf
        self._least_time = 0.0

    def reset(self, now: float) -> None:
        """Start counting again."""
        self._anchor = None
        self._least, self._least_time = math.inf, now

    def problem(self, now: float, pose: Pose2, remaining: float) -> str | None:
        """Tell why this does not count as progress, None when it does.

        Args:
            now: Seconds.
            pose: The robot, in the odometry frame.
            remaining: Metres left along the path.
        """
        p = self._p
        anchor = self._anchor
        if (
            anchor is None
            or anchor.distance_to(pose) >= p.required_movement_radius
            or abs(normalize_angle(pose.yaw - anchor.yaw)) >= p.required_movement_angle
        ):
            self._anchor, self._anchor_time = pose, now
        if remaining < self._least - _NEARER_M or remaining > self._least + _DETOUR_M:
            self._least, self._least_time = remaining, now
        if now - self._anchor_time > p.movement_time_allowance:
            return f"the robot has not moved for {p.movement_time_allowance:g} s"
        if now - self._least_time > self._nearer_within:
            return f"the robot has not come nearer to the goal for {self._nearer_within:g} s"
        return None


class StuckWatch:
    """Counts how long no way forward was free at a place, also when the robot gets on for moments in between.

    Args:
        parameters: How long that may last.

    Attributes:
        recovered: Whether a recovery behaviour was tried there.
    """

    def __init__(self, parameters: RecoveryParameters) -> None:
        self._patience = parameters.controller_patience
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._place: Pose2 | None = None
        self._last, self._seconds = -math.inf, 0.0
        self.recovered = False

    def too_long(self, now: float, place: Pose2) -> bool:
        """Note that no way is free; whether it has been so for too long.

        Args:
            now: Seconds.
            place: The robot, in the map frame.
        """
        if self._place is None or self._place.distance_to(place) > _SAME_PLACE_M:
            self.forget()
            self._place = place
        passed, self._last = now - self._last, now
        self._seconds += passed if passed < _STILL_S else 0.0
        return self._seconds > self._patience

    def note_recovery(self) -> None:
        """Note that a recovery behaviour is tried there: from then on the time counts anew."""
        self.recovered, self._seconds = True, 0.0


class LostTime:
    """Counts the time in which a drive gets no nearer to its goal.

    Args:
        parameters: How much nearer counts.
        now: Seconds.

    Attributes:
        seconds: In which the robot got no nearer along its path, since it last came nearer to the goal than
            ever before.
    """

    def __init__(self, parameters: RecoveryParameters, now: float) -> None:
        self._nearer = parameters.progress_distance
        self._now = now
        self._along = self._ever = math.inf
        self.seconds = 0.0

    def saw(self, now: float, remaining: float) -> bool:
        """Take what is left in this cycle; whether the robot is nearer to the goal than ever before.

        Args:
            now: Seconds.
            remaining: Metres left along the path, infinity without one.
        """
        passed, self._now = now - self._now, now
        if math.isfinite(remaining) and remaining > self._along + _DETOUR_M:
            self._along = remaining
        if remaining < self._along - _GAIN_M:
            self._along = remaining
        else:
            self.seconds += passed
        if remaining >= self._ever - self._nearer:
            return False
        self._ever, self.seconds = remaining, 0.0
        return True
