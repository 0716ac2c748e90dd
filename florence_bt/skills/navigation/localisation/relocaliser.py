"""The watch over the estimated pose: where scans do not fit it, a search for the robot begins."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.pose_search import PoseSearch
from florence_bt.skills.navigation.localisation.scan_match import Match, evenly

_NEAR_M, _NEAR_RAD = 0.8, 0.35
_CONTRADICTED = 0.1
"""Part of the beams that go through walls below which misfits are people or moved chairs."""
_CONFIRMED_AFTER = 5
"""A pose is confirmed by this many scans that fit."""
_LOST_AFTER_M, _LOST_AFTER_UNCONFIRMED_M = 4.0, 0.5
"""After so many metres with scans that fit badly, more than there are with others, the robot is lost. A
radian counts as a metre, as ``update_min_a`` and ``update_min_d`` do."""
_NOTHING_FITS_M, _NOTHING_FITS_UNCONFIRMED_M = 10.0, 3.0
"""And after so many metres in which nothing fitted, also where nothing contradicts: off the map, or where it
knows nothing. Rooms that the first half of the log from Freiburg has not seen come to 7.1 m at most."""
_KEPT, _KEEP_M, _KEEP_RAD, _BEAMS_KEPT = 32, 0.25, 0.25, 60
"""This many scans of the way are matched together: the last 8 m."""
_LEAST_KEPT, _SEARCH_EVERY = 5, 2
"""A search starts when at least this many are kept, and then with every second one: it takes some tenths of a
second."""
_UNLIKE = 0.03, 1.5
"""At all other places so much more of the scans does not fit: a part of them, and this many times as much."""
_AGREE_M, _AGREE_RAD = 0.5, 0.3
"""Difference of two finds, one after the other, that are of one place. Chosen."""
_FIT_BEAMS = 400
"""Beams that judge a place that was found. Chosen."""


class Relocaliser:
    """Searches around the estimated pose with each scan that does not fit there, and in the whole map once
    the robot is lost.

    A robot whose odometry has continued without a break since its pose was confirmed is hardly elsewhere:
    scans that do not fit are then of a room that the map does not know. A pose is unconfirmed after it was
    set, and when a scan does not fit those before it: the robot may have been carried. A scan that fits it
    badly, but no other place better, is still no sign of that: much has been moved since the map was made.

    Attributes:
        lost: Whether nobody knows where the robot is. Nothing that needs the pose may be done then.
    """

    def __init__(self, search: PoseSearch, parameters: LocaliserParameters) -> None:
        self._search = search
        self._p = parameters
        self._kept: deque[tuple[Pose2, NDArray[np.float64]]] = deque(maxlen=_KEPT)
        self._since_search = 0
        self._candidate: tuple[Pose2, Pose2] | None = None
        self.reset()

    def reset(self) -> None:
        """Begin again, as the pose was set."""
        self._fitting, self.lost, self._carried = 0, False, False
        self._forget_poor()

    def _forget_poor(self) -> None:
        self._poor_m = self._unfit_m = 0.0

    def unconfirm(self) -> None:
        """Forget earlier scans, as the robot may have been carried."""
        self._fitting = self._since_search = 0
        self._carried = True
        self._kept.clear()
        self._candidate = None

    def lose(self) -> None:
        """Note that nobody knows where the robot is."""
        self.unconfirm()
        self.lost = True

    def look(self, points: NDArray[np.float64], believed: Match, motion: Pose2) -> Match | None:
        """Check with a scan whether the estimated pose is right.

        Args:
            points: Shape (n, 2), beam ends in the base frame, metres.
            believed: How it fits at the estimated pose.
            motion: Of the base since the scan before.

        Returns:
            A better pose nearby; None when the estimated one fits, or nothing better was found.
        """
        fit = believed.near_fraction
        if fit >= self._p.relocalise_fit:
            self._forget_poor()
            self._fitting += 1
            self._carried &= self._unconfirmed
            return None
        contradicted = self._search.contradicted_part(points, believed.pose)
        if contradicted >= _CONTRADICTED:
            found = self._look_nearby(points, believed, contradicted)
            if found is not None:
                self._forget_poor()
                return found
        self._count(fit, motion, contradicts=contradicted >= _CONTRADICTED)
        if self._is_lost(points, fit, contradicts=contradicted >= _CONTRADICTED):
            self.lose()
        return None

    @property
    def _unconfirmed(self) -> bool:
        return self._fitting < _CONFIRMED_AFTER

    def _look_nearby(self, points: NDArray[np.float64], believed: Match, contradicted: float) -> Match | None:
        found = self._search.around(points, believed.pose, _NEAR_M, _NEAR_RAD)
        least = max(self._p.relocalise_fit, believed.near_fraction + self._p.relocalise_gain)
        if found is None or found.near_fraction < least:
            return None
        return found if self._search.contradicted_part(points, found.pose) <= contradicted / 2.0 else None

    def _count(self, fit: float, motion: Pose2, *, contradicts: bool) -> None:
        """Add what was travelled to that with scans that fit badly, or take it off."""
        way = math.hypot(motion.x, motion.y)
        # Unless the robot was carried, a poor fit that contradicts nothing comes from people.
        worst = self._p.relocalise_fit if self._unconfirmed else self._p.lost_fit
        poor = fit < worst and (contradicts or self._carried)
        self._poor_m = max(0.0, self._poor_m + (1.0 if poor else -1.0) * (way + abs(motion.yaw)))
        # A scan that fits a little counts less.
        self._unfit_m = max(0.0, self._unfit_m + way * min(1.0, 1.0 - fit / self._p.lost_fit))

    def _is_lost(self, points: NDArray[np.float64], fit: float, *, contradicts: bool) -> bool:
        if self._unfit_m > (_NOTHING_FITS_UNCONFIRMED_M if self._unconfirmed else _NOTHING_FITS_M):
            return True
        if self._poor_m <= (_LOST_AFTER_UNCONFIRMED_M if self._unconfirmed else _LOST_AFTER_M):
            return False
        if (contradicts and fit < self._p.lost_fit) or self._fits_better_elsewhere(points, fit):
            return True
        self._poor_m = 0.0
        return False

    def _fits_better_elsewhere(self, points: NDArray[np.float64], fit: float) -> bool:
        found = self._search.everywhere(points)
        least = max(self._p.relocalise_fit, fit + self._p.relocalise_gain)
        return bool(found) and found[0].near_fraction >= least

    def look_everywhere(self, points: NDArray[np.float64], track: Pose2) -> Match | None:
        """Look for the robot with a scan and those of the last metres.

        Args:
            points: Shape (n, 2), beam ends in the base frame, metres.
            track: The base by the odometry.

        Returns:
            Where the robot is, None until that is known.
        """
        if self._kept and not _moved(self._kept[-1][0], track, _KEEP_M, _KEEP_RAD):
            return None
        self._kept.append((track, evenly(points, _BEAMS_KEPT)))
        self._since_search += 1
        if len(self._kept) < _LEAST_KEPT or self._since_search < _SEARCH_EVERY:
            return None
        self._since_search = 0
        seen = [self._seen_from(track, pose, scan) for pose, scan in self._kept]
        way = evenly(np.concatenate(seen), _FIT_BEAMS)
        found = self._search.everywhere(way)
        before, self._candidate = self._candidate, None
        if not found or found[0].near_fraction < self._p.relocalise_fit:
            return None
        best = found[0]
        least = _UNLIKE[0] + _UNLIKE[1] * (1.0 - best.near_fraction)
        if any(1.0 - other.near_fraction < least for other in found[1:]):
            return None
        if self._search.contradicted_part(way, best.pose) > _CONTRADICTED:
            return None
        self._candidate = track, best.pose
        if before is None or _moved(before[1] @ before[0].inverse() @ track, best.pose, _AGREE_M, _AGREE_RAD):
            return None
        self.reset()
        return best

    def _seen_from(self, track: Pose2, pose: Pose2, scan: NDArray[np.float64]) -> NDArray[np.float64]:
        there = track.inverse() @ pose
        c, s = np.cos(there.yaw), np.sin(there.yaw)
        return scan @ np.array([[c, s], [-s, c]]) + np.array([there.x, there.y])


def _moved(start: Pose2, end: Pose2, distance: float, angle: float) -> bool:
    return start.distance_to(end) >= distance or abs(angle_difference(end.yaw, start.yaw)) >= angle
