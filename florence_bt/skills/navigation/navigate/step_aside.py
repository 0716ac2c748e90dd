"""Places to step aside to, so that somebody can pass who stands before the robot."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import distance_transform_edt

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL
from florence_bt.skills.navigation.navigate.planner import ways_from
from florence_bt.skills.navigation.navigate.state import Costmaps

_KEEP_OFF_M = 0.5
"""The robot does not come so near to the middle of the person. Chosen: the safe distance of document, table
13."""
_LEAST_ROOM_M, _ENOUGH_ROOM_M = 0.35, 0.9
"""Distances of the nearest obstacle from which on the robot can turn, and somebody passes on either side."""
_WAY_PER_ROOM = 0.12
"""So many metres more of room are worth one metre more of way."""


def place_to_step_aside(costmaps: Costmaps, robot: Pose2, person: Point2, apart: float) -> Point2 | None:
    """Return the place with room to pass that is near, and away from the person.

    Args:
        costmaps: Where the robot drives.
        robot: The robot, map frame.
        person: Where the person is who wants to pass, map frame, metres.
        apart: How far from the person at least, metres.

    Returns:
        Metres, map frame; None when the robot cannot get away.
    """
    costmap = costmaps.global_costmap
    costs, resolution = costmap.master, costmap.resolution
    from_person, from_robot = costmap.distances_to(*person), costmap.distances_to(robot.x, robot.y)
    # The robot can leave where it stands, but not towards the person.
    free = (costs < INSCRIBED) | (from_robot < 2.0 * resolution)
    floor = free & ((from_person > _KEEP_OFF_M) | (from_person > from_robot))
    start = costmap.cell_of(robot.x, robot.y)
    if start is None:
        return None
    # The marks around the person are the person.
    solid = (costmaps.static == LETHAL) | ((costs == LETHAL) & (from_person > _KEEP_OFF_M))
    room = distance_transform_edt(~solid) * resolution
    worth = np.minimum(room, _ENOUGH_ROOM_M) - _WAY_PER_ROOM * ways_from(start, floor, resolution)
    worth[(from_person < apart) | (room < _LEAST_ROOM_M)] = -math.inf
    row, column = np.unravel_index(int(np.argmax(worth)), worth.shape)
    if not math.isfinite(worth[row, column]):
        return None
    return costmap.origin_x + (column + 0.5) * resolution, costmap.origin_y + (row + 0.5) * resolution
