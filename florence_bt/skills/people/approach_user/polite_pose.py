"""Where to stand in front of a person: three proposals at a safe distance, then as near as possible.

Pure functions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.outcome import Result, failure, success

if TYPE_CHECKING:
    from florence_bt.core.sensing import OccupancyGrid

DEFAULT_SAFE_DISTANCE = 0.5
"""Metres; document, table 13."""
ANGLE_OFFSETS = (0.0, math.radians(45.0), math.radians(-45.0))
"""Radians, by trial; REFERENCE 12.8."""
TRIALS = len(ANGLE_OFFSETS)
MINIMUM_SAFE_DISTANCE, MAXIMUM_SAFE_DISTANCE = 0.3, 2.0
LETHAL_COST = 99
"""Occupancy value (0..100) from which the robot would touch something; costmap value 253, REFERENCE 12.8."""
TURNING_RADIUS = 0.2625
"""Metres: circumscribed radius of the padded footprint; REFERENCE 7.4."""
FARTHEST = 2.5
"""Metres; further away is not in front of a person."""
WAY_WEIGHT = 0.05
"""What a metre of way is worth, in metres nearer to the person."""


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


def nearest_pose(user: Pose2, robot: Pose2, safe_distance: float, costmap: OccupancyGrid) -> Pose2 | None:
    """The place nearest to a person, at the safe distance or more, at which the robot can turn.

    Who sits on a sofa or lies in bed can often not be met at the safe distance. Only places count to which
    the robot gets without leaving the surroundings of the person, so none behind a wall.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot is, map frame.
        safe_distance: Metres.
        costmap: 99 and more where the robot would touch something, 100 where something stands.

    Returns:
        The pose, which faces the person; None when there is no such place within ``FARTHEST``.
    """
    import numpy as np
    from scipy import ndimage

    from florence_bt.core.sensing import OCCUPIED

    rows, columns = costmap.cells.shape
    x = costmap.origin.x + (np.arange(columns) + 0.5) * costmap.resolution
    y = costmap.origin.y + (np.arange(rows) + 0.5) * costmap.resolution
    apart = np.hypot(x[None, :] - user.x, y[:, None] - user.y)
    row, column = costmap.cell_of(robot.x, robot.y)
    around = apart <= max(robot.distance_to(user), FARTHEST) + costmap.resolution
    passable = around & (costmap.cells < LETHAL_COST)
    if not costmap.contains(row, column):
        return None
    passable[row, column] = True
    parts, _ = ndimage.label(passable, np.ones((3, 3)))
    free = np.pad(costmap.cells < OCCUPIED, 1, constant_values=True)
    clearance = ndimage.distance_transform_edt(free)[1:-1, 1:-1] * costmap.resolution
    places = (parts == parts[row, column]) & (clearance >= TURNING_RADIUS)
    places &= (apart >= safe_distance - costmap.resolution / 2) & (apart <= FARTHEST)
    if not places.any():
        return None
    # Of places that are about as near to the person, the one with the shortest way.
    way = np.hypot(x[None, :] - robot.x, y[:, None] - robot.y)
    cost = np.where(places, apart + WAY_WEIGHT * way, np.inf)
    best_row, best_column = np.unravel_index(np.argmin(cost), cost.shape)
    place = Pose2(float(x[best_column]), float(y[best_row]))
    return Pose2(place.x, place.y, math.atan2(user.y - place.y, user.x - place.x))


def propose_approach(
    user: Pose2,
    robot: Pose2,
    trial: int,
    safe_distance: float = DEFAULT_SAFE_DISTANCE,
    costmap: OccupancyGrid | None = None,
) -> Result:
    """Propose a pose and check that it is free.

    Args:
        user: Where the person is, map frame.
        robot: Where the robot was when the approach began, map frame.
        trial: 1 to 3 for the proposals of :func:`polite_pose`, 4 for that of :func:`nearest_pose`.
        safe_distance: Metres.
        costmap: None when there is none yet: the first three proposals then pass unchecked.

    Returns:
        Success with the output ``pose``; or ``pose_occupied``, with the pose as well if there is one; or
        ``bad_input``.
    """
    problem = _problem_with(user, robot, trial, safe_distance)
    if problem:
        return failure("bad_input", problem)
    if trial > TRIALS:
        nearest = nearest_pose(user, robot, safe_distance, costmap) if costmap is not None else None
        if nearest is None:
            return failure("pose_occupied", f"no place within {FARTHEST} m of the person can be reached")
        return success(pose=nearest)
    pose = polite_pose(user, robot, trial, safe_distance)
    if costmap is None:
        return success(pose=pose)
    row, column = costmap.cell_of(pose.x, pose.y)
    cost = int(costmap.cells[row, column]) if costmap.contains(row, column) else 0
    if cost >= LETHAL_COST:
        reason = f"the place ({pose.x:.2f}, {pose.y:.2f}) of trial {trial} is not free: cost {cost}"
        return failure("pose_occupied", reason, pose=pose)
    return success(pose=pose)


def _problem_with(user: Pose2, robot: Pose2, trial: int, safe_distance: float) -> str | None:
    if not (user.is_finite() and robot.is_finite()):
        return f"the positions must be finite: user {user}, robot {robot}"
    if not 1 <= trial <= TRIALS + 1:
        return f"trial is {trial}, it must be 1 to {TRIALS + 1}"
    if not MINIMUM_SAFE_DISTANCE <= safe_distance <= MAXIMUM_SAFE_DISTANCE:
        limits = f"{MINIMUM_SAFE_DISTANCE} to {MAXIMUM_SAFE_DISTANCE} m"
        return f"safe_distance is {safe_distance} m, it must be {limits}"
    return None
