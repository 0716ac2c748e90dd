"""The one hot loop of the fake laser. Arrays in, arrays out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def nearest_per_column(
    depth: NDArray[np.float32],
    rise_per_metre: NDArray[np.float64],
    nearest_allowed: NDArray[np.float64],
    min_height: float,
    max_height: float,
    nearest: NDArray[np.float64],
    seen: NDArray[np.bool_],
) -> None:
    """Find the smallest depth of every column among the points of a height band.

    All pixels of a column lie in one vertical plane through the camera, so they share one bearing, and the
    nearest of them in depth is also the nearest in range.

    Args:
        depth: Shape (height, width), metres along the optical axis; NaN where nothing was measured.
        rise_per_metre: Shape (height,), height above the optical axis of a point of each row at depth 1.
        nearest_allowed: Shape (width,), smallest depth that counts, above zero.
        min_height: Lower edge of the band in metres above the optical axis, inclusive.
        max_height: Upper edge, inclusive.
        nearest: Shape (width,), filled with the smallest depth, +inf where there is none.
        seen: Shape (width,), filled with whether anything at all was measured in the column.
    """
    nearest[:] = np.inf
    seen[:] = False
    rows, columns = depth.shape
    for v in range(rows):
        rise = rise_per_metre[v]
        for u in range(columns):
            z = depth[v, u]
            # Every comparison with NaN is false, so a hole in the picture passes none of these tests.
            if z > 0.0 and z < np.inf:
                seen[u] = True
                height = rise * z
                if min_height <= height <= max_height and nearest_allowed[u] <= z < nearest[u]:
                    nearest[u] = z
