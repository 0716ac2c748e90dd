"""Recognises places: fits what the robot has seen lately to what it saw when it was there before.

Source: Olson, Real-time correlative scan matching, ICRA 2009; Hess et al., Real-time loop closure in 2D lidar
SLAM, ICRA 2016 (scans against finished submaps).
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.skills.navigation.localisation.scan_match import (
    Match,
    evenly,
    match_scan,
    search_around,
    spread_around,
    turned_covariance,
)
from florence_bt.skills.navigation.localisation.submap import Submap, used_up
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.pose_graph import PoseGraph, Tie

_LATELY_M, _NEAR_M = 5.0, 10.0
"""Length of the way of which the views are fitted, and distance up to which they are: a single scan in a bare
corridor fits at any place of it."""
_MIDDLE_M, _MOST = 8.0, 2
"""Submaps whose middle is so near may hold what the robot sees; so many are tried, and as many in wide
searches, or the near ones that the robot has just left would always come first."""
_LAST, _LEAST_SCANS, _SURER = 2, 3, 0.1
"""A scan that is torn from those before is looked for in so many submaps of at least so many scans, and so
much more of it has to fit: nothing confirms it."""
_REACH_M, _REACH_PER_M, _LONGEST_M = 0.4, 0.04, 5.0
_TURN_RAD, _TURN_PER_M, _LARGEST_RAD = 0.1, 0.012, 0.8
"""Bounds of the search around the believed pose: the drift of the laser odometry over a way, and more."""
_WIDE_M = 1.0
"""From this reach on a second fit, from elsewhere, has to agree with the first one."""
_APART_M, _FORGET_M = 0.8, 4.0
"""So far from each other the two are, and at most so far."""
_AGREE_M, _AGREE_RAD = 0.3, 0.08
"""Difference of the second fit from the first, at most. Chosen."""
_COARSE = {"step": 0.1, "turn_step": 0.04, "near": 0.25}
_FINE = {"step": 0.03, "turn_step": 0.012, "near": 0.12}
_SPREAD = {"step": 0.1, "near": 0.25, "scale": 0.02}
_SPREAD_M = 2.0
"""Distance up to which the fits around tell how sure the fit is."""
_COST = 0.15
"""At the border of the search so much more of what was seen has to fit than in its middle."""
_COARSE_BEAMS, _FINE_BEAMS, _FIT_BEAMS = 100, 150, 300
_SIGMA_M, _INDEPENDENT_BEAMS = 0.04, 40.0
"""Beams of the coarse search, the fine one and the fit; the error of a beam, and the number of beams that err
on their own. Chosen."""
_LEAST = np.diag(np.square([0.03, 0.03, 0.008]))
"""A fit is never surer: floors are not flat, doors and chairs are moved, scans take time."""
_CACHED = 48
"""So many submaps are kept drawn; the others are drawn again when they are needed."""


@dataclass(slots=True)
class _Stretch:
    """The scans of a submap: from ``first`` on, up to ``end``, which is None while it is being driven."""

    first: int
    end: int | None = None


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A fit that a second one has to confirm: where it puts a pose in the map."""

    tie: Tie
    pose: Pose2


class LoopFinder:
    """Keeps track of the submaps of a drive, and looks for the robot in those that it has left.

    Attributes:
        driven: The base at each kept scan by the laser odometry, in the frame of the first one.
        ways: Metres driven up to each of them; more where it was torn.
    """

    def __init__(
        self, scans: Sequence[KeptScan], graph: PoseGraph, least_way: float, least_fit: float
    ) -> None:
        self._scans, self._graph = scans, graph
        self._least_way, self._least_fit = least_way, least_fit
        self.driven: list[Pose2] = []
        self.ways: list[float] = []
        self._torn_at: set[int] = set()
        self._stretches: list[_Stretch] = []
        self._drawn: OrderedDict[int, Submap] = OrderedDict()
        self._candidates: list[_Candidate] = []

    def add(self, driven: Pose2, way: float, *, torn: bool) -> None:
        """Add the newest kept scan.

        Args:
            driven: As in :attr:`driven`.
            way: As in :attr:`ways`.
            torn: Whether nothing ties it to the scans before it.
        """
        number = len(self.driven)
        self.driven.append(driven)
        self.ways.append(way)
        if torn:
            self._torn_at.add(number)
            self._candidates.clear()
        for stretch in self._open():
            middle = self.driven[stretch.first]
            if torn or used_up(number - stretch.first, middle, driven) >= 1.0:
                stretch.end = number
        opened = self._open()
        if not opened or used_up(number - opened[-1].first, self.driven[opened[-1].first], driven) >= 0.5:
            self._stretches.append(_Stretch(number))

    @property
    def _unbroken_from(self) -> int:
        return max(self._torn_at, default=0)

    @property
    def torn(self) -> tuple[bool, ...]:
        """Find the scans that nothing ties to those before."""
        return tuple(number in self._torn_at for number in range(len(self.driven)))

    def _open(self) -> list[_Stretch]:
        return [stretch for stretch in self._stretches[-3:] if stretch.end is None]

    def find(self) -> list[Tie]:
        """Look for the newest kept scan in what was seen before; return what can be relied on."""
        number = len(self.driven) - 1
        here = self._graph.poses[number]
        near = [
            (self._graph.poses[stretch.first].distance_to(here), index)
            for index, stretch in enumerate(self._stretches)
            if stretch.end is not None and self.ways[number] - self.ways[stretch.end - 1] >= self._least_way
        ]
        near = sorted(each for each in near if each[0] < _MIDDLE_M + _LONGEST_M)
        if not near:
            return []
        ways = self._graph.ways_from(number)
        seen = self._seen_lately(number)
        found: list[Tie] = []
        left = {False: _MOST, True: _MOST}
        for distance, index in near:
            way = float(ways[self._stretches[index].first])
            reach, turn = _search_of(way)
            if distance > _MIDDLE_M + reach:
                continue
            wide = reach >= _WIDE_M
            if left[wide] > 0:
                left[wide] -= 1
                found += self._look(index, number, seen, reach, turn)
        return found

    def rejoin(self) -> list[Tie]:
        """Look for the newest scan, which nothing ties to those before it was torn, in the last submaps."""
        number, torn_at = len(self.driven) - 1, self._unbroken_from
        ended = [
            index
            for index, stretch in enumerate(self._stretches)
            if stretch.end is not None
            and stretch.end <= torn_at
            and stretch.end - stretch.first >= _LEAST_SCANS
        ]
        if not ended:
            return []
        ways, seen = self._graph.ways_from(number), self._seen_lately(number)
        found = []
        for index in ended[-_LAST:]:
            reach, _ = _search_of(float(ways[self._stretches[index].first]))
            found.append(self._match(index, number, seen, reach, _LARGEST_RAD))
        fit, tie = max(found, key=lambda each: each[0])
        return [tie] if fit >= self._least_fit + _SURER else []

    def _look(
        self, index: int, number: int, seen: NDArray[np.float64], reach: float, turn: float
    ) -> list[Tie]:
        fit, tie = self._match(index, number, seen, reach, turn)
        if fit < self._least_fit:
            return []
        return [tie] if reach < _WIDE_M else self._confirmed(tie)

    def _match(
        self, index: int, number: int, seen: NDArray[np.float64], reach: float, turn: float
    ) -> tuple[float, Tie]:
        """Fit what was seen to a submap; return the part that fits, and the tie that follows."""
        anchor = self._stretches[index].first
        belief = self._graph.poses[anchor].inverse() @ self._graph.poses[number]
        submap = self._submap(index)
        match = self._fit(submap, seen, belief, reach, turn)
        spread = np.zeros((3, 3))
        spread[:2, :2] = spread_around(
            submap.field, evenly(seen, _COARSE_BEAMS), match.pose, reach=_SPREAD_M, **_SPREAD
        )
        covariance = turned_covariance(match.covariance + spread, -match.pose.yaw) + _LEAST
        return match.near_fraction, Tie(anchor, number, match.pose, covariance)

    def _fit(
        self, submap: Submap, seen: NDArray[np.float64], belief: Pose2, reach: float, turn: float
    ) -> Match:
        field = submap.field
        cost = {"cost_d": _COST / reach**2, "cost_a": _COST / turn**2}
        coarse = search_around(
            field, evenly(seen, _COARSE_BEAMS), belief, reach=reach, turn=turn, **_COARSE, **cost
        )
        fine = search_around(
            field, evenly(seen, _FINE_BEAMS), coarse, reach=0.12, turn=0.05, cost_d=0.0, **_FINE
        )
        return match_scan(
            field,
            evenly(seen, _FIT_BEAMS),
            belief,
            np.diag(np.square([reach, reach, turn])),
            sigma=_SIGMA_M,
            independent_beams=_INDEPENDENT_BEAMS,
            start=fine,
        )

    def _confirmed(self, tie: Tie) -> list[Tie]:
        """Return a tie that was found far off, and an earlier one that agrees; nothing without that."""
        number = tie.second
        pose = self._graph.poses[tie.first] @ tie.relative
        way = self.ways[number]
        self._candidates = [
            each for each in self._candidates if way - self.ways[each.tie.second] <= _FORGET_M
        ]
        for each in self._candidates:
            if way - self.ways[each.tie.second] < _APART_M:
                continue
            expected = each.pose @ self.driven[each.tie.second].inverse() @ self.driven[number]
            turned = abs(angle_difference(pose.yaw, expected.yaw))
            if pose.distance_to(expected) <= _AGREE_M and turned <= _AGREE_RAD:
                self._candidates.clear()
                return [each.tie, tie]
        self._candidates.append(_Candidate(tie, pose))
        return []

    def _seen_lately(self, number: int) -> NDArray[np.float64]:
        """Return what the robot has seen on the last metres, shape (n, 2), in its frame, metres."""
        here, seen = self.driven[number], []
        for other in range(number, self._unbroken_from - 1, -1):
            if self.ways[number] - self.ways[other] > _LATELY_M:
                break
            there = here.inverse() @ self.driven[other]
            c, s = math.cos(there.yaw), math.sin(there.yaw)
            seen.append(self._scans[other].points @ np.array([[c, s], [-s, c]]) + (there.x, there.y))
        points = np.concatenate(seen)
        return points[np.hypot(points[:, 0], points[:, 1]) <= _NEAR_M]

    def _submap(self, index: int) -> Submap:
        """Return a submap in the frame of its first scan."""
        if index in self._drawn:
            self._drawn.move_to_end(index)
            return self._drawn[index]
        stretch, submap = self._stretches[index], Submap(Pose2())
        middle = self.driven[stretch.first].inverse()
        for number in range(stretch.first, stretch.end or len(self.driven)):
            submap.add(middle @ self.driven[number], self._scans[number].points.astype(float))
        self._drawn[index] = submap
        if len(self._drawn) > _CACHED:
            self._drawn.popitem(last=False)
        return submap


def _search_of(way: float) -> tuple[float, float]:
    """Return how far a place is searched, metres and radians, after an unsure way, metres."""
    reach = min(_LONGEST_M, _REACH_M + _REACH_PER_M * way)
    return reach, min(_LARGEST_RAD, _TURN_RAD + _TURN_PER_M * way)
