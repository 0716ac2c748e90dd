"""Legs in a laser scan: where somebody goes on who left the camera's view."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import Costmap, moved_points
from florence_bt.skills.navigation.navigate.moving_target import CAMERA_GAP_S, MovingTarget
from florence_bt.skills.navigation.navigate.state import Costmaps

REACH_M = 0.4
"""Legs are this near to where they are expected (REFERENCE 12.7)."""
_WIDEST_M = 0.6
"""What is wider is not a pair of legs (REFERENCE 12.7)."""
_FEWEST_POINTS = 3
_LEG_RADIUS_M = 0.06
"""The laser sees the front of the legs; the middle of the person is this much behind it. Chosen."""
_GAP_M = 0.15
"""Points of a scan that are further apart belong to different things."""
_MAP_MARGIN_CELLS = 2
LEGS_ALONE_S = 6.0
"""Legs alone are gone on with for no longer than this since the camera saw the person."""


class MapDifference:
    """Tells what the laser sees and the map does not know.

    Args:
        costmaps: What the map knows.

    Source:
        REFERENCE 12.7; document, section 4.3.
    """

    def __init__(self, costmaps: Costmaps) -> None:
        self._costmap: Costmap = costmaps.global_costmap
        known = binary_dilation(costmaps.static == LETHAL, iterations=_MAP_MARGIN_CELLS)
        self._known = known.astype(np.uint8)

    def unknown(self, points: NDArray[np.float64], map_from_odom: Pose2) -> NDArray[np.float64]:
        """Return the points that belong to nothing on the map.

        Args:
            points: Where the beams end, in the order of the scan, shape (n, 2), odometry frame, metres.
            map_from_odom: The place of the odometry frame in the map.
        """
        return points[~self.is_known(moved_points(points, map_from_odom))]

    def is_known(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points (map frame) belong to something on the map or lie outside it; shape (n,)."""
        return self._costmap.costs_at(points, self._known) > 0


def legs_near(points: NDArray[np.float64], robot: Pose2, expected: tuple[float, float]) -> Point2 | None:
    """Return where somebody is whose legs are expected at a place, or None.

    Args:
        points: What may be legs, shape (n, 2), metres.
        robot: The robot, in the same frame.
        expected: Where the person should be.
    """
    near = points[np.hypot(points[:, 0] - expected[0], points[:, 1] - expected[1]) <= REACH_M]
    if len(near) < _FEWEST_POINTS or np.ptp(near, axis=0).max() > _WIDEST_M:
        return None
    x, y = near.mean(axis=0)
    away = max(float(np.hypot(x - robot.x, y - robot.y)), _LEG_RADIUS_M)
    behind = 1.0 + _LEG_RADIUS_M / away
    return float(robot.x + (x - robot.x) * behind), float(robot.y + (y - robot.y) * behind)


def go_on_with_legs(
    target: MovingTarget, stamp: float, points: NDArray[np.float64], robot: Pose2, coast: float
) -> None:
    """Take the legs of somebody whom the camera has seen, and does not see any more.

    Args:
        target: The person; unchanged when no legs are where they should be.
        stamp: Of the scan, seconds.
        points: What the map does not know, shape (n, 2), odometry frame, metres.
        robot: The robot in that frame at that time.
        coast: After so many seconds without a sight the person may be anywhere.
    """
    if target.seen is None or target.recognised is None or stamp - target.recognised < CAMERA_GAP_S:
        return
    if stamp - target.recognised > LEGS_ALONE_S or stamp - target.seen > coast:
        return
    legs = legs_near(points, robot, target.at(stamp, coast))
    if legs is not None:
        target.saw(stamp, *legs)


def all_legs(points: NDArray[np.float64]) -> list[Point2]:
    """Return everything that may be one leg or two: the middles, metres. Points as of :func:`legs_near`."""
    return [(float(group[:, 0].mean()), float(group[:, 1].mean())) for group in _narrow_clusters(points)]


def of_nobody_known(legs: Sequence[Point2], others: Sequence[Point2]) -> list[Point2]:
    """Return the legs without those of others whom the camera sees; all in one frame, metres."""
    return [each for each in legs if all(math.dist(each, who) > REACH_M for who in others)]


def narrow_things(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of a scan that may belong to legs: those of clusters that are narrow enough.

    Args:
        points: Where the beams end, in the order of the scan, shape (n, 2), metres.

    Returns:
        Shape (m, 2), m <= n.
    """
    return np.concatenate([np.empty((0, 2)), *_narrow_clusters(points)])


def _narrow_clusters(points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    if not len(points):
        return []
    gaps = np.hypot(*np.diff(points, axis=0).T) > _GAP_M
    groups = np.split(points, np.flatnonzero(gaps) + 1)
    return [
        group for group in groups if len(group) >= _FEWEST_POINTS and np.ptp(group, axis=0).max() <= _WIDEST_M
    ]
