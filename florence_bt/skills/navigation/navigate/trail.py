"""The way on which the robot came, to go back on it: behind itself it sees nothing."""

from __future__ import annotations

import math
from collections import deque

from florence_bt.core.geometry import Point2, Pose2, Twist2, normalize_angle

_STEP_M, _POINTS = 0.1, 50
"""A point is at least so far from the next, and so many are remembered."""
_TO_M = 0.3
"""The robot steers towards a point so far behind its middle."""


class Trail:
    """Remembers where the robot drove forward; places are in the odometry frame, metres."""

    def __init__(self) -> None:
        self._points: deque[Point2] = deque(maxlen=_POINTS)

    def remember(self, pose: Pose2, twist: Twist2) -> None:
        """Take the robot's place and velocity of a cycle."""
        here = pose.x, pose.y
        if twist.linear > 0.0 and (not self._points or math.dist(self._points[-1], here) >= _STEP_M):
            self._points.append(here)

    def turn_back(self, pose: Pose2) -> float | None:
        """Forget what the robot has gone back to, and return by how much it has to turn to back on.

        Returns:
            Radians, 0 straight back; None where nothing is left of the way.
        """
        while self._points and math.dist(self._points[-1], (pose.x, pose.y)) < _TO_M:
            self._points.pop()
        return normalize_angle(pose.bearing_to(*self._points[-1]) + math.pi) if self._points else None
