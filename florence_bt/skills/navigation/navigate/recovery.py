"""What to try when the way is blocked, and whether the robot gets on."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.core.limits import Positive, check_limits
from florence_bt.skills.navigation.navigate.clearance import Clearance


class Remedy(enum.Enum):
    """One thing to try."""

    CLEAR_FAR = "forgetting obstacles that are far away"
    ROTATE = "looking around"
    CLEAR_NEAR = "forgetting obstacles that are not close"
    BACK_UP = "backing up"


REMEDIES = (Remedy.CLEAR_FAR, Remedy.ROTATE, Remedy.CLEAR_NEAR, Remedy.BACK_UP, Remedy.ROTATE)
"""In this order, each followed by a new attempt (REFERENCE 7.3; backing up comes from Nav2, 7.9). What
is close is never forgotten: the Kinect cannot see it again from here."""


@dataclass(frozen=True, slots=True)
class RecoveryParameters:
    """When to recover, and how.

    Attributes:
        planner_patience: Seconds without a plan before recovering.
        controller_patience: Seconds without a velocity before recovering.
        conservative_reset_dist: Side of the window around the robot whose obstacles are kept, in metres.
        rotate_angle: How far to look around, in radians.
        back_up_distance: Metres.
        back_up_speed: m/s.
        required_movement_radius: The robot must move this far (m) ...
        required_movement_angle: ... or turn this far (rad) ...
        movement_time_allowance: ... in this many seconds.
        approach_time_allowance: It must get nearer to the goal than ever before in this many seconds.

    Source:
        REFERENCE 7.1, 7.3, 7.9.
    """

    planner_patience: Positive = 5.0
    controller_patience: Positive = 3.0
    conservative_reset_dist: Positive = 3.0
    rotate_angle: Positive = math.tau
    back_up_distance: Positive = 0.15
    back_up_speed: Positive = 0.08
    required_movement_radius: Positive = 0.25
    required_movement_angle: Positive = 0.5
    movement_time_allowance: Positive = 10.0
    approach_time_allowance: Positive = 40.0

    def __post_init__(self) -> None:
        check_limits(self)


class BackUp:
    """Drive straight back a little."""

    def __init__(self, start: Pose2, distance: float, speed: float, deadline: float) -> None:
        self._start = start
        self._distance = distance
        self._speed = speed
        self._deadline = deadline

    def step(self, now: float, pose: Pose2, clearance: Clearance) -> Twist2:
        """The velocity of this moment; standstill when it is over or something is behind the robot."""
        left = self._distance - self._start.distance_to(pose)
        if left <= 0.01 or now > self._deadline or not clearance.is_free(-min(left + 0.05, 0.15), 0.0):
            return STANDSTILL
        return Twist2(-self._speed, 0.0)


class ProgressWatch:
    """Whether the robot moves, and gets nearer to its goal."""

    def __init__(self, parameters: RecoveryParameters) -> None:
        self._p = parameters
        self._anchor: Pose2 | None = None
        self._anchor_time = 0.0
        self._least = math.inf
        self._least_time = 0.0

    def reset(self, now: float) -> None:
        """Start counting anew."""
        self._anchor = None
        self._least, self._least_time = math.inf, now

    def problem(self, now: float, pose: Pose2, remaining: float) -> str | None:
        """Why this is no progress, None when it is.

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
        if remaining < self._least - 0.1:
            self._least, self._least_time = remaining, now
        if now - self._anchor_time > p.movement_time_allowance:
            return f"the robot has not moved for {p.movement_time_allowance:g} s"
        if now - self._least_time > p.approach_time_allowance:
            return f"the robot has not come nearer to the goal for {p.approach_time_allowance:g} s"
        return None
