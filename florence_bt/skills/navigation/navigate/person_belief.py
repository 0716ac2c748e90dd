"""The belief where somebody may be who walked out of sight, and the places to look for them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL
from florence_bt.skills.navigation.navigate.planner import ways_from
from florence_bt.skills.navigation.navigate.state import Costmaps

_SEEN_WHOLE_RAD = 0.42
"""Half the breadth of the camera's view in which somebody is seen whole; chosen, of 28.5 degrees (document,
section 3.7.3)."""
_NEAREST_M, _FARTHEST_M = 0.5, 3.2
"""Between these distances the camera sees that nobody is there."""
_RAYS, _STEP_M = 120, 0.1
_ANGLES = np.linspace(-math.pi, math.pi, _RAYS, endpoint=False)
_DISTANCES = np.arange(_STEP_M, _FARTHEST_M, _STEP_M)
"""Looking round: directions from the robot's heading, and steps along them."""
_SLOWEST_MPS, _BRISK_MPS = 0.25, 1.0
"""Between these somebody who left goes on, whatever their last speed seemed to be. Chosen."""
_WALKING_MPS, _TURNED = 0.1, 0.2
"""Probability that somebody who walked turns back; slower than the speed, the direction means nothing."""
_SPREAD_M, _SPREAD_MPS = 0.7, 0.3
"""Error of the guess of the way they walked at first, and its growth each second."""
_FORGOTTEN_S = 40.0
"""Age at which a place that was seen empty says nothing any more. Longer than it takes to look elsewhere:
with 12 s a search went to and fro between two places."""
_LASER_RAD, _LEGLESS = 2.0, 0.3
"""Half the view of the laser, and how likely they are where it sees no legs: it sees them not everywhere."""
_LEGS_M, _LEGS_COUNT = 0.4, 8.0
"""They are the more likely to be so near to something like legs."""
_WAY_M = 4.0
"""A place so much further to drive to is a third as good."""
_ROUND_M, _HERE_M = 1.0, 0.8
"""A place counts with what is round it so far; at one so near the robot is already."""


class PersonBelief:
    """The likelihood of somebody being in each cell of the map, from when they vanished on.

    They walk on about as fast as before, round the walls, and are not where the robot has looked since.
    All places are in the map frame.

    Args:
        costmaps: What the map knows.
        place: Where they vanished, metres.
        velocity: How they walked, m/s.
        now: When, seconds.
    """

    def __init__(self, costmaps: Costmaps, place: Point2, velocity: Point2, now: float) -> None:
        costmap = self._costmap = costmaps.global_costmap
        self._walls = costmaps.static == LETHAL
        rows, columns = costmap.shape
        self._floor = costmaps.static < INSCRIBED
        self._x = costmap.origin_x + (np.arange(columns) + 0.5) * costmap.resolution
        self._y = costmap.origin_y + (np.arange(rows) + 0.5) * costmap.resolution
        self._away = self._ways_from(place)
        speed = math.hypot(*velocity)
        self._speed = min(_BRISK_MPS, max(_SLOWEST_MPS, speed))
        self._ahead = self._how_far_ahead(place, velocity) if speed >= _WALKING_MPS else np.ones(1)
        self._since = self._updated = now
        self._open, self._shut = np.ones((rows, columns)), np.zeros((rows, columns), bool)
        self._likely, self._all = np.zeros((rows, columns)), 0.0

    def update(self, now: float, robot: Pose2, legs: list[Point2]) -> None:
        """Take what the robot sees now: nobody in view, and perhaps something like legs.

        Args:
            now: Seconds.
            robot: The robot.
            legs: Where something like legs is.
        """
        at_legs = np.zeros(self._open.shape, bool)
        for x, y in legs:
            at_legs |= np.hypot(self._x[None, :] - x, self._y[:, None] - y) <= _LEGS_M
        rows, columns, seen = self._rays(robot)
        self._open = np.minimum(1.0, self._open + (now - self._updated) / _FORGOTTEN_S)
        laser = seen & (np.abs(_ANGLES) <= _LASER_RAD)[:, None] & ~at_legs[rows, columns]
        camera = seen & (np.abs(_ANGLES) <= _SEEN_WHOLE_RAD)[:, None] & (_DISTANCES >= _NEAREST_M)
        for inside, most in ((laser, _LEGLESS), (camera, 0.0)):
            cells = rows[inside], columns[inside]
            self._open[cells] = np.minimum(self._open[cells], most)
        unseen, self._updated = now - self._since, now
        error = np.abs(self._away - self._speed * unseen) / (_SPREAD_M + _SPREAD_MPS * unseen)
        walked = np.exp(-error) * (self._away <= _SPREAD_M + _BRISK_MPS * unseen)
        likely = walked * self._ahead * np.where(at_legs, _LEGS_COUNT, 1.0)
        self._likely, self._all = likely * self._open, float(likely.sum())

    def no_way_to(self, place: Point2) -> None:
        """Note that no way leads to a place: it is not proposed again, nor what is round it."""
        self._shut |= np.hypot(self._x[None, :] - place[0], self._y[:, None] - place[1]) <= _ROUND_M / 2.0

    def best_view(self, robot: Pose2) -> tuple[float, float]:
        """Return the heading (rad) that would bring most of what is likely into view, and its share, 0..1.

        The share is that of all places as they were before anybody looked.
        """
        rows, columns, seen = self._rays(robot)
        # Cells near the robot are met by more rays.
        cells = (_DISTANCES * math.tau / _RAYS * _STEP_M) / self._costmap.resolution**2
        inside = seen & (_DISTANCES >= _NEAREST_M)
        along = (self._likely[rows, columns] * inside * cells).sum(axis=1)
        half = round(_SEEN_WHOLE_RAD / math.tau * _RAYS)
        view = sum(np.roll(along, shift) for shift in range(-half, half + 1))
        best = int(np.argmax(view))
        share = min(1.0, float(view[best]) / self._all) if self._all > 0.0 else 0.0
        return float(robot.yaw + _ANGLES[best]), share

    def best_place(self, robot: Pose2) -> Point2 | None:
        """Return where to drive to: likely, and not far; None when they can be nowhere else than here."""
        ways = self._ways_from((robot.x, robot.y))
        round_it = uniform_filter(self._likely, round(_ROUND_M / self._costmap.resolution))
        worth = np.where((ways > _HERE_M) & ~self._shut, round_it * np.exp(-ways / _WAY_M), 0.0)
        row, column = np.unravel_index(int(np.argmax(worth)), worth.shape)
        if worth[row, column] <= 0.0:
            return None
        return float(self._x[column]), float(self._y[row])

    def _how_far_ahead(self, place: Point2, velocity: Point2) -> NDArray[np.float64]:
        """Rate the direction of each cell from a place by how likely somebody walks that way."""
        bearing = np.arctan2(self._y[:, None] - place[1], self._x[None, :] - place[0])
        turn: NDArray[np.float64] = np.cos(bearing - math.atan2(velocity[1], velocity[0]))
        return _TURNED + (1.0 - _TURNED) * (1.0 + turn) / 2.0

    def _ways_from(self, place: Point2) -> NDArray[np.float64]:
        """Return the metres from a place to each cell round the walls; infinite where no way leads."""
        rows, columns = np.nonzero(self._floor)
        start = int(np.argmin((self._x[columns] - place[0]) ** 2 + (self._y[rows] - place[1]) ** 2))
        return ways_from((int(rows[start]), int(columns[start])), self._floor, self._costmap.resolution)

    def _rays(self, robot: Pose2) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Return rows and columns of cells along rays all round, and which are in sight; (rays, steps)."""
        costmap = self._costmap
        x = robot.x + _DISTANCES * np.cos(robot.yaw + _ANGLES)[:, None]
        y = robot.y + _DISTANCES * np.sin(robot.yaw + _ANGLES)[:, None]
        columns = np.floor((x - costmap.origin_x) / costmap.resolution).astype(np.intp)
        rows = np.floor((y - costmap.origin_y) / costmap.resolution).astype(np.intp)
        inside = (rows >= 0) & (rows < len(self._y)) & (columns >= 0) & (columns < len(self._x))
        rows, columns = np.where(inside, rows, 0), np.where(inside, columns, 0)
        blocked = ~inside | self._walls[rows, columns]
        return rows, columns, ~np.logical_or.accumulate(blocked, axis=1)
