"""The hot loops of the fake lasers. Arrays in, arrays out."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Ranges = NDArray[np.float32]


@njit(cache=True)
def nearest_per_beam(
    depth: NDArray[np.float32],
    rise_per_metre: NDArray[np.float64],
    range_per_metre: NDArray[np.float64],
    nearest_allowed: NDArray[np.float64],
    beams: NDArray[np.int64],
    band: tuple[float, float],
    unseen_as_nan: bool,
    ranges: NDArray[np.float64],
) -> Ranges:
    """Find the smallest range in every direction among the points of a height band.

    All pixels of a column lie in one vertical plane through the camera, so they share one bearing, and the
    nearest of them in depth is also the nearest in range.

    Args:
        depth: Shape (height, width), metres along the optical axis; NaN where nothing was measured.
        rise_per_metre: Shape (height,), height above the optical axis of a point of each row at depth 1.
        range_per_metre: Shape (width,), range of a point of each column at depth 1.
        nearest_allowed: Shape (width,), smallest depth that counts, above zero.
        beams: Shape (width,), the beam that each column falls into, -1 for none.
        band: Lower and upper edge of the band in metres above the optical axis, inclusive.
        unseen_as_nan: Whether a beam reads NaN in whose columns nothing at all was measured.
        ranges: Shape (n,), what each beam reads in which nothing is nearer, metres; is lowered.

    Returns:
        Shape (n,), metres.
    """
    lowest, highest = band
    rows, columns = depth.shape
    nearest, seen = np.full(columns, np.inf), np.zeros(columns, np.bool_)
    for v in range(rows):
        rise = rise_per_metre[v]
        for u in range(columns):  # without branches, so that many pixels are computed at once
            z = float(depth[v, u])
            height = rise * z
            # Every comparison with NaN is false, so a hole in the picture passes none of these tests.
            measured = (z > 0.0) & (z < np.inf)
            seen[u] |= measured
            counts = measured & (lowest <= height) & (height <= highest) & (nearest_allowed[u] <= z)
            nearest[u] = z if counts & (z < nearest[u]) else nearest[u]
    beam_seen = np.zeros(len(ranges), np.bool_)
    for u in range(columns):
        if beams[u] >= 0:
            beam_seen[beams[u]] |= seen[u]
            ranges[beams[u]] = min(ranges[beams[u]], nearest[u] * range_per_metre[u])
    for k in range(len(ranges)):
        if unseen_as_nan and not beam_seen[k]:
            ranges[k] = np.nan
    return ranges.astype(np.float32)


@njit(cache=True)
def without_feet(low: Ranges, tall: Ranges, beside: int, most: float, apart: float) -> Ranges:
    """Leave out what is low and just before something tall, or beside that: it is its foot.

    Args:
        low: Shape (n,), ranges of what is low, NaN where it would not be seen; metres.
        tall: Shape (n,), ranges of what is tall.
        beside: So many beams to each side count as beside.
        most: From this range on nothing is low.
        apart: How near to something tall its foot is, metres.

    Returns:
        Shape (n,), NaN where a foot is left out.
    """
    kept = np.empty(len(low), np.float32)
    for k in range(len(low)):
        nearest = np.float32(np.inf)
        for i in range(max(0, k - beside), min(len(tall), k + beside + 1)):
            if tall[i] < nearest:  # not NaN
                nearest = tall[i]
        foot = min(low[k], np.float32(most)) > nearest - np.float32(apart)
        kept[k] = np.float32(np.nan) if foot else low[k]
    return kept


@njit(cache=True)
def what_hangs_over(above: Ranges, below: Ranges, nearest: float, apart: float) -> Ranges:
    """Keep what is nearer above than below.

    Args:
        above: Shape (n,), ranges of what is high, NaN where nothing was measured; metres.
        below: Shape (n,), ranges of what is below that.
        nearest: What is nearer may be above the picture, metres.
        apart: How much nearer than everything below an overhang is, metres.

    Returns:
        Shape (n,), NaN where an overhang may be too near to be seen, infinity where there is none.
    """
    kept = np.empty(len(above), np.float32)
    for k in range(len(above)):
        if math.isnan(above[k]) or above[k] < np.float32(nearest):
            kept[k] = np.nan
        else:
            kept[k] = above[k] if above[k] < below[k] - np.float32(apart) else np.float32(np.inf)
    return kept
