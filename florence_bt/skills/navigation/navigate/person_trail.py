"""The path that somebody walked: where they got through, the robot gets through too, and cuts no corner."""

from __future__ import annotations

import itertools
import math
from collections import deque

from florence_bt.core.geometry import Point2

_SPACING_M, _POINTS = 0.1, 80
"""A point of the path is so far from the one before at least; so many are remembered."""
_GAP_M = 0.6
"""Between two sights that are further apart nobody knows how they walked: the path begins anew."""


class PersonTrail:
    """Remembers where somebody walked. All places are in one frame that does not jump, metres."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, Point2]] = deque(maxlen=_POINTS)

    def saw(self, stamp: float, place: Point2) -> None:
        """Note that they were at a place; ``stamp`` in seconds."""
        away = math.dist(self._points[-1][1], place) if self._points else math.inf
        if away > _GAP_M:
            self._points.clear()
        if away >= _SPACING_M:
            self._points.append((stamp, place))

    def last(self, length: float) -> list[Point2]:
        """Return the places not further than so many metres from the last one."""
        places = [place for _, place in self._points]
        return [place for place in places if math.dist(place, places[-1]) <= length]

    def since(self, stamp: float) -> list[Point2]:
        """Return the places where they were after a time."""
        return [place for seen, place in self._points if seen >= stamp]

    def ahead(self, robot: Point2, person: Point2) -> list[tuple[Point2, float]]:
        """Return the points of the path after the one nearest to the robot.

        Args:
            robot: Where the robot is.
            person: Where the person is now, or was last: the end of the path.

        Returns:
            Each with the metres that the person walked from there on; the end of the path first.
        """
        places = [place for _, place in self._points]
        if places:
            nearest = min(range(len(places)), key=lambda k: math.dist(places[k], robot))
            # The robot has come as far as that one, unless the path only begins there.
            places = places[nearest + 1 if nearest > 0 else 0 :]
        places = [person, *reversed(places)]
        walked = itertools.accumulate((math.dist(a, b) for a, b in itertools.pairwise(places)), initial=0.0)
        return list(zip(places, walked, strict=True))
