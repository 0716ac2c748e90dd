"""Room to move: the robot's outline over the local costmap and over the walls of the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate._cell_kernels import Cells
from florence_bt.skills.navigation.navigate._rollout_kernels import count_touches, free_motion
from florence_bt.skills.navigation.navigate.costmap import Costmap

_STEP_M, _STEP_RAD = 0.025, 0.04
"""Steps of a motion that is tried. Chosen."""
_SECTOR_RAD = math.pi / 6.0


@dataclass(frozen=True, slots=True)
class MapWalls:
    """The walls of the map, for what the sensors cannot see: the laser is blind behind the robot.

    Attributes:
        cells: The static layer's costs.
        frame: origin_x, origin_y, resolution.
        outline: Points along the true footprint; the map is trusted less than the eyes, so no padding.
    """

    cells: Cells
    frame: NDArray[np.float64]
    outline: NDArray[np.float64]

    def touches(self, pose: Pose2) -> bool:
        """Tell whether the robot would stand in a wall (map frame)."""
        return _touches(self.cells, self.frame, pose, self.outline)

    def free_part(self, pose: Pose2, way: float, turn: float) -> float:
        """Return how much of a motion from a pose in the map frame is free, 0..1."""
        return _free_part(self.cells, self.frame, pose, way, turn, self.outline)


class Clearance:
    """Answers for one moment: the robot at a pose, among what the sensors see and the map knows."""

    def __init__(self, local: Costmap, pose: Pose2, walls: MapWalls | None, map_pose: Pose2 | None) -> None:
        self._local = local
        self._pose = pose
        self._walls = walls
        self._map_pose = map_pose
        self._outline = local.footprint.outline(local.resolution / 2.0)

    @property
    def _frame(self) -> NDArray[np.float64]:
        return np.array([self._local.origin_x, self._local.origin_y, self._local.resolution])

    @property
    def is_wedged(self) -> bool:
        """Tell whether the robot, with its padding, stands in something already."""
        if _touches(self._local.master, self._frame, self._pose, self._outline):
            return True
        return self._walls is not None and self._map_pose is not None and self._walls.touches(self._map_pose)

    def free_part(self, way: float, turn: float) -> float:
        """Return how much of a motion is free, 0..1. A wedged robot may move where it gets in no deeper.

        Args:
            way: Metres along the heading, below zero backwards.
            turn: Radians, spread evenly over the way.
        """
        free = _free_part(self._local.master, self._frame, self._pose, way, turn, self._outline)
        if self._walls is not None and self._map_pose is not None:
            free = min(free, self._walls.free_part(self._map_pose, way, turn))
        return free

    def is_free(self, way: float, turn: float) -> bool:
        """Tell whether a whole motion is free."""
        return self.free_part(way, turn) >= 1.0


def _touches(cells: Cells, frame: NDArray[np.float64], pose: Pose2, outline: NDArray[np.float64]) -> bool:
    return bool(count_touches(cells, frame, pose.x, pose.y, pose.yaw, outline))


def _free_part(
    cells: Cells,
    frame: NDArray[np.float64],
    pose: Pose2,
    way: float,
    turn: float,
    outline: NDArray[np.float64],
) -> float:
    steps = max(1, math.ceil(max(abs(way) / _STEP_M, abs(turn) / _STEP_RAD)))
    start = np.array([pose.x, pose.y, pose.yaw])
    # Straight back only the rear can meet anything. The front sweeps over what the robot has touched, and
    # is marked under it: it would never get away from there.
    parts = _rear(outline) if way < 0.0 else []
    if way >= 0.0 or turn != 0.0:
        parts.append(outline)
    return min(float(free_motion(cells, frame, start, way, turn, steps, part)) for part in parts)


def _rear(outline: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return what leads on a way back, in sectors: a side that gets free gives no other leave to touch."""
    x, y = outline.T
    widest = np.abs(y) >= np.abs(y).max() - 1e-6
    rear = outline[x < x[widest].max()]
    sectors = np.floor(np.arctan2(rear[:, 1], -rear[:, 0]) / _SECTOR_RAD)
    return [rear[sectors == each] for each in np.unique(sectors)]
