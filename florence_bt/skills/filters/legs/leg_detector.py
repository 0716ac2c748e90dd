"""Detection of what may be legs in a laser scan."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2

REACH_M = 0.4
"""Legs are this near to where they are expected (REFERENCE 12.7)."""
_WIDEST_M = 0.6
"""Largest width of a pair of legs (REFERENCE 12.7)."""
_FEWEST_POINTS = 3
_LEG_RADIUS_M = 0.06
"""The laser sees the front of the legs; the middle of the person is this much behind it. Chosen."""
_GAP_M = 0.15
"""Points of a scan that are further apart belong to different things."""


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
