"""In a search for somebody: what is near the robot, may be their legs, and was not looked at yet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2

_REACH_M = 1.5
"""Legs further away are left to the search."""
_SAME_M = 0.3
"""What is so near to a place was looked at there; a person who walks is soon somewhere else."""
_STEP_M = 0.4
"""Legs go no further from one scan to the next."""
VIEW_RAD, TOO_NEAR_M = 0.35, 0.55
"""So near to the middle of the image, and not nearer to the robot, the camera would see who it is ..."""
_LOOK_S, _TRY_S = 1.0, 5.0
"""... within this time. What the robot cannot look at for so long is left."""
_APART_M, _STANDS_M, _STOOD_S, _KEPT_S = 0.6, 0.15, 1.0, 60.0
"""Something so far from the person that stays at its place for so long is a thing; for how long it is one."""

_THING_M = 0.2
"""Points so near to the middle of a thing are of the thing."""


@dataclass(slots=True)
class _Thing:
    place: Point2
    first: float
    last: float


class StandingThings:
    """Remembers what stood somewhere while the person was seen somewhere else: it is not they."""

    def __init__(self) -> None:
        self._things: list[_Thing] = []

    def saw(self, now: float, legs: list[Point2], person: Point2) -> None:
        """Note that something like legs is at these places, and the person at another one, metres."""
        self._things = [thing for thing in self._things if now - thing.last < _KEPT_S]
        for place in legs:
            if math.dist(place, person) < _APART_M:
                continue
            near = [thing for thing in self._things if math.dist(thing.place, place) < _STANDS_M]
            if near:
                near[0].last = now
            else:
                self._things.append(_Thing(place, now, now))

    def places(self) -> list[Point2]:
        """Return where things stand, metres."""
        return [thing.place for thing in self._things if thing.last - thing.first >= _STOOD_S]

    def without(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points, shape (n, 2), metres, that are not of these things."""
        kept = np.ones(len(points), bool)
        for x, y in self.places():
            kept &= np.hypot(points[:, 0] - x, points[:, 1] - y) > _THING_M
        return points[kept]


class NearbyLegs:
    """Chooses what to look at next. All places are in one frame that does not jump.

    Args:
        known: Where things stand that are not the person, metres.

    Attributes:
        since: When what is looked at was chosen, seconds; minus infinity when there was nothing yet.
    """

    def __init__(self, known: list[Point2] | None = None) -> None:
        self._known = known or []
        self._target: Point2 | None = None
        self.since = self._unclear_since = -math.inf

    def next(self, now: float, robot: Pose2, legs: list[Point2]) -> Point2 | None:
        """Return what may be the person's legs and is to be looked at, metres; None without any.

        Args:
            now: Seconds.
            robot: The robot.
            legs: Where something like legs is now, metres.
        """
        here = (robot.x, robot.y)
        new = [
            each
            for each in legs
            if math.dist(each, here) < _REACH_M and all(math.dist(each, at) > _SAME_M for at in self._known)
        ]
        if not new:
            self._target = None
            return None
        old = self._target
        near = [] if old is None else [each for each in new if math.dist(each, old) < _STEP_M]
        if old is None or not near:
            self._target = min(new, key=lambda each: math.dist(each, here))
            self.since = self._unclear_since = now
        else:
            self._target = min(near, key=lambda each: math.dist(each, old))
        in_view = abs(robot.bearing_to(*self._target)) < VIEW_RAD
        if not in_view or math.dist(self._target, here) < TOO_NEAR_M:
            self._unclear_since = now
        if now - self._unclear_since > _LOOK_S or now - self.since > _TRY_S:
            self.leave()
        return self._target

    def leave(self) -> None:
        """Leave out from now on what was chosen last: the robot knows it, or cannot turn to it."""
        if self._target is not None:
            self._known.append(self._target)
            self._target = None
