"""Which cells of a grid a solid covers, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_SAMPLES = 5
"""A cell's coverage is measured at this many points squared."""


@njit(cache=True)
def cover(
    grid: NDArray[np.bool_],
    corner: tuple[float, float, float],
    cells: tuple[int, int, int, int],
    place: tuple[float, float],
    half: tuple[float, float],
    turn: tuple[float, float],
    radius: float,
    share: float,
) -> None:
    """Mark the cells that a box or a cylinder stands on, seen from above.

    Args:
        grid: Shape (rows, columns); is marked.
        corner: x and y of the outer corner of cell [0, 0], and metres per cell.
        cells: First and end row, first and end column of what is looked at.
        place: x and y of the solid's middle, metres.
        half: Half sides of a box, metres; 0 for a cylinder.
        turn: Cosine and sine of the solid's yaw.
        radius: Of a cylinder, metres; 0 for a box.
        share: A cell counts when the solid covers at least this part of it.
    """
    left, low, resolution = corner
    cosine, sine = turn
    for row in range(cells[0], cells[1]):
        for column in range(cells[2], cells[3]):
            inside = 0
            for i in range(_SAMPLES):
                dy = low + (row + (i + 0.5) / _SAMPLES) * resolution - place[1]
                for j in range(_SAMPLES):
                    dx = left + (column + (j + 0.5) / _SAMPLES) * resolution - place[0]
                    if radius > 0.0:
                        inside += dx * dx + dy * dy <= radius**2
                    else:
                        inside += (
                            abs(cosine * dx + sine * dy) <= half[0]
                            and abs(cosine * dy - sine * dx) <= half[1]
                        )
            if inside / _SAMPLES**2 >= share:
                grid[row, column] = True
