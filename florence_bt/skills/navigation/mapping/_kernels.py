"""The hot loop of drawing a map. Plain arrays in and out."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def draw_beams(
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    marks: NDArray[np.int32],
    mark: int,
    start_u: float,
    start_v: float,
    ends: NDArray[np.float64],
    met: NDArray[np.bool_],
    longest: float,
) -> None:
    """Count, for each cell, that a scan has seen a surface there, or has looked through it; once a scan.

    A cell where one beam ended is not counted as free because another one grazed it.

    Args:
        hits: Shape (rows, columns), scans with a beam that ended in the cell.
        passes: Shape (rows, columns), scans with beams that went on through it.
        marks: Shape (rows, columns): which scan counted the cell last.
        mark: The number of this scan, above those of earlier ones.
        start_u: Where the beams start, in columns.
        start_v: In rows.
        ends: Shape (n, 2), columns and rows where they end.
        met: Shape (n,), whether something is there.
        longest: They count up to here, cells.
    """
    rows, columns = hits.shape
    for k in range(len(ends)):
        u, v = ends[k, 0], ends[k, 1]
        column, row = math.floor(u), math.floor(v)
        if not met[k] or math.hypot(u - start_u, v - start_v) > longest:
            continue
        if 0 <= row < rows and 0 <= column < columns and marks[row, column] != mark:
            marks[row, column] = mark
            hits[row, column] += 1
    for k in range(len(ends)):
        along_u, along_v = ends[k, 0] - start_u, ends[k, 1] - start_v
        length = math.hypot(along_u, along_v)
        # The last cell before a surface may be half of it.
        reach = min(longest, length - 1.0 if met[k] else length)
        steps = math.ceil(2.0 * reach)
        for step in range(steps):
            share = 0.5 * step / length
            column, row = math.floor(start_u + share * along_u), math.floor(start_v + share * along_v)
            if 0 <= row < rows and 0 <= column < columns and marks[row, column] != mark:
                marks[row, column] = mark
                passes[row, column] += 1
