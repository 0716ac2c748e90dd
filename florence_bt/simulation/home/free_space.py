"""The flat cut into grid cells: where solids stand, how far the next one is, and what can be reached.

Pure numpy and scipy; the map generator and the placing of people use it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from florence_bt.simulation.home.flat import Flat, Solid

BoolGrid = NDArray[np.bool_]

ROBOT_HEIGHT_M = 1.0
"""What hangs above cannot be touched by the robot."""

_SAMPLES = 5
"""A cell's coverage is measured at this many points squared."""


@dataclass(frozen=True, slots=True)
class GridFrame:
    """Where a grid lies: row 0 has the lowest y.

    Attributes:
        x: Outer corner of cell [0, 0] in the map frame, metres.
        y: Outer corner of cell [0, 0] in the map frame, metres.
        resolution: Metres per cell.
        rows: Number of rows (along y).
        columns: Number of columns (along x).
    """

    x: float
    y: float
    resolution: float
    rows: int
    columns: int

    @staticmethod
    def around(flat: Flat, resolution: float, margin: float) -> GridFrame:
        """A grid that covers the flat and ``margin`` metres around it."""
        left, low, right, high = flat.bounds
        return GridFrame(
            left - margin,
            low - margin,
            resolution,
            math.ceil((high - low + 2 * margin) / resolution - 1e-9),
            math.ceil((right - left + 2 * margin) / resolution - 1e-9),
        )

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """(row, column) of a point of the map frame; may lie outside the grid."""
        return math.floor((y - self.y) / self.resolution), math.floor((x - self.x) / self.resolution)

    def contains(self, row: int, column: int) -> bool:
        """Whether a cell lies in the grid."""
        return 0 <= row < self.rows and 0 <= column < self.columns

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The x of every column's centre and y of every row's centre."""
        half = self.resolution / 2
        return (
            np.arange(self.columns, dtype=np.float64) * self.resolution + (self.x + half),
            np.arange(self.rows, dtype=np.float64) * self.resolution + (self.y + half),
        )


def cells_covered(frame: GridFrame, solids: Iterable[Solid], share: float = 0.2) -> BoolGrid:
    """Which cells the solids stand on, seen from above.

    Args:
        frame: The grid.
        solids: What to draw.
        share: A cell counts when a solid covers at least this part of it.

    Returns:
        Shape (rows, columns).
    """
    grid = np.zeros((frame.rows, frame.columns), bool)
    offsets = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    for solid in solids:
        reach = math.hypot(*solid.half) if solid.half else solid.radius
        row, column = frame.cell_of(solid.x - reach, solid.y - reach)
        end_row, end_column = frame.cell_of(solid.x + reach, solid.y + reach)
        rows = np.arange(max(row, 0), min(end_row + 1, frame.rows))
        columns = np.arange(max(column, 0), min(end_column + 1, frame.columns))
        if not rows.size or not columns.size:
            continue
        y = frame.y + (rows[:, None] + offsets).reshape(-1, 1) * frame.resolution
        x = frame.x + (columns[:, None] + offsets).reshape(1, -1) * frame.resolution
        inside = _inside(solid, x, y).reshape(rows.size, _SAMPLES, columns.size, _SAMPLES)
        grid[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] |= inside.mean(axis=(1, 3)) >= share
    return grid


def _inside(solid: Solid, x: NDArray[np.float64], y: NDArray[np.float64]) -> BoolGrid:
    dx, dy = x - solid.x, y - solid.y
    if solid.half is None:
        return dx * dx + dy * dy <= solid.radius**2
    c, s = math.cos(solid.yaw), math.sin(solid.yaw)
    return (np.abs(c * dx + s * dy) <= solid.half[0]) & (np.abs(c * dy - s * dx) <= solid.half[1])


class FreeSpace:
    """The floor that the robot can stand on.

    Args:
        flat: The flat.
        resolution: Metres per cell.
    """

    def __init__(self, flat: Flat, resolution: float = 0.05) -> None:
        self.frame = GridFrame.around(flat, resolution, margin=0.25)
        touchable = (solid for solid in flat.solids if solid.bottom < ROBOT_HEIGHT_M)
        blocked = cells_covered(self.frame, touchable)
        self.clearance = ndimage.distance_transform_edt(~blocked) * resolution - resolution / 2
        """Metres from each cell's centre to the next solid, shape (rows, columns); walls enclose the flat."""
        tall = (solid for solid in flat.solids if solid.top > _EYE_HEIGHT_M > solid.bottom)
        self._opaque = cells_covered(self.frame, tall)

    def clearance_at(self, x: float, y: float) -> float:
        """Metres from a point to the next solid; below zero inside of one or outside of the grid."""
        row, column = self.frame.cell_of(x, y)
        return float(self.clearance[row, column]) if self.frame.contains(row, column) else -math.inf

    def reachable(
        self, start: tuple[float, float], radius: float, person: tuple[float, float, float] | None = None
    ) -> BoolGrid:
        """Where the centre of a round robot can get to.

        Args:
            start: Where it stands, map frame.
            radius: Its radius in metres.
            person: x, y and radius of somebody who stands in the way, or None.

        Returns:
            Shape (rows, columns); all False when it does not fit where it stands.
        """
        free = self.clearance >= radius
        if person is not None:
            x, y = self.frame.centres()
            free &= np.hypot(x[None, :] - person[0], y[:, None] - person[1]) >= radius + person[2]
        labels, _ = ndimage.label(free)
        row, column = self.frame.cell_of(*start)
        label = labels[row, column] if self.frame.contains(row, column) else 0
        return labels == label if label else np.zeros_like(free)

    def sees(self, eye: tuple[float, float], target: tuple[float, float]) -> bool:
        """Whether nothing of a person's chest height or more stands between two points."""
        steps = max(1, math.ceil(math.dist(eye, target) / (self.frame.resolution / 2)))
        parts = np.linspace(0.0, 1.0, steps + 1)
        x, y = eye[0] + parts * (target[0] - eye[0]), eye[1] + parts * (target[1] - eye[1])
        rows = np.floor((y - self.frame.y) / self.frame.resolution).astype(int)
        columns = np.floor((x - self.frame.x) / self.frame.resolution).astype(int)
        return not self._opaque[rows, columns].any()


_EYE_HEIGHT_M = 0.95


@functools.lru_cache(maxsize=8)
def free_space_of(flat: Flat) -> FreeSpace:
    """The free space of a flat, computed once."""
    return FreeSpace(flat)
