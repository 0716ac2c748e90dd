"""Known obstacles in a picture or a scan: whatever stands where the map has a wall is the wall.

Whoever seems to stand behind the walls, where the map knows nothing, may be a reflection in a mirror.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OCCUPIED, LaserScan, OccupancyGrid
from florence_bt.core.table_legs import with_tables
from florence_bt.core.transforms import Transform3

_MARGIN_CELLS, _CROSS = 2, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
"""Cells around something of the map within which things may be that."""
_FAR_M = 1e-3
"""A beam that is so much shorter than the longest, and longer, met nothing (REFERENCE 6.4)."""
SMALLEST_PIECE = 0.2
"""Metres; smaller occupied pieces are the legs of tables and chairs, beside which people stand and sit."""


class KnownObstacles:
    """The distance from any point to the nearest wall or larger piece of furniture of a map.

    Args:
        grid: The map; unknown cells count as free.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        occupied = (grid.cells > OCCUPIED // 2).astype(np.uint8)
        _, labels, stats, _ = cv2.connectedComponentsWithStats(occupied, connectivity=8)
        extent = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1) * grid.resolution
        large = (extent >= SMALLEST_PIECE)[labels] & (occupied > 0)
        if large.any():
            free = (~large).astype(np.uint8)
            self._distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * grid.resolution
        else:
            self._distance = np.full(occupied.shape, np.inf, np.float32)
        mapped = (with_tables(grid).cells > OCCUPIED // 2).astype(np.float32)
        self._mapped: NDArray[np.float32] = cv2.dilate(mapped, _CROSS, iterations=_MARGIN_CELLS).astype(
            np.float32
        )
        unknown = (grid.cells < 0).astype(np.uint8)
        self._depth = cv2.distanceTransform(unknown, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * grid.resolution

    def distance_to(
        self, x: NDArray[np.float64], y: NDArray[np.float64], robot: Pose2
    ) -> NDArray[np.float32]:
        """Return the distance of points to the nearest of the obstacles.

        Args:
            x: Shape (n,), metres, robot frame.
            y: Shape (n,), metres, robot frame.
            robot: The robot frame in the map frame.

        Returns:
            Shape (n,), metres; infinite outside of the map.
        """
        return self._values(self._distance, x, y, robot)

    def unmapped_ends(
        self, scan: LaserScan, sensor_in_frame: Transform3, frame: Pose2
    ) -> NDArray[np.float64]:
        """Return where beams end at nothing of the map, in the order of the scan.

        Args:
            scan: Any scan.
            sensor_in_frame: The sensor in a frame of the floor.
            frame: This frame in the map frame.

        Returns:
            Shape (n, 2), metres, in that frame.
        """
        ends = beam_ends(scan, sensor_in_frame, scan.range_min, scan.range_max - _FAR_M)
        return ends[self._values(self._mapped, ends[:, 0], ends[:, 1], frame) == 0.0]

    def depth_in_unknown(self, x: float, y: float, robot: Pose2) -> float:
        """Return how far a point is from everything that the map knows, metres; infinite outside of the map.

        Args:
            x: Metres, robot frame.
            y: Metres, robot frame.
            robot: The robot frame in the map frame.
        """
        return float(self._values(self._depth, np.array([x]), np.array([y]), robot)[0])

    def _values(
        self, of: NDArray[np.float32], x: NDArray[np.float64], y: NDArray[np.float64], robot: Pose2
    ) -> NDArray[np.float32]:
        """Return the values of the cells in which points lie; infinite outside of the map."""
        c, s = np.cos(robot.yaw), np.sin(robot.yaw)
        column = np.floor((robot.x + c * x - s * y - self._grid.origin.x) / self._grid.resolution).astype(int)
        row = np.floor((robot.y + s * x + c * y - self._grid.origin.y) / self._grid.resolution).astype(int)
        rows, columns = of.shape
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        values = np.full(len(x), np.inf, np.float32)
        values[inside] = of[row[inside], column[inside]]
        return values
