"""Where somebody lies: from all pictures of them, as they do not move.

From nearby, where only a part of them is in the picture, the network takes the middle of that for theirs:
it is a quarter of a metre off along the body. From further away it was right.
"""

from __future__ import annotations

import math

from florence_bt.skills.people.user_tracker.detector import Detection

_WHOLE_SIGMA, _CUT_SIGMA = 0.07, 0.25
"""Standard deviation of the middle in a picture of the whole body, and of a part of it, metres."""
_EDGE = 0.02
"""What reaches so near to an edge of the picture, as a share of its size, may go on beyond."""
_MOVED_M = 0.5
"""Who is seen so far away from where they lay lies somewhere else now."""


class RestingPlace:
    """The mean of the places where somebody was seen lying, each with the weight that it deserves."""

    def __init__(self) -> None:
        self._weight = 0.0
        self._place = 0.0, 0.0

    @property
    def place(self) -> tuple[float, float] | None:
        """Metres, in the frame of the detections; None for who does not lie."""
        return self._place if self._weight > 0.0 else None

    def take(self, detection: Detection) -> None:
        """Take what a picture shows of them."""
        seen = detection.x, detection.y
        if detection.posture != "lying":
            return
        if self._weight and math.dist(self._place, seen) > _MOVED_M:
            self._weight = 0.0
        weight = (_CUT_SIGMA if _is_cut(detection) else _WHOLE_SIGMA) ** -2
        self._weight += weight
        x, y = self._place if self._weight > weight else seen
        part = weight / self._weight
        self._place = x + part * (seen[0] - x), y + part * (seen[1] - y)


def _is_cut(detection: Detection) -> bool:
    """Whether the body may go on beyond the picture."""
    region = detection.region
    if region is None:
        return False
    return region.left < _EDGE or max(region.right, region.bottom) > 1.0 - _EDGE
