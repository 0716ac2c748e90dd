"""Draws scans into an occupancy grid that grows as needed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, MAX_MAP_CELLS, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.mapping._kernels import draw_beams
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.panes import Pane

_GROW_M = 5.0
"""The grid grows by so much more than is needed."""
_MARGIN_CELLS = 4
"""Unknown cells around what is known, in the grid that is given."""
_SHARE = 0.25
"""A cell is a surface when so much of the scans that reached it ended there: the others met what stands
before or behind it in the cell, and grazed it."""
_FEW, _SPECK_M = 2, 0.5
"""Number of scans and size, at most, of something that stands nowhere: somebody has walked by."""


class GridBuilder:
    """Counts in how many scans each cell was a surface, and in how many free.

    Args:
        resolution: Metres per cell.
        longest: Beams count up to here, metres.
        panes: What every beam ends at.
    """

    def __init__(self, resolution: float, longest: float, panes: Sequence[Pane] = ()) -> None:
        self._resolution, self._longest, self._panes = resolution, longest, panes
        # The place of cell [0, 0], in cells, so that a cell is always at the same place.
        self._low = np.zeros(2, int)
        self._hits: NDArray[np.uint16] = np.zeros((0, 0), np.uint16)
        self._passes: NDArray[np.uint16] = np.zeros((0, 0), np.uint16)
        self._marks: NDArray[np.int32] = np.zeros((0, 0), np.int32)
        self._scans = 0

    def add(self, scan: KeptScan, pose: Pose2) -> None:
        """Draw a scan.

        Args:
            scan: What was seen.
            pose: Of the base, in the map frame.

        Raises:
            ConfigError: The map would become too large.
        """
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        local = np.concatenate([scan.start[None, :], scan.points, scan.clear]).astype(float)
        there = local @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)
        met = np.arange(len(there) - 1) < len(scan.points)
        for pane in self._panes:
            met |= pane.cut(there[0], there[1:])
        there /= self._resolution
        start, ends = there[0], there[1:]
        longest = self._longest / self._resolution
        near = np.abs(there - start).max(axis=1) <= longest
        self._make_room(np.floor(there[near].min(axis=0)), np.floor(there[near].max(axis=0)) + 1.0)
        u, v = start - self._low
        self._scans += 1
        draw_beams(self._hits, self._passes, self._marks, self._scans, u, v, ends - self._low, met, longest)

    def _make_room(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        shape = np.array(self._hits.shape[::-1])
        if (low >= self._low).all() and (high <= self._low + shape).all():
            return
        more = math.ceil(_GROW_M / self._resolution)
        if shape.any():
            low, high = np.minimum(low, self._low), np.maximum(high, self._low + shape)
            grown_low = np.where(low < self._low, low - more, self._low)
            grown_high = np.where(high > self._low + shape, high + more, self._low + shape)
        else:
            grown_low, grown_high = low - more, high + more
        new_low = grown_low.astype(int)
        columns, rows = grown_high.astype(int) - new_low
        if rows * columns > MAX_MAP_CELLS:
            size = f"{columns * self._resolution:.0f} x {rows * self._resolution:.0f} m"
            raise ConfigError(
                f"the map would become {size} in cells of {self._resolution:g} m",
                valid=[f"at most {MAX_MAP_CELLS} cells", "larger cells (resolution)"],
            )
        column, row = self._low - new_low if shape.any() else (0, 0)
        part = np.s_[row : row + shape[1], column : column + shape[0]]
        for name in ("_hits", "_passes", "_marks"):
            old = getattr(self, name)
            new = np.zeros((rows, columns), old.dtype)
            new[part] = old
            setattr(self, name, new)
        self._low = new_low

    def grid(self) -> OccupancyGrid:
        """Return the map: free, occupied and unknown cells, cut to what is known."""
        reached = self._hits.astype(np.int32) + self._passes
        known = reached > 0
        if not known.any():
            return OccupancyGrid(self._resolution, Pose2(), np.full((1, 1), UNKNOWN, np.int8))
        rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        hits, reached = self._hits[part], reached[part]
        surface = hits > _SHARE * reached
        surface &= ~self._specks(surface, hits)
        surface |= self._at_panes()[part]
        cells = np.where(surface, OCCUPIED, np.where(reached > 0, FREE, UNKNOWN)).astype(np.int8)
        # What somebody was seen at, and nobody has looked through, is not known.
        cells[(reached == hits) & (reached > 0) & ~surface] = UNKNOWN
        corner = (self._low + np.array([columns[0], rows[0]]) - _MARGIN_CELLS) * self._resolution
        return OccupancyGrid(
            self._resolution,
            Pose2(*corner.tolist()),
            np.pad(cells, _MARGIN_CELLS, constant_values=UNKNOWN),
        )

    def _at_panes(self) -> NDArray[np.bool_]:
        """Tell where panes are."""
        rows, columns = self._hits.shape
        there = np.zeros((rows, columns), bool)
        for pane in self._panes:
            steps = 2 + math.ceil(2.0 * math.dist(pane.start, pane.end) / self._resolution)
            column, row = (
                np.floor(np.linspace(start, end, steps) / self._resolution).astype(int) - low
                for start, end, low in zip(pane.start, pane.end, self._low, strict=True)
            )
            inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
            there[row[inside], column[inside]] = True
        return there

    def _specks(self, surface: NDArray[np.bool_], hits: NDArray[np.uint16]) -> NDArray[np.bool_]:
        """Tell which surfaces are small and were hardly ever seen."""
        pieces, count = label(surface, np.ones((3, 3), int))
        if not count:
            return np.zeros_like(surface)
        most = np.zeros(count + 1, hits.dtype)
        np.maximum.at(most, pieces.ravel(), hits.ravel())
        large = _SPECK_M / self._resolution
        small = [True] + [max(s.stop - s.start for s in place) <= large for place in find_objects(pieces)]
        speck = np.array(small) & (most <= _FEW)
        speck[0] = False
        return speck[pieces]
