"""The straight line to a place: whether the robot sees along it, and may drive along it."""

from __future__ import annotations

import math

import numpy as np

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.costmap import moved_points
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.state import CycleState

PERSON_M = 0.6
"""Distance from the person within which the sensors' marks are the person."""
OWN_PLACE_M = 0.2
"""A line is looked at from here on; the robot itself stands on what lies before."""
_STEP_M = 0.05
"""Step along a line of sight. Chosen."""


def is_line_free(
    task: FollowTask, state: CycleState, place: Point2, person: Point2, least: int = INSCRIBED
) -> bool:
    """Tell whether the line to a place is free of costs from ``least`` on; at the person only the map counts.

    Args:
        task: The task.
        state: Of this moment.
        place: Odometry frame, metres.
        person: Where the person is, odometry frame, metres.
        least: The least cost that is in the way.
    """
    costmaps, x, y = task.costmaps, state.pose.x, state.pose.y
    away = math.dist(place, (x, y))
    steps = np.arange(OWN_PLACE_M, away, _STEP_M) / max(away, 1e-6)
    points = np.column_stack([x + steps * (place[0] - x), y + steps * (place[1] - y)])
    costs = costmaps.local_costmap.costs_at(points)
    blocked = (costs >= least) & (costs < UNKNOWN_COST)
    if task.track.is_seen(state.now):
        at_person = np.hypot(points[:, 0] - person[0], points[:, 1] - person[1]) < PERSON_M
        in_map = moved_points(points[at_person], state.map_from_odom)
        known = costmaps.global_costmap.costs_at(in_map, costmaps.static)
        blocked[at_person] = (known >= least) & (known < UNKNOWN_COST)
    return not blocked.any()


def is_in_sight(task: FollowTask, state: CycleState, place: Point2) -> bool:
    """Tell whether nothing that the sensors marked is on the line to somebody at a place."""
    return is_line_free(task, state, place, place, LETHAL)
