"""A goal without room to turn is entered straight: line up at a place before it, then drive forward.

Such goals are usual here: half a metre in front of a person the robot's nose has no room to swing. Where
there is no place to line up either, one right beside the goal may have room to turn.
"""

from __future__ import annotations

import math

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.planner import Plan
from florence_bt.skills.robot_description.room import RUN_UPS_M

_STEP_M = 0.05
"""Steps of a way that is tried. Chosen."""
_HEADINGS = tuple(math.radians(15.0 * step) for step in range(24))
_BESIDE_M = 0.04
LINED_UP_RAD = 0.2
"""A robot that looks along the run-up within this angle, from on it, need not line up again."""


def staging_pose(here: Pose2, goal: Pose2, costmap: Costmap, spare: float) -> Pose2 | None:
    """Return where to line up before driving into a goal.

    Args:
        here: The robot in the costmap's frame.
        goal: The goal in the costmap's frame.
        costmap: What is known to be in the way.
        spare: The last part of the way that need not be free, in metres.

    Returns:
        A pose with the goal's heading before the goal, where the robot can turn, and from where the straight
        way to the goal is free. None when the robot is lined up already, or there is no such place.
    """
    if is_lined_up(here, goal):
        return None
    for run_up in RUN_UPS_M:
        stage = goal @ Pose2(-run_up, 0.0, 0.0)
        if has_room_to_turn(stage, costmap) and _is_free(stage, run_up - spare, costmap):
            return stage
    return None


def straight_way_in(here: Pose2, goal: Pose2, costmap: Costmap, spare: float) -> Plan | None:
    """Return the straight way from a run-up into a narrow goal; a planned one would bend away from the sides.

    The arguments are those of :func:`staging_pose`.

    Returns:
        The way; None when the robot is not lined up, or it is not free.
    """
    way = here.distance_to(goal)
    if not is_lined_up(here, goal):
        return None
    towards = Pose2(here.x, here.y, here.yaw + here.bearing_to(goal.x, goal.y))
    if not _is_free(towards, max(0.0, way - spare), costmap):
        return None
    points = np.linspace((here.x, here.y), (goal.x, goal.y), 1 + max(1, math.ceil(way / _STEP_M)))
    return Plan(points, way, goal)


def turning_place(goal: Pose2, costmap: Costmap, spare: float) -> Pose2 | None:
    """Return the place nearest to a goal that has room to turn: with some to spare, or else just enough.

    Args:
        goal: The goal in the costmap's frame.
        costmap: What is known to be in the way.
        spare: How far from the goal it may be, in metres.

    Returns:
        A pose with the goal's heading, None when there is no such place.
    """
    rings = [_BESIDE_M * ring for ring in range(1, 1 + int(spare / _BESIDE_M + 1e-9))]
    places = [goal @ Pose2(r * math.cos(angle), r * math.sin(angle)) for r in rings for angle in _HEADINGS]
    roomy = (place for place in places if costmap.cost_at(place.x, place.y) < costmap.harmless_below)
    return next(roomy, None) or next((place for place in places if has_room_to_turn(place, costmap)), None)


def is_lined_up(here: Pose2, goal: Pose2) -> bool:
    """Tell whether driving straight on leads into the goal with the right heading."""
    ahead = here.inverse() @ goal
    if not -_STEP_M <= ahead.x <= 2.0 * RUN_UPS_M[0] or abs(ahead.yaw) > LINED_UP_RAD:
        return False
    return abs(ahead.y) <= max(_STEP_M, ahead.x * math.tan(LINED_UP_RAD))


def has_room_to_turn(place: Pose2, costmap: Costmap) -> bool:
    """Tell whether the robot touches nothing at a place, at any heading, and nothing is under it."""
    if INSCRIBED <= costmap.cost_at(place.x, place.y) < UNKNOWN_COST:
        return False
    return all(costmap.footprint_cost(Pose2(place.x, place.y, yaw)) >= 0 for yaw in _HEADINGS)


def _is_free(start: Pose2, way: float, costmap: Costmap) -> bool:
    steps = max(1, math.ceil(way / _STEP_M))
    return all(
        costmap.footprint_cost(start @ Pose2(way * step / steps, 0.0, 0.0)) >= 0 for step in range(steps + 1)
    )
