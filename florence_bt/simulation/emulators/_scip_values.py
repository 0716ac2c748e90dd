"""What the emulated scanner makes of distances: groups of steps, and intensities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def group(values: NDArray[np.int32], cluster: int, minimum_mm: int) -> NDArray[np.int32]:
    """The smallest valid value of each group; a group without one gives its smallest code.

    Args:
        values: Shape (n,), millimetres or error codes.
        cluster: Steps a group; 0 and 1 both mean one.
        minimum_mm: DMIN; smaller values are codes.

    Returns:
        Shape (ceil(n / cluster),).

    Source: REFERENCE 4.7.
    """
    if cluster <= 1:
        return values
    groups = np.pad(values, (0, -len(values) % cluster), mode="edge").reshape(-1, cluster)
    valid = groups >= minimum_mm
    best = np.where(valid, groups, np.iinfo(np.int32).max).min(axis=1)
    return np.where(valid.any(axis=1), best, groups.min(axis=1)).astype(np.int32)


def with_intensities(values: NDArray[np.int32], minimum_mm: int) -> NDArray[np.int32]:
    """Each distance followed by an intensity, as ME and GE send them.

    No manual tells the scale. Here a white wall at 1 m gives 4000, falling with the distance; a step without
    a distance gives 0.

    Returns:
        Shape (2 n,).
    """
    pairs = np.zeros((len(values), 2), np.int32)
    pairs[:, 0] = values
    valid = values >= minimum_mm
    pairs[valid, 1] = np.minimum(4_000_000 // np.maximum(values[valid], 1), 60_000)
    return pairs.reshape(-1)
