"""The flat cut into grid cells: where solids stand, how far the next one is, and what can be reached.

Pure numpy and scipy; the map generator and the placing of people use it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load at their first use
from numpy.typing import NDArray

from florence_bt.simulation.home.flat import Flat, Solid

Point = tuple[float, float]
BoolGrid = NDArray[np.bool_]

ROBOT_HEIGHT_M = 1.0
"""Height above which the robot touches nothing."""

_RESOLUTION_M = 0.05
_SAMPLES = 5
"""A cell's coverage is measured at this many points squared."""
_IN_CELL = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
"""Their places, in cells."""


@dataclass(frozen=True, slots=True)
class GridFrame:
    """The frame of a grid: row 0 has the lowest y.

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
        """Make a grid that covers the flat and ``margin`` metres around it."""
        left, low, right, high = flat.bounds
        return GridFrame(
            left - margin,
            low - margin,
            resolution,
            math.ceil((high - low + 2 * margin) / resolution - 1e-9),
            math.ceil((right - left + 2 * margin) / resolution - 1e-9),
        )

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Return the (row, column) of a point of the map frame; may lie outside the grid."""
        return math.floor((y - self.y) / self.resolution), math.floor((x - self.x) / self.resolution)

    def contains(self, row: int, column: int) -> bool:
        """Tell whether a cell lies in the grid."""
        return 0 <= row < self.rows and 0 <= column < self.columns

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the x of every column's centre and y of every row's centre."""
        half = self.resolution / 2
        return (
            np.arange(self.columns, dtype=np.float64) * self.resolution + (self.x + half),
            np.arange(self.rows, dtype=np.float64) * self.resolution + (self.y + half),
        )


def cells_covered(frame: GridFrame, solids: Iterable[Solid], share: float = 0.2) -> BoolGrid:
    """Tell which cells the solids stand on, seen from above.

    Args:
        frame: The grid.
        solids: What to draw.
        share: A cell counts when a solid covers at least this part of it.

    Returns:
        Shape (rows, columns).
    """
    grid = np.zeros((frame.rows, frame.columns), bool)
    x = frame.x + (np.arange(frame.columns)[:, None] + _IN_CELL) * frame.resolution
    y = frame.y + (np.arange(frame.rows)[:, None] + _IN_CELL) * frame.resolution
    for solid in solids:
        _cover(grid, frame, (x, y), solid, share)
    return grid


def _cover(
    grid: BoolGrid,
    frame: GridFrame,
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
    solid: Solid,
    share: float,
) -> None:
    """Mark the cells that a solid stands on; the samples are in x by column, and in y by row."""
    cosine, sine = math.cos(solid.yaw), math.sin(solid.yaw)
    reach_x = reach_y = solid.radius
    if solid.half:
        along, across = solid.half
        reach_x = abs(cosine) * along + abs(sine) * across
        reach_y = abs(sine) * along + abs(cosine) * across
    row, column = (max(first, 0) for first in frame.cell_of(solid.x - reach_x, solid.y - reach_y))
    end_row, end_column = (max(last + 1, 0) for last in frame.cell_of(solid.x + reach_x, solid.y + reach_y))
    dx = (samples[0][column:end_column] - solid.x).ravel()
    dy = (samples[1][row:end_row] - solid.y).reshape(-1, 1)
    if not dx.size or not dy.size:
        return
    if solid.half:
        inside = abs(cosine * dx + sine * dy) <= along
        inside &= abs(cosine * dy - sine * dx) <= across
    else:
        inside = dx * dx + dy * dy <= solid.radius**2
    of_rows = np.add.reduce(inside.view(np.int8).reshape(-1, _SAMPLES, dx.size), 1, dtype=np.int8)
    count = np.add.reduce(of_rows.reshape(len(of_rows), -1, _SAMPLES), 2, dtype=np.int8)
    grid[row:end_row, column:end_column] |= count / _SAMPLES**2 >= share


class FreeSpace:
    """The floor that the robot can stand on.

    Args:
        flat: The flat.
    """

    def __init__(self, flat: Flat) -> None:
        self.frame = GridFrame.around(flat, _RESOLUTION_M, margin=0.25)
        touchable = (solid for solid in flat.solids if solid.bottom < ROBOT_HEIGHT_M)
        blocked = cells_covered(self.frame, touchable)
        self.clearance = scipy.ndimage.distance_transform_edt(~blocked) * _RESOLUTION_M - _RESOLUTION_M / 2
        """Metres from each cell's centre to the next solid, shape (rows, columns); walls enclose the flat."""
        tall = (solid for solid in flat.solids if solid.top > _EYE_HEIGHT_M > solid.bottom)
        self._opaque = cells_covered(self.frame, tall)

    def clearance_at(self, x: float, y: float) -> float:
        """Return the metres from a point to the next solid; below zero inside of one or off the grid."""
        row, column = self.frame.cell_of(x, y)
        return float(self.clearance[row, column]) if self.frame.contains(row, column) else -math.inf

    def reachable(
        self, start: tuple[float, float], radius: float, person: tuple[float, float, float] | None = None
    ) -> BoolGrid:
        """Return where the centre of a round robot can get to.

        Args:
            start: Where it stands, map frame.
            radius: Its radius in metres.
            person: x, y and radius of somebody who stands in the way, or None.

        Returns:
            Shape (rows, columns); all False when it does not fit where it stands.
        """
        bodies = [] if person is None else [(person[0], person[1], radius + person[2])]
        free = self._free(radius, bodies)
        labels, _ = scipy.ndimage.label(free)
        row, column = self.frame.cell_of(*start)
        label = labels[row, column] if self.frame.contains(row, column) else 0
        return labels == label if label else np.zeros_like(free)

    def shortest_way(
        self,
        start: Point,
        goal: Point | BoolGrid,
        radius: float,
        bodies: Sequence[tuple[float, float, float]] = (),
    ) -> list[Point] | None:
        """Return the shortest way for something round.

        Args:
            start: Where it is, map frame.
            goal: Where it wants to, or cells of which the nearest is taken, shape (rows, columns).
            radius: Its radius in metres.
            bodies: x, y of who else is there, and how far its middle keeps from theirs, metres.

        Returns:
            Points between which it can go straight, the first in the cell of the start and the last in that
            of the goal; None when there is no way.
        """
        free = self._free(radius, bodies)
        begin = self.frame.cell_of(*start)
        goals = goal if isinstance(goal, np.ndarray) else self._only(self.frame.cell_of(*goal))
        ends = np.flatnonzero(goals & free)
        if not self.frame.contains(*begin) or not free[begin] or not len(ends):
            return None
        first = begin[0] * self.frame.columns + begin[1]
        length, before = scipy.sparse.csgraph.dijkstra(_graph(free), indices=first, return_predecessors=True)
        end = int(ends[np.argmin(length[ends])])
        if not math.isfinite(length[end]):
            return None
        cells = [end]
        while cells[-1] != first:
            cells.append(int(before[cells[-1]]))
        x, y = self.frame.centres()
        columns = self.frame.columns
        points = [(float(x[cell % columns]), float(y[cell // columns])) for cell in reversed(cells)]
        return self._straightened(points, free)

    def nearest(
        self, point: Point, radius: float, bodies: Sequence[tuple[float, float, float]] = ()
    ) -> Point | None:
        """Return the middle of the nearest cell where something round can be; None without any.

        Args:
            point: Map frame.
            radius: Its radius in metres.
            bodies: As of :meth:`shortest_way`.
        """
        x, y = self.frame.centres()
        away = np.hypot(x[None, :] - point[0], y[:, None] - point[1])
        away[~self._free(radius, bodies)] = math.inf
        row, column = divmod(int(np.argmin(away)), self.frame.columns)
        return (float(x[column]), float(y[row])) if math.isfinite(away[row, column]) else None

    def _free(self, radius: float, bodies: Sequence[tuple[float, float, float]]) -> BoolGrid:
        free = self.clearance >= radius
        x, y = self.frame.centres()
        for body_x, body_y, apart in bodies:
            free &= np.hypot(x[None, :] - body_x, y[:, None] - body_y) >= apart
        return free

    def _only(self, cell: tuple[int, int]) -> BoolGrid:
        only = np.zeros_like(self._opaque)
        if self.frame.contains(*cell):
            only[cell] = True
        return only

    def _straightened(self, points: list[Point], free: BoolGrid) -> list[Point]:
        """Leave out points while the straight way between their neighbours is free."""
        kept = [points[0]]
        here = 0
        while here < len(points) - 1:
            there = len(points) - 1
            while there > here + 1 and not free[self._cells_between(points[here], points[there])].all():
                there -= 1
            kept.append(points[there])
            here = there
        return kept

    def fits(self, start: Point, end: Point, radius: float) -> bool:
        """Tell whether something round can go straight between two points; off the grid nothing can."""
        rows, columns = self._cells_between(start, end)
        height, width = self.clearance.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        return bool(inside.all() and (self.clearance[rows, columns] >= radius).all())

    def sees(self, eye: tuple[float, float], target: tuple[float, float]) -> bool:
        """Tell whether nothing of a person's chest height or more stands between two points."""
        return not self._opaque[self._cells_between(eye, target)].any()

    def _cells_between(self, start: Point, end: Point) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the rows and columns of the cells on a straight line."""
        steps = max(1, math.ceil(math.dist(start, end) / (self.frame.resolution / 2)))
        parts = np.linspace(0.0, 1.0, steps + 1)
        x, y = start[0] + parts * (end[0] - start[0]), start[1] + parts * (end[1] - start[1])
        rows = np.floor((y - self.frame.y) / self.frame.resolution).astype(int)
        columns = np.floor((x - self.frame.x) / self.frame.resolution).astype(int)
        return rows, columns


def _graph(free: BoolGrid) -> scipy.sparse.csr_array:
    """Return the steps between neighbouring free cells, also diagonal, in cells; numbered row by row."""
    numbers = np.arange(free.size).reshape(free.shape)
    here, there, cost = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        rows, columns = free.shape[0] - down, free.shape[1] - abs(right)
        left = max(0, -right)
        one = (slice(0, rows), slice(left, left + columns))
        other = (slice(down, down + rows), slice(left + right, left + right + columns))
        both = free[one] & free[other]
        here.append(numbers[one][both])
        there.append(numbers[other][both])
        cost.append(np.full(int(both.sum()), math.hypot(down, right)))
    a, b, c = np.concatenate(here), np.concatenate(there), np.concatenate(cost)
    ends = (np.concatenate([a, b]), np.concatenate([b, a]))
    return scipy.sparse.csr_array((np.concatenate([c, c]), ends), shape=(free.size, free.size))


_EYE_HEIGHT_M = 0.95
"""Height above the floor of solids that hide what is behind them. Chosen."""


@functools.lru_cache(maxsize=8)
def free_space_of(flat: Flat) -> FreeSpace:
    """Return the free space of a flat, computed once."""
    return FreeSpace(flat)
