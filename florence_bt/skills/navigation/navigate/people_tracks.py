"""Where each person was seen, and how they walk: sights of the tracker, and legs in the laser's scans."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate.legs import go_on_with_legs
from florence_bt.skills.navigation.navigate.moving_target import MovingTarget
from florence_bt.skills.navigation.navigate.people import People, PeopleParameters
from florence_bt.skills.navigation.navigate.vacated_cells import FASTEST_MPS

_STANDING_MPS = 0.2
"""A person who seems to walk slower may stand. Chosen."""
_SAME_M = 0.3
"""Two people are not so near to each other."""
_REMEMBERED_S = 30.0
"""Who was seen so long ago can be followed from there."""


class PeopleTracks:
    """The people whom the tracker has seen lately. All places are in the odometry frame.

    Args:
        parameters: How long to remember them.
    """

    def __init__(self, parameters: PeopleParameters) -> None:
        self._p = parameters
        self._targets: dict[int, MovingTarget] = {}
        self._seen: dict[int, list[tuple[float, float, float]]] = {}

    def __len__(self) -> int:
        return len(self._targets)

    def saw(self, stamp: float, user_id: int, x: float, y: float) -> None:
        """Note that the tracker saw somebody; ignore what is not newer, or not finite."""
        target = self._targets.setdefault(user_id, MovingTarget(self._p.people_velocity_time))
        target.recognise(stamp, x, y)
        if target.seen == stamp:
            before = self.seen_lately(user_id, stamp)
            self._seen[user_id] = [*(each for each in before if each[0] < stamp), (stamp, x, y)]

    def seen_lately(self, user_id: int, now: float) -> list[tuple[float, float, float]]:
        """Return when (seconds) and where (x, y, metres) a person was tracked in the last half minute."""
        return [each for each in self._seen.get(user_id, []) if 0.0 <= now - each[0] <= _REMEMBERED_S]

    def saw_scan(self, stamp: float, unknown: NDArray[np.float64], robot: Pose2) -> None:
        """Go on with the legs of those whom the camera does not see any more; see :func:`go_on_with_legs`."""
        for target in self._targets.values():
            go_on_with_legs(target, stamp, unknown, robot, self._p.people_keep_time)

    def sights(self) -> list[tuple[float, int, Point2]]:
        """Return when (seconds) camera or laser saw each person last, their id, and where (metres)."""
        return [
            (target.seen, who, target.at(target.seen, 0.0))
            for who, target in self._targets.items()
            if target.seen is not None
        ]

    def people(self, now: float, without: int | None = None, place: Point2 | None = None) -> People:
        """Return where people are now.

        Args:
            now: Seconds.
            without: The id of somebody to leave out.
            place: Where they are: the tracker may have given them another id.
        """
        self._targets = {who: target for who, target in self._targets.items() if self._is_fresh(target, now)}
        self._seen = {
            who: seen for who, seen in self._seen.items() if 0.0 <= now - seen[-1][0] <= _REMEMBERED_S
        }
        rows = [self._row(target, now) for who, target in self._targets.items() if who != without]
        if place is not None:
            rows = [row for row in rows if math.dist(row[:2], place) > _SAME_M]
        return People(np.array(rows).reshape(-1, 5), self._p)

    def _is_fresh(self, target: MovingTarget, now: float) -> bool:
        return target.seen is not None and abs(now - target.seen) <= self._p.people_keep_time

    def _row(self, target: MovingTarget, now: float) -> tuple[float, ...]:
        assert target.seen is not None
        (x, y), speed = target.at(now, 0.0), math.hypot(*target.velocity)
        share = min(1.0, FASTEST_MPS / speed) if speed >= _STANDING_MPS else 0.0
        vx, vy = (share * part for part in target.velocity)
        age = max(0.0, now - target.seen)
        return x + vx * age, y + vy * age, vx, vy, self._p.people_distance
