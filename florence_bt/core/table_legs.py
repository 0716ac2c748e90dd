"""Tables and chairs in a map that a laser made: only their legs are there.

A robot that is taller than a table does not fit under it, and a glass top is seen by no sensor. Four legs at
the corners of a rectangle tell where it is.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import OCCUPIED, OccupancyGrid

_THICKEST_M = 0.15
"""A leg of the map is at most as broad."""
_SIDES_M = 0.25, 1.6
_OFF_M = 0.08
"""A leg is at most so far from the corner of the rectangle that the other three make: a cell and a half."""


def with_tables(grid: OccupancyGrid) -> OccupancyGrid:
    """The map with the places between the legs of tables and chairs occupied, too.

    Each leg belongs to one piece of furniture; of several rectangles with the same leg the smallest counts,
    as chairs stand around tables.

    Args:
        grid: The map.
    """
    cells = grid.cells.copy()
    rows, columns = np.indices(cells.shape)
    for corners in _rectangles(_legs(grid)):
        first, side, other = corners[0], corners[1] - corners[0], corners[2] - corners[0]
        x = grid.origin.x + (columns + 0.5) * grid.resolution - first[0]
        y = grid.origin.y + (rows + 0.5) * grid.resolution - first[1]
        along = (x * side[0] + y * side[1]) / (side @ side)
        across = (x * other[0] + y * other[1]) / (other @ other)
        cells[(along >= 0.0) & (along <= 1.0) & (across >= 0.0) & (across <= 1.0)] = OCCUPIED
    return replace(grid, cells=cells)


def _legs(grid: OccupancyGrid) -> NDArray[np.float64]:
    """The middles of the small occupied pieces of a map, shape (n, 2), metres."""
    from scipy import ndimage

    labels, _ = ndimage.label(grid.cells > OCCUPIED // 2, np.ones((3, 3)))
    most = _THICKEST_M / grid.resolution + 1e-6
    small = [
        number
        for number, (rows, columns) in enumerate(ndimage.find_objects(labels), 1)
        if rows.stop - rows.start <= most and columns.stop - columns.start <= most
    ]
    middles = np.array(ndimage.center_of_mass(labels > 0, labels, small)).reshape(-1, 2)
    return np.array([grid.origin.x, grid.origin.y]) + (middles[:, ::-1] + 0.5) * grid.resolution


def _rectangles(legs: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Three corners of each rectangle, shape (3, 2), the one between the other two first; metres."""
    found = []
    apart = np.hypot(*(legs[:, None] - legs[None]).transpose(2, 0, 1))
    for corner in range(len(legs)):
        near = np.flatnonzero((apart[corner] >= _SIDES_M[0]) & (apart[corner] <= _SIDES_M[1]))
        for one, other in itertools.combinations(near.tolist(), 2):
            fourth = int(np.argmin(np.hypot(*(legs - (legs[one] + legs[other] - legs[corner])).T)))
            used = {corner, one, other, fourth}
            if corner == min(used) and len(used) == 4 and _is_rectangle(apart, corner, one, other, fourth):
                found.append((apart[corner, one] * apart[corner, other], (corner, one, other), used))
    taken: set[int] = set()
    chosen = []
    for _, corners, used in sorted(found, key=lambda each: each[:2]):
        if not taken & used:
            taken |= used
            chosen.append(legs[list(corners)])
    return chosen


def _is_rectangle(apart: NDArray[np.float64], corner: int, one: int, other: int, fourth: int) -> bool:
    """Whether opposite sides are as long as each other, and both diagonals."""
    sides = apart[corner, one], apart[corner, other]
    opposite = apart[other, fourth], apart[one, fourth]
    diagonals = apart[one, other], apart[corner, fourth]
    pairs = (*zip(sides, opposite, strict=True), diagonals, (diagonals[0], math.hypot(*sides)))
    return all(abs(a - b) <= _OFF_M for a, b in pairs)
