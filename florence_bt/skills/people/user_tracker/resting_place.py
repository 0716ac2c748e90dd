"""Where somebody lies: from all pictures of them, as they do not move.

From nearby, where only a part of them is in the picture, the network takes the middle of that for theirs:
it is a quarter of a metre off along the body. From further away it was right.
"""

from __future__ import annotations

import math

from florence_bt.skills.people.user_tracker.detector import Detection

_WHOLE_SIGMA, _CUT_SIGMA = 0.07, 0.3
"""Standard deviation of the middle in a picture of the whole body, and of a part of it, metres."""
_EDGE = 0.02
"""What reaches so near to an edge of the picture, as a share of its size, may go on beyond."""
_MOVED_M = 0.5
"""Who is seen so far away from where they lay lies somewhere else now, or is somebody else."""
_MOST = 20


class RestingPlace:
    """The mean of the places where somebody was seen lying, each with the weight that it deserves."""

    def __init__(self) -> None:
        self._weight = 0.0
        self._place = 0.0, 0.0

    @property
    def place(self) -> tuple[float, float] | None:
        """Metres, in the frame of the detections; None before the first."""
        return self._place if self._weight > 0.0 else None

    def take(self, detection: Detection) -> None:
        """Take what a picture shows of them."""
        seen = detection.x, detection.y
        weight = (_CUT_SIGMA if _is_cut(detection) else _WHOLE_SIGMA) ** -2
        self._weight += weight
        x, y = self._place if self._weight > weight else seen
        part = weight / self._weight
        self._place = x + part * (seen[0] - x), y + part * (seen[1] - y)


class RestingPlaces:
    """Remembers where people lie, whoever they are: of a body that is cut the network may see two middles."""

    def __init__(self) -> None:
        self._places: list[RestingPlace] = []

    def near(self, detection: Detection) -> RestingPlace:
        """The place where somebody was seen lying so near, or a new one."""
        seen = detection.x, detection.y
        for each in self._places:
            if each.place is not None and math.dist(each.place, seen) <= _MOVED_M:
                return each
        self._places = [*self._places[1 - _MOST :], RestingPlace()]
        return self._places[-1]


def _is_cut(detection: Detection) -> bool:
    """Whether the body may go on beyond the picture."""
    region = detection.region
    if region is None:
        return False
    return region.left < _EDGE or max(region.right, region.bottom) > 1.0 - _EDGE
