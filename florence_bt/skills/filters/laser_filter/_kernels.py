"""The one loop of the laser filter. Arrays in, arrays out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def filter_ranges(
    ranges: NDArray[np.float32],
    low: np.float32,
    high: np.float32,
    radius: np.float32,
    far: np.float32,
    legacy: bool,
) -> NDArray[np.float32]:
    """Make beams that met nothing far ones, and take out what the robot's own structure reflects.

    Args:
        ranges: Shape (n,), metres.
        low: Ranges up to this are out of range.
        high: Ranges from this on are out of range.
        radius: What is nearer is the robot's own structure.
        far: What a beam out of range reads.
        legacy: Whether the structure's hits become far beams, too, in place of NaN.

    Returns:
        Shape (n,); NaN stays NaN.
    """
    filtered = np.empty(len(ranges), np.float32)
    for k in range(len(ranges)):
        value = np.float32(0.0) if legacy and ranges[k] < radius else ranges[k]
        outside = value >= high or value <= low
        if not legacy and (value == -np.inf or (not outside and value < radius)):
            filtered[k] = np.nan
        else:
            filtered[k] = far if outside else value
    return filtered
