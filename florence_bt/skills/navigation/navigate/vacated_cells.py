"""Cells where people have walked: what the camera marked there was they, and they have left."""

from __future__ import annotations

import math
from collections import deque

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate.costmap import BODIES
from florence_bt.skills.navigation.navigate.state import Costmaps

CAMERA_SOURCES = "depth", "overhangs", BODIES
"""The sources of scans whose marks of somebody stay when the camera looks elsewhere, or is too near."""
BODY_M = 0.35
"""Distance from the middle of somebody within which marks were that person: shoulders and arms, and the error
of where they were seen. Chosen."""
_LEFT_M = 0.6
"""Somebody so far away has left a place: body and a step."""
_STEP_M = 0.1
FASTEST_WALK_MPS = 2.0
"""Nobody in a home walks faster; a sighting further away is of somebody else, or a mistake. Chosen."""
_KEPT_S = 60.0
"""Of a person who was not seen for so long, nothing is known any more."""


def clear_person(
    costmaps: Costmaps, place: Point2, in_map: Point2 | None, *, above_feet: bool = False
) -> None:
    """Clear what the camera has marked round the place of somebody: it was that person.

    Args:
        costmaps: Where.
        place: Odometry frame, metres.
        in_map: The same place in the map frame; None while the robot does not know where it is.
        above_feet: Whether only what stands on feet is cleared.
    """
    costmaps.local_costmap.clear_disc(CAMERA_SOURCES, place, BODY_M, above_feet=above_feet)
    if in_map is not None:
        costmaps.global_costmap.clear_disc(CAMERA_SOURCES, in_map, BODY_M, above_feet=above_feet)


class VacatedCells:
    """Remembers where each person was until they have walked away from there.

    Places are in the odometry frame.
    """

    def __init__(self) -> None:
        self._trails: dict[int, deque[Point2]] = {}
        self._seen: dict[int, float] = {}

    def saw(self, stamp: float, user_id: int, place: Point2) -> list[Point2]:
        """Note that somebody was seen.

        Args:
            stamp: Seconds.
            user_id: Their persistent id.
            place: Where they are, metres.

        Returns:
            The places that they have left since they were seen last, metres.
        """
        self._forget(stamp)
        trail = self._trails.setdefault(user_id, deque())
        passed = stamp - self._seen.get(user_id, stamp)
        self._seen[user_id] = stamp
        if trail and math.dist(trail[-1], place) > _LEFT_M + FASTEST_WALK_MPS * passed:
            trail.clear()
        if not trail or math.dist(trail[-1], place) >= _STEP_M:
            trail.append(place)
        left = []
        while math.dist(trail[0], place) > _LEFT_M:
            left.append(trail.popleft())
        return left

    def _forget(self, now: float) -> None:
        for user_id in [each for each, stamp in self._seen.items() if now - stamp > _KEPT_S]:
            del self._trails[user_id], self._seen[user_id]
