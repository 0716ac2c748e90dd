"""The pose at which scans fit the map, looked for around a place or everywhere.

A fit that begins at a wrong pose ends at a wrong one. So poses of a grid are tried, and the fit begins at the
best of them. Everywhere there are millions, and most are ruled out by the block: a table that gives for
each block of cells how well a beam fits that ends in the best of them bounds what all poses of the block can
reach.

Source: Olson, Real-time correlative scan matching, ICRA 2009; Hess et al., Real-time loop closure in 2D lidar
SLAM, ICRA 2016 (branch and bound).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.localisation._kernels import contradicted_part, score_blocks
from florence_bt.skills.navigation.localisation.likelihood_field import OCCUPIED_FROM, LikelihoodField
from florence_bt.skills.navigation.localisation.scan_match import Match, evenly, search_around

T = TypeVar("T")

_BEAMS = 60
_STEP_M, _STEP_RAD, _NEAR_M = 0.1, 0.05, 0.3
_FINE_M, _FINE_RAD, _FINE_NEAR_M = 0.025, 0.0125, 0.15
"""Around a place: steps, and how near to a surface a beam has to end."""
_NEARER = 0.05
"""So much more of the scan has to fit at the edge of where is looked than in the middle."""
_ON_SURFACE_M, _BEYOND_M = 0.15, 0.3
"""A beam that ends so near to a surface has met it; one that ends so far behind a wall went through it."""
_FREE_M = 0.15
"""A robot is not nearer to a surface."""
_SIGMA_M = 0.15
"""Everywhere: how far from a surface a beam still fits, about as wide as the steps of the grid."""
_LEAF_M, _LEVELS = 0.1, 5
"""The steps of the grid, and how often they are doubled for the blocks."""
_HEADINGS, _SEARCH_BEAMS = 210, 120
_LEAST, _MARGIN = 0.4, 0.2
"""Bounds of what is ruled out: a fit below the first, or below the best by the second."""
_DIVES, _MOST_BLOCKS = 16, 400_000
"""Blocks whose best pose is looked up first, to bound the others, and blocks at most. Chosen."""
_PEAKS, _APART_M, _APART_RAD = 8, 0.5, math.radians(30.0)


class PoseSearch:
    """Looks for poses at which scans fit.

    Args:
        field: The map's distances.
        grid: The map: a robot is only where it is free.
        fit: Fits scans (shape (n, 2), beam ends in the base frame), beginning at a pose.
    """

    def __init__(
        self,
        field: LikelihoodField,
        grid: OccupancyGrid,
        fit: Callable[[NDArray[np.float64], Pose2], Match],
    ) -> None:
        self._field = field
        self._fit = fit
        self._free = (grid.cells >= 0) & (grid.cells < OCCUPIED_FROM) & (field.signed >= _FREE_M)
        self._leaf = max(1, round(_LEAF_M / field.resolution))
        widest = self._leaf << (_LEVELS - 1)
        fits = np.exp(-(field.signed.astype(float) ** 2) / (2.0 * _SIGMA_M**2))
        self._pad = widest
        tables = np.pad(np.round(255.0 * fits).astype(np.uint8), widest)
        free = np.pad(self._free, widest)
        self._tables: list[NDArray[np.uint8]] = []
        self._free_blocks: list[NDArray[np.bool_]] = []
        width = 1
        for level in range(_LEVELS):
            while width < self._leaf << level:
                tables, free = _doubled(tables, width), _doubled(free, width)
                width *= 2
            self._tables.append(tables)
            self._free_blocks.append(free)
        # The first calls load the compiled loops: not during a drive. So far away nothing fits anywhere.
        self.everywhere(np.full((1, 2), 1000.0))
        self.contradicted_part(np.zeros((1, 2)), Pose2())

    def contradicted_part(self, points: NDArray[np.float64], pose: Pose2) -> float:
        """Return the part of a scan, shape (n, 2), beam ends in the base frame, that went through walls."""
        field, at, beams = self._field, (pose.x, pose.y, pose.yaw), evenly(points, _BEAMS)
        return float(contradicted_part(at, beams, field.signed, field.frame, _ON_SURFACE_M, _BEYOND_M))

    def around(self, points: NDArray[np.float64], centre: Pose2, reach: float, turn: float) -> Match | None:
        """Return the best fit around a pose, None where no robot can be.

        Args:
            points: Shape (n, 2), beam ends in the base frame.
            centre: Where to look, map frame.
            reach: How far from there, metres.
            turn: How far from its heading, radians.
        """
        few, cost = evenly(points, _BEAMS), _NEARER / reach**2
        field = self._field
        coarse = search_around(
            field,
            few,
            centre,
            reach=reach,
            turn=turn,
            step=_STEP_M,
            turn_step=_STEP_RAD,
            near=_NEAR_M,
            cost_d=cost,
        )
        fine = search_around(
            field,
            few,
            coarse,
            reach=_STEP_M,
            turn=_STEP_RAD,
            step=_FINE_M,
            turn_step=_FINE_RAD,
            near=_FINE_NEAR_M,
            cost_d=cost,
        )
        match = self._fit(points, fine)
        return match if self._is_free(match.pose) else None

    def everywhere(self, points: NDArray[np.float64]) -> list[Match]:
        """Return the places of the whole map where scans fit best, apart from each other, the best one first.

        Args:
            points: Shape (n, 2), beam ends in the base frame.
        """
        headings = np.arange(_HEADINGS, dtype=np.float64) * (math.tau / _HEADINGS) - math.pi
        few = evenly(points, _SEARCH_BEAMS)
        c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
        ends = np.stack([s * few[:, 0] + c * few[:, 1], c * few[:, 0] - s * few[:, 1]], axis=-1)
        # From the middle of the cell that the robot is in.
        cells = np.floor(ends / self._field.resolution + 0.5).astype(np.int32)
        leaves = self._leaves(cells)
        peaks = _apart((self._pose_of(leaf, headings) for leaf in leaves), lambda pose: pose)
        fits = [self._fit(points, peak) for peak in peaks]
        fits = [each for each in fits if self._is_free(each.pose)]
        return _apart(sorted(fits, key=lambda match: -match.near_fraction), lambda match: match.pose)

    def _leaves(self, beam_cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the poses (row, column, number of the heading) that fit, the best ones first."""
        top = _LEVELS - 1
        width = self._leaf << top
        rows, columns = np.nonzero(self._free_blocks[top][::width, ::width])
        corners = np.stack([rows, columns], axis=1) * width
        headings = np.arange(len(beam_cells))
        blocks = np.column_stack(
            [np.repeat(corners, len(headings), axis=0), np.tile(headings, len(corners))]
        ).astype(np.int32)
        least = _LEAST
        for level in range(top, -1, -1):
            scores = score_blocks(blocks, beam_cells, self._tables[level], least)
            order = np.argsort(-scores, kind="stable")[:_MOST_BLOCKS]
            best = blocks[order[:_DIVES]]
            for below in range(level - 1, -1, -1):
                best = self._split(best, below)
                below_scores = score_blocks(best, beam_cells, self._tables[below], _LEAST)
                best = best[np.argsort(-below_scores, kind="stable")[:_DIVES]]
            if level and len(best):
                leaf_scores = score_blocks(best[:1], beam_cells, self._tables[0], _LEAST)
                least = max(least, float(leaf_scores[0]) - _MARGIN)
            blocks = blocks[order[scores[order] >= least]]
            if level:
                blocks = self._split(blocks, level - 1)
        return blocks

    def _split(self, blocks: NDArray[np.int32], level: int) -> NDArray[np.int32]:
        """Return the quarters of some blocks, as far as a robot can be there."""
        width = self._leaf << level
        quarters = np.array([[0, 0, 0], [0, width, 0], [width, 0, 0], [width, width, 0]], np.int32)
        parts = (blocks[:, None, :] + quarters).reshape(-1, 3)
        free = self._free_blocks[level]
        inside = (parts[:, 0] < free.shape[0]) & (parts[:, 1] < free.shape[1])
        parts = parts[inside]
        return np.ascontiguousarray(parts[free[parts[:, 0], parts[:, 1]]])

    def _pose_of(self, leaf: NDArray[np.int32], headings: NDArray[np.float64]) -> Pose2:
        row, column, heading = leaf.tolist()
        field = self._field
        return Pose2(
            field.origin_x + (column - self._pad + 0.5) * field.resolution,
            field.origin_y + (row - self._pad + 0.5) * field.resolution,
            float(headings[heading]),
        )

    def _is_free(self, pose: Pose2) -> bool:
        field = self._field
        column = math.floor((pose.x - field.origin_x) / field.resolution)
        row = math.floor((pose.y - field.origin_y) / field.resolution)
        rows, columns = self._free.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self._free[row, column])


def _doubled(table: NDArray, width: int) -> NDArray:
    """Return the greatest values of blocks of twice the width, each kept at the block's first cell."""
    wider = table.copy()
    np.maximum(wider[:-width], table[width:], out=wider[:-width])
    both = wider.copy()
    np.maximum(both[:, :-width], wider[:, width:], out=both[:, :-width])
    return both


def _apart(ordered: Iterable[T], pose_of: Callable[[T], Pose2]) -> list[T]:
    """Return the first of some places that are apart from each other."""
    found: list[T] = []
    for each in ordered:
        pose = pose_of(each)
        if all(
            pose.distance_to(pose_of(other)) > _APART_M
            or abs(angle_difference(pose.yaw, pose_of(other).yaw)) > _APART_RAD
            for other in found
        ):
            found.append(each)
        if len(found) == _PEAKS:
            break
    return found
