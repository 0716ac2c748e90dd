"""Zones in the costmaps: keep-out zones are obstacles there, slow zones limit the speed.

A robot that stands in a keep-out zone, put there or overtaken by a change, can leave it: what lies on its
shortest way out is open until it is out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, Twist2, integrate_twist
from florence_bt.core.outcome import Result, failure
from florence_bt.core.polygons import cells_inside, distance_to
from florence_bt.core.zones import KEEP_OUT, SLOW, Zone
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate._wave_kernels import NEUTRAL, OBSTACLE, UNVISITED, spread_wave
from florence_bt.skills.navigation.navigate.clearance import MapWalls
from florence_bt.skills.navigation.navigate.costmap import Costmap, moved_points

_LOOK_AGAIN_S = 1.0
"""Seconds between two searches for the way out; each is a wave over the map."""
_WAY_OUT_M = 0.4
"""The way out is open this far beyond the first place where the robot fits. Chosen: its circumscribed radius
of 0.26 m and some cells."""

_BRAKING_MPS2, _REACTION_S = 0.5, 0.3
"""So the robot brakes before a slow zone: as the controller (``acc_lim_x``), half of what the filter allows.
A command is in force two cycles after the place that it was chosen for."""
_STEP_M = 0.03
"""Step along a way. Chosen."""


class ZoneLayer:
    """The zones, and what they close of both costmaps.

    Args:
        global_costmap: In the map frame.
        local_costmap: In the odometry frame.
        static: Inflated costs of the map alone, on the cells of the global costmap.

    Attributes:
        zones: All of them.
        permanent: Inflated costs of map and keep-out zones: what stays closed whatever moves away.
    """

    def __init__(self, global_costmap: Costmap, local_costmap: Costmap, static: Cells) -> None:
        self._global, self._local = global_costmap, local_costmap
        self._static = static
        self.zones: tuple[Zone, ...] = ()
        self.permanent = static
        self._closed: NDArray[np.bool_] | None = None
        self._open: NDArray[np.bool_] | None = None
        self._looked = -math.inf
        self._frame = np.array([global_costmap.origin_x, global_costmap.origin_y, global_costmap.resolution])

    @property
    def _keep_out(self) -> list[Zone]:
        return [zone for zone in self.zones if zone.kind == KEEP_OUT]

    def set(self, zones: Iterable[Zone]) -> None:
        """Use these zones from now on, in place of all of before."""
        self.zones = tuple(zones)
        closed = np.zeros(self._global.shape, np.bool_)
        frame = (self._global.origin_x, self._global.origin_y), self._global.resolution
        for zone in self._keep_out:
            closed |= cells_inside(zone.polygon, *frame, closed.shape)
        self._closed = closed if closed.any() else None
        self._open, self._looked = None, -math.inf
        self._local.set_closed(None)
        self._close()
        self.permanent = self._static if self._closed is None else self._global.static_master()

    def update(self, now: float, pose: Pose2, map_from_odom: Pose2 | None) -> None:
        """Bring both costmaps up to date with where the robot is.

        Args:
            now: Seconds.
            pose: base_footprint in the odometry frame.
            map_from_odom: The place of that frame in the map; while it is not known, the zones stay where
                they were in the odometry frame.
        """
        if self._closed is None or map_from_odom is None:
            return
        self._look_for_way_out(now, map_from_odom @ pose)
        closed = self._closed if self._open is None else self._closed & ~self._open
        rows, columns = self._local.shape
        v, u = np.mgrid[:rows, :columns]
        middles = np.stack([u.ravel() + 0.5, v.ravel() + 0.5], axis=1) * self._local.resolution
        middles += self._local.origin_x, self._local.origin_y
        in_map = self._global.costs_at(moved_points(middles, map_from_odom), closed.astype(np.uint8))
        self._local.set_closed((in_map == 1).reshape(rows, columns))

    def _look_for_way_out(self, now: float, robot: Pose2) -> None:
        touches = self._walls_of_zones().touches(robot) or self.name_at(robot.x, robot.y) != ""
        if not touches:
            if self._open is not None:
                self._open = None
                self._close()
        elif self._open is None or now - self._looked >= _LOOK_AGAIN_S:
            self._looked = now
            self._open = self._way_out(robot)
            self._close()

    def _walls_of_zones(self) -> MapWalls:
        assert self._closed is not None
        outline = self._global.footprint.outline(self._global.resolution / 2.0)
        return MapWalls(self._closed.astype(np.uint8) * np.uint8(LETHAL), self._frame, outline)

    def _close(self) -> None:
        closed = self._closed
        self._global.set_closed(
            closed if closed is None or self._open is None else closed & ~self._open  # a copy
        )

    def _way_out(self, robot: Pose2) -> NDArray[np.bool_]:
        """Mark what the robot may cross on its shortest way to a place where it fits; shape of the map."""
        assert self._closed is not None
        start = self._global.cell_of(robot.x, robot.y)
        if start is None:
            return np.zeros_like(self._closed)
        crossing = np.full((self._static.shape[0] + 2, self._static.shape[1] + 2), OBSTACLE, np.uint8)
        crossing[1:-1, 1:-1] = np.where(self._static >= INSCRIBED, OBSTACLE, NEUTRAL)
        columns = crossing.shape[1]
        index = (start[0] + 1) * columns + start[1] + 1
        crossing.flat[index] = NEUTRAL
        wave = spread_wave(crossing.ravel(), columns, np.array([index]), -1, 2.0 * NEUTRAL)
        away = wave.reshape(crossing.shape)[1:-1, 1:-1]
        fits = (self.permanent < INSCRIBED) & (away < UNVISITED)
        nearest = float(away[fits].min()) if fits.any() else 0.0
        reach = nearest + NEUTRAL * _WAY_OUT_M / self._global.resolution
        way: NDArray[np.bool_] = away <= reach
        return way

    @property
    def closes_ways(self) -> bool:
        """Tell whether there are keep-out zones, and the robot stands in none of them."""
        return self._closed is not None and self._open is None

    def name_at(self, x: float, y: float) -> str:
        """Return the label of the keep-out zone at a place (map frame), empty where there is none."""
        return next((zone.label for zone in self._keep_out if zone.contains(x, y)), "")

    def problem_with(self, goal: Pose2) -> str | None:
        """Tell why keep-out zones forbid a goal, or None when they do not."""
        if self._closed is None:
            return None
        place, inside = f"({goal.x:.2f}, {goal.y:.2f})", self.name_at(goal.x, goal.y)
        if inside:
            return f"the goal {place} lies in the keep-out zone {inside!r}"
        cell = self._global.cell_of(goal.x, goal.y)
        too_near = cell is not None and self._static[cell] < INSCRIBED <= self.permanent[cell] < UNKNOWN_COST
        if not too_near and not self._walls_of_zones().touches(goal):
            return None
        nearest = min(self._keep_out, key=lambda zone: distance_to(zone.polygon, goal.x, goal.y))
        return f"the robot does not fit at {place}: the keep-out zone {nearest.label!r} is too near"

    def no_way_to(self, goal: Pose2) -> Result:
        """Return the failure for a goal to which keep-out zones close every way."""
        names = ", ".join(repr(zone.label) for zone in self._keep_out)
        zones = (
            f"the keep-out zone {names} closes"
            if len(self._keep_out) == 1
            else f"keep-out zones ({names}) close"
        )
        reason = f"{zones} every way to ({goal.x:.2f}, {goal.y:.2f})"
        return failure("no_path", reason)

    def speed_limit(self, robot: Pose2, command: Twist2, greatest: float) -> float:
        """Return how fast to drive for the slow zones to be kept to from their borders on.

        Args:
            robot: base_footprint in the map frame.
            command: The arc that is to be driven.
            greatest: The greatest speed of the robot, m/s.

        Returns:
            m/s; infinity when no zone is near enough to brake for.
        """
        slow = [zone for zone in self.zones if zone.kind == SLOW]
        speed = abs(command.linear)
        if not slow or speed == 0.0:
            return math.inf
        limit = math.inf
        farthest = speed**2 / (2.0 * _BRAKING_MPS2) + _REACTION_S * speed
        for way in np.linspace(0.0, farthest, 1 + math.ceil(farthest / _STEP_M)).tolist():
            there = integrate_twist(robot, command, way / speed)
            left = max(0.0, way - _REACTION_S * speed)
            for zone in slow:
                if zone.contains(there.x, there.y):
                    limit = min(
                        limit, math.hypot(zone.limit_mps(greatest), math.sqrt(2.0 * _BRAKING_MPS2 * left))
                    )
        return limit
