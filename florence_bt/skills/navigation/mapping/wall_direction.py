"""The direction of a map's walls, and the map turned so that they run along its axes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OCCUPIED, OccupancyGrid

_MOST_POINTS = 20_000
"""More cells tell nothing new."""
_STEPS_RAD = (math.radians(1.0), math.radians(0.05))
_SMOOTH = (0.25, 0.5, 0.25)
"""Weights of a cell and its neighbours in a profile. Chosen."""
_REFINED_RAD = math.radians(1.0)


def wall_direction(grid: OccupancyGrid) -> float:
    """Return the direction in which most walls run, or stand across, to 0.05 degrees.

    Seen along a wall its cells lie in one column: the direction is the one in which the occupied cells crowd
    in the fewest columns and rows.

    Returns:
        Radians from the x axis of the map, more than -pi/4 and at most pi/4; 0 for a map without walls.
    """
    from scipy import ndimage

    walls = grid.cells > OCCUPIED // 2
    row, column = np.nonzero(walls & ~ndimage.binary_erosion(walls))
    every = -(-len(row) // _MOST_POINTS)
    if not every:
        return 0.0
    points = np.stack([column, row], axis=1)[::every].astype(float)
    points -= points.mean(axis=0)
    coarse, fine = _STEPS_RAD
    best = _best(points, np.arange(math.pi / 4, -math.pi / 4, -coarse))
    best = _best(points, best + np.arange(-_REFINED_RAD, _REFINED_RAD + fine / 2, fine))
    best = math.remainder(best, math.pi / 2)
    return best + grid.origin.yaw


def _best(points: NDArray[np.float64], angles: NDArray[np.float64]) -> float:
    return float(angles[int(np.argmax([_crowding(points, angle) for angle in angles]))])


def _crowding(points: NDArray[np.float64], angle: float) -> float:
    """Return how crowded the rows and columns of a turned grid are: the sum of the squares of their cells."""
    c, s = math.cos(angle), math.sin(angle)
    total = 0.0
    for along in (points @ (c, s), points @ (-s, c)):
        # A point counts in the columns beside it, too: the grid itself would be seen otherwise.
        place, share = np.divmod(along - along.min(), 1.0)
        left = np.bincount(place.astype(int), 1.0 - share, minlength=int(place.max()) + 2)
        right = np.bincount(place.astype(int) + 1, share, minlength=len(left))
        total += float((np.convolve(left + right, _SMOOTH) ** 2).sum())
    return total


def turned(grid: OccupancyGrid, angle: float) -> OccupancyGrid:
    """Return a map turned about the origin of its frame; no occupied cell is lost.

    Args:
        grid: The map.
        angle: Radians, counter-clockwise.
    """
    x, y = Pose2(0.0, 0.0, angle).apply(grid.origin.x, grid.origin.y)
    yaw = math.remainder(grid.origin.yaw + angle, math.tau)
    return OccupancyGrid(grid.resolution, Pose2(x, y, yaw), grid.cells).upright()
