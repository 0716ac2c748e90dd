"""The way just driven: the floor that the robot may back over without seeing it."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.skills.navigation.navigate.costmap import moved_points
from florence_bt.skills.robot_description.footprint import Footprint

_STEP_M, _STEP_RAD, _POSES = 0.03, 0.1, 100
"""Each pose that is kept is so far from the one before; so many are kept: 3 m of way, some turns less."""
_BESIDE_M = 0.05
"""So far beyond where it was the robot may get: the travel of a bumper, and back from an arc."""
_LOOKS_M = 0.02
_ROOM_M = 0.3
"""So much behind it counts as driven when the robot is switched on. Chosen: twice what a recovery backs."""
_AIM_M, _BEND = 0.1, 5.0
"""It steers to where it was so far behind, on an arc of no more than this curvature, metres and 1/m."""
_MOVES_M, _TURNS_RAD = 0.001, 0.01
"""From one scan to the next; less is none."""


class DrivenWay:
    """The poses of the last metres, in the odometry frame.

    Args:
        footprint: The outline of the robot, without padding.
    """

    def __init__(self, footprint: Footprint) -> None:
        corners = footprint.corner_array()
        self._rear = corners[corners[:, 0] < corners[:, 0].min() + _LOOKS_M]
        self._covered = Footprint.from_corners(corners.tolist(), _BESIDE_M).corner_array()
        self._poses: deque[Pose2] = deque(maxlen=_POSES)
        self._before: Pose2 | None = None

    def saw(self, pose: Pose2) -> None:
        """Note where the robot is; what it backs over gives no leave to back on."""
        before, self._before = self._before, pose
        if before is None:
            # Whoever set it down or docked it left it room: it backs off a dock on which it is switched on.
            self._poses.extend(
                pose @ Pose2(-float(way), 0.0) for way in np.arange(0.0, _ROOM_M, _STEP_M)[::-1]
            )
            return
        ahead, _ = before.inverse().apply(pose.x, pose.y)
        if ahead < _MOVES_M and (
            ahead < -_MOVES_M or abs(angle_difference(before.yaw, pose.yaw)) < _TURNS_RAD
        ):
            return
        last = self._poses[-1]
        turned = abs(angle_difference(last.yaw, pose.yaw)) >= _STEP_RAD
        if turned or last.distance_to(pose) >= _STEP_M:
            self._poses.append(pose)

    def curvature(self, robot: Pose2) -> float:
        """Return the curvature, 1/m, of the arc that leads back to where it came from; 0 is straight."""
        for pose in reversed(self._poses):
            x, y = robot.inverse().apply(pose.x, pose.y)
            if x <= -_AIM_M:
                bend = 2.0 * y / (x * x + y * y)
                return float(max(-_BEND, min(_BEND, bend)))
        return 0.0

    def covers(self, robot: Pose2, back: float) -> bool:
        """Tell whether the robot was where its rear gets when it backs straight, metres."""
        return bool(self._was_at(robot, _steps(back)).all())

    def way_back(self, robot: Pose2, most: float) -> float:
        """Return how far the robot can back straight over floor where it was, up to ``most``; metres."""
        steps = _steps(most)
        was_there = self._was_at(robot, steps)
        return most if was_there.all() else float(steps[max(0, int(np.argmin(was_there)) - 1)])

    def _was_at(self, robot: Pose2, steps: np.ndarray) -> np.ndarray:
        """Tell for each step back, shape (n,), metres, whether the robot was where its rear gets by it."""
        rear = np.concatenate([self._rear - (step, 0.0) for step in steps])
        points = moved_points(rear, robot)
        was_there = np.zeros(len(points), np.bool_)
        for pose in self._poses:
            was_there |= _inside(moved_points(points, pose.inverse()), self._covered)
        everywhere: np.ndarray = np.logical_and.reduce(was_there.reshape(len(steps), -1), axis=1)
        return everywhere


def _steps(back: float) -> np.ndarray:
    return np.linspace(0.0, back, 1 + math.ceil(back / _LOOKS_M))


def _inside(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Tell which points, shape (n, 2), lie in a convex polygon, shape (m, 2)."""
    edges = np.roll(corners, -1, axis=0) - corners
    away = points[:, None, :] - corners[None, :, :]
    sides = edges[None, :, 0] * away[:, :, 1] - edges[None, :, 1] * away[:, :, 0]
    inside: np.ndarray = (sides >= 0.0).all(axis=1) | (sides <= 0.0).all(axis=1)
    return inside
