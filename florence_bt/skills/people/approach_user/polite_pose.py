"""Where to stand in front of a person: three proposals at a safe distance. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Callable

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.outcome import Result, failure, success

DEFAULT_SAFE_DISTANCE = 0.5
"""Metres; document, table 13."""
ANGLE_OFFSETS = (0.0, math.radians(45.0), math.radians(-45.0))
"""Radians, by trial; REFERENCE 12.8."""
TRIALS = len(ANGLE_OFFSETS)
MINIMUM_SAFE_DISTANCE, MAXIMUM_SAFE_DISTANCE = 0.3, 2.0
LETHAL_COST = 99
"""Occupancy value (0..100) from which the robot would touch something; costmap value 253, REFERENCE 12.8."""

CostAt = Callable[[float, float], int]
"""Occupancy 0..100 at a point of the map frame, -1 where it is unknown."""


def polite_pose(user: Pose2, robot: Pose2, trial: int, safe_distance: float = DEFAULT_SAFE_DISTANCE) -> Pose2:
    """Propose a pose at the safe distance that faces the person.

    Args:
        user: Where the person is, map frame; the yaw does not matter.
        robot: Where the robot was when the approach began, map frame; the yaw matters only when both
            positions are the same: the proposal then lies behind the robot.
        trial: 1, 2 or 3.
        safe_distance: Metres between the person and the proposal.

    Raises:
        ValueError: There is no such trial.

    Source:
        REFERENCE 12.8.
    """
    if not 1 <= trial <= TRIALS:
        raise ValueError(f"trial is {trial}, it must be 1 to {TRIALS}")
    if robot.distance_to(user) > 0.0:
        direction = math.atan2(robot.y - user.y, robot.x - user.x)
    else:
        direction = robot.yaw + math.pi
    direction += ANGLE_OFFSETS[trial - 1]
    return Pose2(
        user.x + safe_distance * math.cos(direction),
        user.y + safe_distance * math.sin(direction),
        normalize_angle(direction + math.pi),
    )


def propose_approach(
    user: Pose2,
    robot: Pose2,
    trial: int,
    safe_distance: float = DEFAULT_SAFE_DISTANCE,
    cost_at: CostAt | None = None,
) -> Result:
    """Propose a pose and check that it is free.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot was when the approach began, map frame.
        trial: 1, 2 or 3.
        safe_distance: Metres.
        cost_at: The costmap; None when there is none yet: the proposal then passes unchecked.

    Returns:
        Success with the output ``pose``; or ``pose_occupied``, with the pose as well; or ``bad_input``.
    """
    problem = _problem_with(user, robot, trial, safe_distance)
    if problem:
        return failure("bad_input", problem)
    pose = polite_pose(user, robot, trial, safe_distance)
    if cost_at is None:
        return success(pose=pose)
    cost = cost_at(pose.x, pose.y)
    if cost >= LETHAL_COST:
        reason = f"the place ({pose.x:.2f}, {pose.y:.2f}) of trial {trial} is not free: cost {cost}"
        return failure("pose_occupied", reason, pose=pose)
    return success(pose=pose)


def _problem_with(user: Pose2, robot: Pose2, trial: int, safe_distance: float) -> str | None:
    if not (user.is_finite() and robot.is_finite()):
        return f"the positions must be finite: user {user}, robot {robot}"
    if not 1 <= trial <= TRIALS:
        return f"trial is {trial}, it must be 1 to {TRIALS}"
    if not MINIMUM_SAFE_DISTANCE <= safe_distance <= MAXIMUM_SAFE_DISTANCE:
        limits = f"{MINIMUM_SAFE_DISTANCE} to {MAXIMUM_SAFE_DISTANCE} m"
        return f"safe_distance is {safe_distance} m, it must be {limits}"
    return None
