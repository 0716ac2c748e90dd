"""Panes of glass while a map grows: the laser ends at one only where it meets it at a right angle, and looks
through it from everywhere else, so that the map shows free floor there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, OccupancyGrid

_REACH_M = 2.5
"""Farther ends of beams say less of a place."""
_STEP_M, _STEP_RAD = 0.1, 0.1
"""A scan counts once the robot has moved so far since the last one that did."""
_OFTEN = 2
"""In so many scans something was there."""
_WALL_CELLS = 2
"""Distance from an obstacle of the map within which a mark is that obstacle."""
_KEPT_S = 300.0
"""Somebody who stood there may have gone by then; before glass that is still there it is seen again."""


class GlassMemory:
    """Remembers where beams ended that the map shows as free floor."""

    def __init__(self) -> None:
        self._ends: list[tuple[float, NDArray[np.float64]]] = []
        self._counted: Pose2 | None = None

    def forget(self) -> None:
        """Forget everything: the robot is elsewhere than it was believed to be, and so is what it saw."""
        self._ends.clear()
        self._counted = None

    def saw(self, stamp: float, ends: NDArray[np.float64], robot: Pose2) -> None:
        """Take the ends of a scan that belong to nothing on the map.

        Args:
            stamp: Seconds.
            ends: Shape (n, 2), map frame, metres.
            robot: base_footprint in the map.
        """
        last = self._counted
        if last is not None and not _moved(last, robot):
            return
        self._counted = robot
        near = np.hypot(ends[:, 0] - robot.x, ends[:, 1] - robot.y) < _REACH_M
        self._ends = [each for each in self._ends if 0.0 <= stamp - each[0] < _KEPT_S]
        self._ends.append((stamp, ends[near]))

    def added_to(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return a map in which what seems to be glass is occupied."""
        rows, columns = grid.cells.shape
        count = np.zeros((rows, columns), np.uint16)
        for _, ends in self._ends:
            u = np.floor((ends[:, 0] - grid.origin.x) / grid.resolution).astype(int)
            v = np.floor((ends[:, 1] - grid.origin.y) / grid.resolution).astype(int)
            inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
            seen = np.unique(v[inside] * columns + u[inside])
            count.flat[seen] += 1
        walls = ndimage.binary_dilation(grid.cells > OCCUPIED // 2, iterations=_WALL_CELLS)
        glass = (count >= _OFTEN) & (grid.cells == FREE) & ~walls
        return OccupancyGrid(grid.resolution, grid.origin, np.where(glass, np.int8(OCCUPIED), grid.cells))


def _moved(start: Pose2, end: Pose2) -> bool:
    turned = abs(math.remainder(end.yaw - start.yaw, math.tau))
    return start.distance_to(end) >= _STEP_M or turned >= _STEP_RAD
