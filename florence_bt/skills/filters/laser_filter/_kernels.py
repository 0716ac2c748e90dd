"""The one loop of the laser filter. Arrays in, arrays out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def filter_ranges(
    ranges: NDArray[np.float32],
    codes: np.float32,
    low: np.float32,
    high: np.float32,
    radius: np.float32,
    far: np.float32,
    legacy: bool,
) -> NDArray[np.float32]:
    """Make beams that met nothing far ones, and take out what the robot's own structure reflects.

    Args:
        ranges: Shape (n,), metres.
        codes: Ranges from zero up to this are error codes of the laser, which count as out of range.
        low: Ranges up to this are no measurements.
        high: This range, and infinity, mean that nothing is within range; between them is no measurement.
        radius: What is nearer is the robot's own structure.
        far: What a beam out of range reads.
        legacy: Whether the structure's hits become far beams, too, in place of NaN.

    Returns:
        Shape (n,), NaN where nothing was measured.
    """
    filtered = np.empty(len(ranges), np.float32)
    for k in range(len(ranges)):
        value = ranges[k]
        if legacy:
            value = np.float32(0.0) if value < radius else value
            filtered[k] = far if value >= high or value <= low else value
        elif value == np.inf or value == high or 0.0 <= value <= min(codes, low):
            filtered[k] = far
        else:
            filtered[k] = value if low < value < high and value >= radius else np.nan
    return filtered
