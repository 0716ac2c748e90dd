"""What a perfect robot could do for a person in a home: judged on the truth."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.body import BodyPart, body_parts
from florence_bt.simulation.home.closeness import DISTANCE_TOLERANCE_M, POLITE_DISTANCE_M
from florence_bt.simulation.home.flat import Flat, Solid
from florence_bt.simulation.home.free_space import BoolGrid, FreeSpace
from florence_bt.simulation.home.person import BODY_RADIUS_M, PersonSpec, forward_reach
from florence_bt.simulation.home.world import SimulatedWorld

CAMERA_HEIGHT_M = 0.54
"""Source: the robot's description."""

FOOTPRINT_RADIUS_M = 0.2625
"""Circumscribed radius of the padded footprint (REFERENCE 7.4): where this fits, the robot can also turn."""

STANDS_WITHIN_M = 0.05
"""So far off a robot may stand when it has reached its goal: ``xy_goal_tolerance`` of navigation. With less
room to spare it cannot count on turning there."""

_SEEN_FROM_M = (0.6, 4.0)
"""How far from the robot a person must be to be measured at all. Source: REFERENCE 12.2."""

_EVERY_CELLS = 4
"""A robot is tried at every 20 cm."""


@dataclass(frozen=True, slots=True)
class BestCase:
    """The best that could be done.

    Attributes:
        visible: Whether trunk or head are in sight from somewhere the robot gets to.
        distance: The polite distance between the middles, metres: 0.5; before what somebody pushes or
            carries ahead, and before a wheelchair, as much more as it takes; for somebody who sits or lies,
            or stands where the robot does not get to 0.5 m, as near as it gets where they see each other,
            with room to turn though it stands 5 cm off. None when it gets nowhere near, and for somebody
            who walks, when it does not get to 0.5 m.
        way: The shortest way from the start to that distance, metres; None as above.
    """

    visible: bool
    distance: float | None
    way: float | None


def best_case(flat: Flat, world: SimulatedWorld, spec: PersonSpec, start: Pose2) -> BestCase:
    """Compute what a perfect robot could do, while everything stands as it does now.

    Args:
        flat: The home.
        world: The same home with the person in it, at the beginning.
        spec: The person.
        start: Where the robot starts.
    """
    body = [_solid(spec, part) for part in body_parts(spec) if part.bottom < 1.0]
    space = FreeSpace(replace(flat, solids=(*flat.solids, *body)))
    ways = space.reachable((start.x, start.y), FOOTPRINT_RADIUS_M)
    x, y = space.frame.centres()
    apart = np.hypot(x[None, :] - spec.pose.x, y[:, None] - spec.pose.y)
    room, ahead = FOOTPRINT_RADIUS_M + STANDS_WITHIN_M, forward_reach(spec)
    distance = POLITE_DISTANCE_M if ahead <= BODY_RADIUS_M else ahead + room
    sight = _Sight(world, spec, space)
    stands = ways & (space.clearance >= room)
    goals = _at(distance, stands, apart)
    shut_in = spec.posture != "walking" and not goals.any()
    if shut_in or spec.posture in ("seated", "lying"):
        distance = max(distance, sight.nearest(stands, apart))
        goals = _at(distance, stands, apart)
    from_afar = np.zeros_like(ways)
    from_afar[::_EVERY_CELLS, ::_EVERY_CELLS] = True
    from_afar &= ways & (apart >= _SEEN_FROM_M[0]) & (apart <= _SEEN_FROM_M[1])
    visible = math.isfinite(sight.nearest(from_afar, apart))
    if not math.isfinite(distance) or not goals.any():
        return BestCase(visible, None, None)
    way = space.shortest_way((start.x, start.y), goals, FOOTPRINT_RADIUS_M)
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(way)) if way else None
    return BestCase(visible, distance, length)


def _at(distance: float, ways: BoolGrid, apart: NDArray[np.float64]) -> BoolGrid:
    """Return where the robot gets to at that distance, or about there."""
    return ways & (np.abs(apart - distance) <= DISTANCE_TOLERANCE_M)


class _Sight:
    """The sight of the robot's camera of the trunk or head of a person."""

    def __init__(self, world: SimulatedWorld, spec: PersonSpec, space: FreeSpace) -> None:
        shown = [
            part
            for part in body_parts(spec)
            if part.shape == "sphere" or (part.shape == "box" and part.colour == spec.shirt)
        ]
        self._points = [(*spec.pose.apply(part.x, part.y), (part.bottom + part.top) / 2) for part in shown]
        self._world, self._name = world, spec.name
        self._x, self._y = space.frame.centres()

    def nearest(self, cells: BoolGrid, apart: NDArray[np.float64]) -> float:
        """Return the smallest distance of cells with the person in sight; infinite without one."""
        spots = np.argwhere(cells)
        distances = apart[cells]
        for number in np.argsort(distances, kind="stable"):
            row, column = spots[number]
            eye = (float(self._x[column]), float(self._y[row]), CAMERA_HEIGHT_M)
            if any(self._world.sees(eye, self._name, point) for point in self._points):
                return float(distances[number])
        return math.inf


def _solid(spec: PersonSpec, part: BodyPart) -> Solid:
    """Return a part's outline from above, as a box."""
    x, y = spec.pose.apply(part.x, part.y)
    yaw = spec.pose.yaw + part.turn
    return Solid(spec.name, x, y, yaw, part.seen_from_above(), 0.0, part.bottom, part.top, part.colour)
