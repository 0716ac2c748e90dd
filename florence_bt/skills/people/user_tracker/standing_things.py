"""Standing things, which are none of the people who are tracked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2

_APART_M, _STANDS_M, _STOOD_S, _KEPT_S = 0.6, 0.15, 1.0, 60.0
"""Something so far from everybody that stays at its place for so long is a thing; for how long it is one."""
_THING_M = 0.2
"""Points so near to the middle of a thing are of the thing."""


@dataclass(slots=True)
class _Thing:
    place: Point2
    first: float
    last: float


class StandingThings:
    """Remembers what stood somewhere while the people were seen somewhere else: it is none of them."""

    def __init__(self) -> None:
        self._things: list[_Thing] = []

    def saw(self, now: float, legs: Sequence[Point2], people: Sequence[Point2]) -> None:
        """Note that something like legs is at these places, and people at these, metres."""
        self._things = [thing for thing in self._things if now - thing.last < _KEPT_S]
        for place in legs:
            if any(math.dist(place, person) < _APART_M for person in people):
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
