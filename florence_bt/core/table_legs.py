"""Tables and chairs in a map that a laser made: only their legs are there.

A robot that is taller than a table does not fit under it, and a glass top is seen by no sensor. Four legs at
the corners of a rectangle show where it is.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import OCCUPIED, OccupancyGrid

Point = NDArray[np.float64]
"""Shape (2,), x and y in metres."""

_THICKEST_M = 0.15
"""A leg of the map is at most as broad."""
_SIDES_M = 0.25, 1.6
_MOST_PIECES = 20_000
"""A map with more is noise."""
_MOST_NEAR = 40
"""Number of small pieces within the length of a table above which they are noise of the map and no legs."""
_OFF_M = 0.08
"""A leg is at most so far from the corner of the rectangle that the other three make: a cell and a half."""


def with_tables(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map with the places between the legs of tables and chairs occupied, too.

    Each leg belongs to one piece of furniture; of several rectangles with the same leg the smallest counts,
    as chairs stand around tables.

    Args:
        grid: The map.
    """
    cells = grid.cells.copy()
    for corner, one, other in _rectangles(_legs(grid)):
        _fill(cells, grid, corner, one - corner, other - corner)
    return replace(grid, cells=cells)


def table_legs(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return where the legs of tables and chairs are, shape (n, 2), metres."""
    corners = [
        point
        for corner, one, other in _rectangles(_legs(grid))
        for point in (corner, one, other, one + other - corner)
    ]
    return np.array(corners).reshape(-1, 2)


def _fill(cells: NDArray[np.int8], grid: OccupancyGrid, corner: Point, side: Point, other: Point) -> None:
    """Occupy the cells whose middles are in a rectangle, in place."""
    points = np.stack([corner, corner + side, corner + other, corner + side + other])
    (left, low), (right, top) = points.min(axis=0), points.max(axis=0)
    (row, column), (last_row, last_column) = grid.cell_of(left, low), grid.cell_of(right, top)
    rows, columns = np.mgrid[max(row, 0) : last_row + 1, max(column, 0) : last_column + 1]
    x = grid.origin.x + (columns + 0.5) * grid.resolution - corner[0]
    y = grid.origin.y + (rows + 0.5) * grid.resolution - corner[1]
    along = (x * side[0] + y * side[1]) / (side @ side)
    across = (x * other[0] + y * other[1]) / (other @ other)
    inside = (along >= 0.0) & (along <= 1.0) & (across >= 0.0) & (across <= 1.0)
    window = cells[max(row, 0) : last_row + 1, max(column, 0) : last_column + 1]
    window[inside[: window.shape[0], : window.shape[1]]] = OCCUPIED


def _legs(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the middles of the small occupied pieces of a map, shape (n, 2), metres."""
    from scipy import ndimage

    labels, count = ndimage.label(grid.cells > OCCUPIED // 2, np.ones((3, 3)))
    if count > _MOST_PIECES:
        return np.empty((0, 2))
    most = _THICKEST_M / grid.resolution + 1e-6
    small = [
        number
        for number, (rows, columns) in enumerate(ndimage.find_objects(labels), 1)
        if rows.stop - rows.start <= most and columns.stop - columns.start <= most
    ]
    middles = np.array(ndimage.center_of_mass(labels > 0, labels, small)).reshape(-1, 2)
    return np.array([grid.origin.x, grid.origin.y]) + (middles[:, ::-1] + 0.5) * grid.resolution


def _rectangles(legs: NDArray[np.float64]) -> list[tuple[Point, Point, Point]]:
    """Return three corners of each rectangle, the one between the other two first; metres."""
    if len(legs) < 4:
        return []
    from scipy.spatial import cKDTree

    tree = cKDTree(legs)
    found = []
    for corner, near in enumerate(tree.query_ball_point(legs, _SIDES_M[1])):
        if len(near) > _MOST_NEAR:
            continue
        later = np.array([leg for leg in near if leg > corner], int)
        pairs = np.sort(later)[np.stack(np.triu_indices(len(later), 1), axis=1)]
        ones, others = legs[pairs[:, 0]], legs[pairs[:, 1]]
        off, fourth = tree.query(ones + others - legs[corner])
        closed = (fourth > corner) & (off <= 2 * _OFF_M)
        for (one, other), last in zip(pairs[closed].tolist(), fourth[closed].tolist(), strict=True):
            used = {corner, one, other, last}
            if len(used) == 4 and _is_rectangle(legs[[corner, one, last, other]]):
                area = math.dist(legs[corner], legs[one]) * math.dist(legs[corner], legs[other])
                found.append((area, (corner, one, other), used))
    taken: set[int] = set()
    chosen = []
    for _, (corner, one, other), used in sorted(found, key=lambda each: each[:2]):
        if not taken & used:
            taken |= used
            chosen.append((legs[corner], legs[one], legs[other]))
    return chosen


def _is_rectangle(corners: NDArray[np.float64]) -> bool:
    """Tell whether four points, in order round it, are the corners of a rectangle of the size of a table."""
    first, second, third, fourth = (math.dist(corners[at], corners[at - 1]) for at in range(4))
    diagonals = math.dist(corners[0], corners[2]), math.dist(corners[1], corners[3])
    pairs = (first, third), (second, fourth), diagonals, (diagonals[0], math.hypot(first, second))
    sized = all(_SIDES_M[0] <= side <= _SIDES_M[1] for side in (first, second))
    return sized and all(abs(a - b) <= _OFF_M for a, b in pairs)
