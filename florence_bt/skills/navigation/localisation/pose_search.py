"""The pose at which a scan fits the map, looked for around a place or everywhere.

A fit that begins at a wrong pose ends at a wrong one. So all poses of a grid are tried, then a finer grid
round the best of them, and the fit begins there.

Source: Olson, Real-time correlative scan matching, ICRA 2009.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.localisation._kernels import contradicted_part, score_poses
from florence_bt.skills.navigation.localisation.likelihood_field import OCCUPIED_FROM, LikelihoodField
from florence_bt.skills.navigation.localisation.scan_match import Match

T = TypeVar("T")

_SIGMA_M = 0.15
"""How far from a surface a beam still fits: about as wide as the steps of the grid."""
_BEAMS = 60
_STEP_M, _STEP_RAD = 0.1, 0.05
_FINE_M, _FINE_RAD = 0.025, 0.0125
_COARSE_M, _COARSE_RAD = 0.2, math.radians(5.0)
_SECTORS = 4
"""Everywhere, the best heading of each quarter of the circle is a pose of its own: corridors look alike each
way."""
_FREE_M = 0.15
"""A robot is not nearer to a surface."""
_NEARER = 0.05
"""So much more of the scan has to fit at the edge of where is looked than in the middle."""
_BEYOND_M = 0.3
"""A beam that ends so far behind a wall went through it."""
_PEAKS, _APART_M, _APART_RAD = 12, 0.5, math.radians(30.0)


class PoseSearch:
    """Looks for poses at which a scan fits.

    Args:
        field: The map's distances.
        grid: The map: a robot is only where it is free.
        fit: Fits a scan (shape (n, 2), beam ends in the base frame), beginning at a pose.
    """

    def __init__(
        self,
        field: LikelihoodField,
        grid: OccupancyGrid,
        fit: Callable[[NDArray[np.float64], Pose2], Match],
    ) -> None:
        self._field = field
        self._fit = fit
        distances = field.signed.astype(float)
        self._table = np.ascontiguousarray(np.exp(-(distances**2) / (2.0 * _SIGMA_M**2)), np.float32)
        self._free = (grid.cells >= 0) & (grid.cells < OCCUPIED_FROM) & (distances >= _FREE_M)
        stride = max(1, round(_COARSE_M / field.resolution))
        rows, columns = np.nonzero(self._free[::stride, ::stride])
        corner = np.array([field.origin_x, field.origin_y])
        self._places = corner + (np.stack([columns, rows], axis=1) * stride + 0.5) * field.resolution
        # The first calls load the compiled loops: not during a drive.
        self._scores(self._places[:1], np.zeros(1), np.zeros((1, 2)))
        self.contradicted_part(np.zeros((1, 2)), Pose2())

    def contradicted_part(self, points: NDArray[np.float64], pose: Pose2) -> float:
        """The part of a scan, shape (n, 2), beam ends in the base frame, that went through walls."""
        field = self._field
        return float(
            contradicted_part(
                pose.x,
                pose.y,
                pose.yaw,
                evenly(points, _BEAMS),
                field.signed,
                field.origin_x,
                field.origin_y,
                field.resolution,
                _SIGMA_M,
                _BEYOND_M,
            )
        )

    def around(self, points: NDArray[np.float64], centre: Pose2, reach: float, turn: float) -> Match:
        """The best fit around a pose.

        Args:
            points: Shape (n, 2), beam ends in the base frame.
            centre: Where to look, map frame.
            reach: How far from there, metres.
            turn: How far from its heading, radians.
        """
        few = evenly(points, _BEAMS)
        coarse = self._best(few, centre, reach, turn, _STEP_M, _STEP_RAD)
        return self._fit(points, self._best(few, coarse, _STEP_M, _STEP_RAD, _FINE_M, _FINE_RAD))

    def everywhere(self, points: NDArray[np.float64]) -> list[Match]:
        """The places of the whole map where the scan fits best, apart from each other, the best one first."""
        few = evenly(points, _BEAMS)
        count = round(math.tau / _COARSE_RAD / _SECTORS)
        poses, scores = [], []
        for sector in range(_SECTORS):
            headings = (
                np.arange(sector * count, (sector + 1) * count, dtype=np.float64) * _COARSE_RAD - math.pi
            )
            found, which = self._scores(self._places, headings, few)
            poses.append(np.column_stack([self._places, headings[which]]))
            scores.append(found)
        order = np.argsort(-np.concatenate(scores), kind="stable")
        peaks = _apart((Pose2(*pose) for pose in np.concatenate(poses)[order].tolist()), lambda pose: pose)
        fits = [self.around(points, peak, _COARSE_M, _COARSE_RAD) for peak in peaks]
        return _apart(sorted(fits, key=lambda match: -match.near_fraction), lambda match: match.pose)

    def _best(
        self,
        points: NDArray[np.float64],
        centre: Pose2,
        reach: float,
        turn: float,
        step: float,
        turn_step: float,
    ) -> Pose2:
        along = step * np.arange(-round(reach / step), round(reach / step) + 1)
        x, y = (each.ravel() for each in np.meshgrid(along, along))
        places = np.stack([centre.x + x, centre.y + y], axis=1)
        places = places[(np.hypot(x, y) <= reach + step / 2.0) & self._at(self._free, places)]
        if not len(places):
            return centre
        turns = round(turn / turn_step)
        headings = centre.yaw + turn_step * np.arange(-turns, turns + 1, dtype=np.float64)
        scores, which = self._scores(places, headings, points)
        # Along a corridor all places look alike: then the nearest one counts.
        away = np.hypot(places[:, 0] - centre.x, places[:, 1] - centre.y) / reach
        best = int((scores - _NEARER * away**2).argmax())
        px, py = places[best].tolist()
        return Pose2(px, py, normalize_angle(float(headings[which[best]])))

    def _at(self, cells: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether some points, shape (n, 2), map frame, lie in such cells."""
        field = self._field
        corner = np.array([field.origin_x, field.origin_y])
        u, v = np.floor((points - corner) / field.resolution).astype(int).T
        inside = (u >= 0) & (u < cells.shape[1]) & (v >= 0) & (v < cells.shape[0])
        found = np.zeros(len(points), bool)
        found[inside] = cells[v[inside], u[inside]]
        return found

    def _scores(
        self, places: NDArray[np.float64], headings: NDArray[np.float64], points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        field = self._field
        found: tuple[NDArray[np.float64], NDArray[np.int64]] = score_poses(
            np.ascontiguousarray(places),
            headings,
            points,
            self._table,
            field.origin_x,
            field.origin_y,
            field.resolution,
        )
        return found


def _apart(ordered: Iterable[T], pose_of: Callable[[T], Pose2]) -> list[T]:
    """The first of some places that are apart from each other."""
    found: list[T] = []
    for each in ordered:
        pose = pose_of(each)
        if all(
            pose.distance_to(pose_of(other)) > _APART_M
            or abs(normalize_angle(pose.yaw - pose_of(other).yaw)) > _APART_RAD
            for other in found
        ):
            found.append(each)
        if len(found) == _PEAKS:
            break
    return found


def evenly(points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """At most ``count`` of the points, evenly chosen."""
    if len(points) <= count:
        return points
    return np.ascontiguousarray(points[np.linspace(0, len(points) - 1, count).round().astype(int)])
