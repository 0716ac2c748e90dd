"""Whether the scans fit the estimated pose; if they do not, a search for the robot."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.pose_search import PoseSearch
from florence_bt.skills.navigation.localisation.scan_match import Match, evenly

_NEAR_M, _NEAR_RAD = 0.8, 0.35
_CONTRADICTED = 0.1
"""When fewer of the beams go through walls, what does not fit has met people or moved chairs."""
_CONFIRMED_AFTER = 5
"""A pose is confirmed by this many scans that fit."""
_LOST_AFTER, _LOST_AFTER_UNCONFIRMED = 40, 5
"""After this many scans that fit badly, more than there are of others, the robot is lost."""
_KEPT, _KEEP_M, _KEEP_RAD, _BEAMS_KEPT = 32, 0.25, 0.25, 60
"""This many scans of the way are matched together: the last 8 m."""
_LEAST_KEPT, _SEARCH_EVERY = 5, 2
"""A search starts when at least this many are kept, and then with every second one: it takes some tenths of a
second."""
_UNLIKE = 0.03, 1.5
"""At all other places so much more of the scans does not fit: a part of them, and this many times as much."""
_AGREE_M, _AGREE_RAD = 0.5, 0.3
_FIT_BEAMS = 400


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
        """The pose was set."""
        self._poor, self._fitting, self.lost = 0, 0, False

    def unconfirm(self) -> None:
        """The robot may have been carried: earlier scans are forgotten."""
        self._fitting = self._since_search = 0
        self._kept.clear()
        self._candidate = None

    def lose(self) -> None:
        """Nobody knows where the robot is."""
        self.unconfirm()
        self.lost = True

    def look(self, points: NDArray[np.float64], believed: Match) -> Match | None:
        """Check with a scan whether the estimated pose is right.

        Args:
            points: Shape (n, 2), beam ends in the base frame, metres.
            believed: How it fits at the estimated pose.

        Returns:
            A better pose nearby; None when the estimated one fits, or nothing better was found.
        """
        fit = believed.near_fraction
        if fit >= self._p.relocalise_fit:
            self._poor = 0
            self._fitting += 1
            return None
        contradicted = self._search.contradicted_part(points, believed.pose)
        if contradicted < _CONTRADICTED:
            self._poor = max(0, self._poor - 1)
            return None
        found = self._search.around(points, believed.pose, _NEAR_M, _NEAR_RAD)
        better = found is not None and found.near_fraction >= max(
            self._p.relocalise_fit, fit + self._p.relocalise_gain
        )
        if found and better and self._search.contradicted_part(points, found.pose) <= contradicted / 2.0:
            self._poor = 0
            return found
        unconfirmed = self._fitting < _CONFIRMED_AFTER
        poor = fit < (self._p.relocalise_fit if unconfirmed else self._p.lost_fit)
        self._poor = max(0, self._poor + (1 if poor else -1))
        if self._poor > (_LOST_AFTER_UNCONFIRMED if unconfirmed else _LOST_AFTER):
            if fit >= self._p.lost_fit and not self._fits_better_elsewhere(points, fit):
                self._poor = 0
            else:
                self.lose()
        return None

    def _fits_better_elsewhere(self, points: NDArray[np.float64], fit: float) -> bool:
        found = self._search.everywhere(points)
        return bool(found) and found[0].near_fraction >= fit + self._p.relocalise_gain

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
