"""Walking things like legs in the laser's scans: who left the camera's view is one of them."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from florence_bt.core.geometry import Point2

_STEP_M = 0.3
"""From one scan to the next, legs go no further."""
_GONE_S = 0.5
"""Time after which something that was not seen is not the same any more."""
_MEMORY_S, _WALKED_M, _HALF_M = 1.5, 0.25, 0.1
"""Memory, and the way within it of something that walks, if it went on so far in both halves: a chair of
which more comes into view seems to jump, and then stands."""


@dataclass(slots=True)
class _Legs:
    way: deque[tuple[float, Point2]] = field(default_factory=deque)
    rejected: bool = False

    @property
    def place(self) -> Point2:
        return self.way[-1][1]

    @property
    def walk(self) -> bool:
        first, middle, last = (self.way[k][1] for k in (0, len(self.way) // 2, -1))
        halves = math.dist(first, middle), math.dist(middle, last)
        return math.dist(first, last) >= _WALKED_M and min(halves) >= _HALF_M


class WalkingLegs:
    """Follows everything like legs from scan to scan. All places are in one frame that does not jump."""

    def __init__(self) -> None:
        self._all: list[_Legs] = []

    def saw(self, stamp: float, legs: list[Point2]) -> None:
        """Note that something like legs is at these places (metres); ``stamp`` in seconds."""
        known = [each for each in self._all if stamp - each.way[-1][0] <= _GONE_S]
        pairs = sorted(
            (math.dist(known[old].place, legs[new]), old, new)
            for old in range(len(known))
            for new in range(len(legs))
            if math.dist(known[old].place, legs[new]) <= _STEP_M
        )
        taken: set[int] = set()
        found: set[int] = set()
        for _, old, new in pairs:
            if old not in taken and new not in found:
                taken.add(old)
                found.add(new)
                known[old].way.append((stamp, legs[new]))
        known += [_Legs(deque([(stamp, legs[new])])) for new in range(len(legs)) if new not in found]
        for each in known:
            while stamp - each.way[0][0] > _MEMORY_S:
                each.way.popleft()
        self._all = known

    def places(self, stamp: float) -> list[Point2]:
        """Return where legs are that walk and are in the scan of that time, but for rejected ones."""
        return [
            each.place for each in self._all if each.way[-1][0] == stamp and each.walk and not each.rejected
        ]

    def reject(self, place: Point2) -> None:
        """Reject the legs at a place: they are those of somebody or something else."""
        for each in self._all:
            if math.dist(each.place, place) <= _STEP_M:
                each.rejected = True
