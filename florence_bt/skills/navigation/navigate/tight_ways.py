"""Ways along which the controller could not drive, though the planner had found them.

The planner takes the robot for a disc, the controller has its outline on other cells: they disagree about
gaps that are hardly wider than the robot. Such a stretch is closed for the planner until it is seen to be
wider.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.costmap import TIGHT, Costmap
from florence_bt.skills.navigation.navigate.planner import PlannerParameters, plan_path

_AHEAD_M = 0.8
"""So far ahead on the path the place is looked for where the outline touches something."""
_FRONT_M = 0.2
"""Nearer to the robot nothing is closed: it has to get away from there."""
_STRETCH_M = 0.3
"""So much of the path is closed: more than the robot may cross of what is too near when it sets off."""
_ASIDE_M = 0.5
"""The free width is measured so far to each side ..."""
_STEP_M = 0.025
"""Step across a way, in which the room beside it is measured. Chosen."""
_BESIDE_M = np.arange(_STEP_M / 2.0, _ASIDE_M, _STEP_M)
_ALONG_M = np.linspace(-0.2, 0.3, 11)
"""... where it is least along the robot, from its rear to before its front."""
_WIDER_M = 0.15
"""A place that has got so much wider is another one. Chosen: marks of a cell come and go on both sides."""
_SAME_M = 0.1
"""Gain in width on the map alone up to which a place is as narrow there: marks make walls a cell thicker on
each side."""


@dataclass(frozen=True, slots=True)
class TightPlace:
    """A place of the map that the robot did not get through.

    Attributes:
        pose: Where, along the path.
        width: The free width there, metres.
        on_map: Whether the map shows it as narrow: what stands there does not go away.
        since: When it was closed, seconds.
        points: Shape (n, 2), metres: what is closed.
    """

    pose: Pose2
    width: float
    on_map: bool
    since: float
    points: NDArray[np.float64]


class TightWays:
    """The ways that are closed in the global costmap, because the controller could not drive there.

    Args:
        costmap: The global costmap; the marks are in a layer of it.
    """

    def __init__(self, costmap: Costmap) -> None:
        self._costmap = costmap
        self._places: list[TightPlace] = []

    def close(
        self, path: NDArray[np.float64], robot: Pose2, local: Costmap, odom_from_map: Pose2, now: float
    ) -> bool:
        """Close the stretch of a path before the robot; False where that would close the goal as well.

        Args:
            path: Shape (n, 2), metres in the map frame, from the robot to the goal.
            robot: base_footprint in the map frame, which stands before something on the path.
            local: The local costmap, in the odometry frame.
            odom_from_map: Takes the path there.
            now: Seconds.
        """
        ahead = path[int(np.argmin(np.hypot(path[:, 0] - robot.x, path[:, 1] - robot.y))) :]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ahead, axis=0).T))])
        poses = [
            Pose2(float(x), float(y), float(np.arctan2(v - y, u - x)))
            for (x, y), (u, v) in itertools.pairwise(ahead)
        ]
        touching = (
            float(way)
            for way, pose in zip(along, poses, strict=False)
            if way <= _AHEAD_M and local.footprint_cost(odom_from_map @ pose) < 0
        )
        first = max(_FRONT_M, next(touching, _FRONT_M))
        if along[-1] < first + _STRETCH_M + _FRONT_M:
            return False
        pose = poses[int(np.argmax(along >= first))]
        width = _width(self._costmap, pose, of_map=False)
        on_map = _width(self._costmap, pose, of_map=True) <= width + _SAME_M
        points = ahead[(along >= first) & (along <= first + _STRETCH_M)]
        self._places.append(TightPlace(pose, width, on_map, now, points))
        self._costmap.mark(TIGHT, points, now)
        return True

    def look(self) -> None:
        """Open what is wider by now, or was cleared with everything else."""
        first = np.array([each.points[0] for each in self._places]).reshape(-1, 2)
        marked = self._costmap.marked_at(TIGHT, first)
        self._keep(
            [
                each
                for each, is_marked in zip(self._places, marked, strict=True)
                if is_marked and _width(self._costmap, each.pose, of_map=False) < each.width + _WIDER_M
            ]
        )

    def forget(self, before: float, *, of_map: bool) -> None:
        """Open what was closed before a moment.

        Args:
            before: Seconds.
            of_map: Whether also where the map itself is narrow.
        """
        self._keep([each for each in self._places if each.since >= before or (each.on_map and not of_map)])

    def _keep(self, places: list[TightPlace]) -> None:
        if len(places) == len(self._places):
            return
        self._places = places
        self._costmap.forget([TIGHT], before=np.inf)
        for each in places:
            self._costmap.mark(TIGHT, each.points, each.since)

    def only_way(self, robot: Pose2, goal: Pose2, parameters: PlannerParameters) -> TightPlace | None:
        """Return the first place that closes the only way to a goal, both in the map frame, or None."""
        if not self._places:
            return None
        costs = self._costmap.costs_without(TIGHT)
        plan = plan_path(self._costmap, robot, goal, parameters, costs=costs)
        if isinstance(plan, Result):
            return None
        x, y = plan.points.T
        on_way = [
            (int(np.argmin(away)), number)
            for number, each in enumerate(self._places)
            if (away := np.hypot(x - each.pose.x, y - each.pose.y)).min() < _ASIDE_M
        ]
        return self._places[min(on_way)[1]] if on_way else None


def _width(costmap: Costmap, place: Pose2, *, of_map: bool) -> float:
    """Return the free width across a way, on the map alone or with what the sensors have marked, metres."""
    free = 0.0
    for side in (1.0, -1.0):
        x, y = np.meshgrid(_ALONG_M, side * _BESIDE_M, indexing="ij")
        c, s = np.cos(place.yaw), np.sin(place.yaw)
        points = np.stack([place.x + c * x - s * y, place.y + s * x + c * y], axis=-1).reshape(-1, 2)
        stands = costmap.stands_at(points, of_map=of_map).reshape(x.shape)
        first = np.where(stands.any(axis=1), np.argmax(stands, axis=1), len(_BESIDE_M))
        free += _STEP_M * float(first.min())
    return free
