"""A small world for the navigation tests: boxes, a laser that is cast exactly, a base with inertia.

The geometry is exact and independent of the code under test; the map is made from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from florence_bt.core.geometry import (
    STANDSTILL,
    FramedPose,
    Point3,
    Pose2,
    Twist2,
    angle_difference,
    integrate_twist,
)
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate.drive_actions import HeadingGoal, PoseGoal
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.state import Feedback

UPSIDE_DOWN_LASER = Transform3.from_xyz_rpy((0.057, 0.0, 0.087), (math.pi, 0.0, 0.0))
CAMERA = Transform3.from_xyz_rpy((-0.087, 0.018, 0.3), (0.0, 0.0, 0.0))
TRUE_FOOTPRINT = ((-0.16, -0.16), (-0.16, 0.16), (0.19, 0.16), (0.24, 0.0), (0.19, -0.16))
Box = tuple[float, float, float, float]
"""x from, y from, x to, y to"""

WALLS: tuple[Box, ...] = (
    (-0.1, -0.1, 8.1, 0.0),
    (-0.1, 5.0, 8.1, 5.1),
    (-0.1, 0.0, 0.0, 5.0),
    (8.0, 0.0, 8.1, 5.0),
    (4.0, 0.0, 4.1, 2.0),
    (4.0, 2.8, 4.1, 5.0),
    (1.2, 4.2, 2.0, 5.0),
    (6.0, 0.0, 6.6, 0.9),
)
"""Two rooms of 4 x 5 m, a door of 0.8 m at x = 4, y = 2.0 .. 2.8, a cupboard in each."""


def make_map(boxes: Sequence[Box] = WALLS, resolution: float = 0.05) -> OccupancyGrid:
    """The map of some boxes; everything around the rooms is unknown."""
    origin = Pose2(-0.5, -0.5)
    columns, rows = round(9.0 / resolution), round(6.0 / resolution)
    x = origin.x + (np.arange(columns) + 0.5) * resolution
    y = origin.y + (np.arange(rows) + 0.5) * resolution
    cells = np.zeros((rows, columns), np.int8)
    cells[(y < 0) | (y > 5), :] = -1
    cells[:, (x < 0) | (x > 8)] = -1
    for x0, y0, x1, y1 in boxes:
        cells[np.ix_((y >= y0) & (y <= y1), (x >= x0) & (x <= x1))] = 100
    return OccupancyGrid(resolution, origin, cells)


def ahead(way: float, speed: float, time_allowance: float = 0.0) -> HeadingGoal:
    """Drive so many metres straight on, below zero back, at so many m/s."""
    return HeadingGoal(Point3(way), math.copysign(speed, way), time_allowance)


@njit(cache=True)
def cast(
    x: float, y: float, angles: NDArray[np.float64], boxes: NDArray[np.float64], longest: float
) -> NDArray:
    ranges = np.full(len(angles), longest)
    for i in range(len(angles)):
        dx, dy = math.cos(angles[i]), math.sin(angles[i])
        for b in range(len(boxes)):
            near, far = 0.0, longest
            for start, step, low, high in (
                (x, dx, boxes[b, 0], boxes[b, 2]),
                (y, dy, boxes[b, 1], boxes[b, 3]),
            ):
                if abs(step) < 1e-12:
                    if start < low or start > high:
                        near = far + 1.0
                else:
                    one, two = (low - start) / step, (high - start) / step
                    near, far = max(near, min(one, two)), min(far, max(one, two))
            if near <= far and near < ranges[i]:
                ranges[i] = near
    return ranges


@dataclass
class World:
    """The truth: boxes, the robot, its wheels' slip and its sensors' noise."""

    pose: Pose2
    boxes: list[Box] = field(default_factory=lambda: list(WALLS))
    seed: int = 1
    range_noise: float = 0.01
    odometry_noise: float = 0.01
    now: float = 0.0
    command: Twist2 = STANDSTILL
    twist: Twist2 = STANDSTILL
    odom: Pose2 = field(default_factory=Pose2)
    hits: int = 0

    def __post_init__(self) -> None:
        self.random = np.random.default_rng(self.seed)

    def advance(self, seconds: float) -> None:
        """Let time pass, with the velocity filter's limits (1 m/s2, 1 rad/s2 at 50 Hz)."""
        for _ in range(round(seconds * 50)):
            self.twist = Twist2(
                _towards(self.twist.linear, self.command.linear, 0.02),
                _towards(self.twist.angular, self.command.angular, 0.02),
            )
            self.pose = integrate_twist(self.pose, self.twist, 0.02)
            slip = 1.0 + self.odometry_noise * self.random.standard_normal(2)
            seen = Twist2(self.twist.linear * slip[0], self.twist.angular * slip[1])
            self.odom = integrate_twist(self.odom, seen, 0.02)
            self.now += 0.02
            self.hits += self.touches()

    def odometry(self) -> Odometry:
        return Odometry(self.now, self.odom, self.twist)

    def touches(self) -> bool:
        """Whether the true footprint overlaps any box."""
        points = np.array([self.pose.apply(*corner) for corner in outline(0.01)])
        return any(
            bool(
                np.any((points[:, 0] > x0) & (points[:, 0] < x1) & (points[:, 1] > y0) & (points[:, 1] < y1))
            )
            for x0, y0, x1, y1 in self.boxes
        )

    def scan(
        self, *, longest: float = 5.6, half_angle: float = math.radians(120), step: float = 0.00613592
    ) -> LaserScan:
        """The Hokuyo: 240 degrees, upside down, 1 % noise; what is out of range reads range_max - 1e-4."""
        count = int(2 * half_angle / step) + 1
        mount = UPSIDE_DOWN_LASER.to_pose2()
        laser = self.pose @ mount
        angles = -half_angle + step * np.arange(count)
        ranges = cast(laser.x, laser.y, laser.yaw - angles, np.array(self.boxes), longest)
        return self._scan(ranges, "laser", -half_angle, step, longest, 0.02)

    def kinect(self, boxes: Sequence[Box], longest: float = 4.0) -> LaserScan:
        """A flat scan of the depth camera: 57 degrees, from 0.5 m on, of boxes that only it can see."""
        camera = self.pose @ CAMERA.to_pose2()
        half, count = math.radians(28.5), 160
        step = 2 * half / (count - 1)
        ranges = cast(
            camera.x,
            camera.y,
            camera.yaw - half + step * np.arange(count),
            np.array([*self.boxes, *boxes]),
            longest,
        )
        ranges = np.where(ranges < 0.5, math.nan, ranges)
        return self._scan(ranges, "camera", -half, step, longest, 0.45)

    def _scan(
        self, ranges: NDArray, frame: str, start: float, step: float, longest: float, least: float
    ) -> LaserScan:
        noisy = ranges * (1.0 + self.range_noise * self.random.standard_normal(len(ranges)))
        noisy = np.where(ranges >= longest, longest - 1e-4, np.minimum(noisy, longest - 1e-4))
        return LaserScan(self.now, frame, start, step, least, longest, noisy.astype(np.float32))


def outline(spacing: float) -> list[tuple[float, float]]:
    """Points along the robot's true outline."""
    points: list[tuple[float, float]] = []
    for (x0, y0), (x1, y1) in zip(TRUE_FOOTPRINT, (*TRUE_FOOTPRINT[1:], TRUE_FOOTPRINT[0]), strict=True):
        count = max(1, math.ceil(math.hypot(x1 - x0, y1 - y0) / spacing))
        points += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count)]
    return points


def _towards(value: float, wanted: float, limit: float) -> float:
    return value + max(-limit, min(limit, wanted - value))


class Trip:
    """A navigator that drives in a world, cycle by cycle."""

    def __init__(
        self,
        start: Pose2,
        *,
        boxes: tuple[Box, ...] = WALLS,
        on_map: tuple[Box, ...] = WALLS,
        only_camera: tuple[Box, ...] = (),
        seed: int = 1,
        jitter: float = 0.0,
        parameters: NavigatorParameters | None = None,
    ) -> None:
        self.world = World(start, boxes=list(boxes), seed=seed)
        self.navigator = Navigator(make_map(on_map), parameters)
        self.only_camera = list(only_camera)
        self.jitter = jitter
        self.texts: list[str] = []
        self.feedback = Feedback()
        self.commands: list[float] = []
        self.see()

    def come(self, way: float) -> None:
        """Drive straight on by so many metres: the robot may back over that floor again."""
        self.navigator.start(ahead(way, 0.3, 0.0), self.world.now)
        result = None
        while result is None:
            result = self.cycle()
        assert result.succeeded, result
        self.commands.clear()

    def map_from_odom(self) -> Pose2:
        """The truth, with an error as a localisation has it."""
        x, y, yaw = self.jitter * self.world.random.standard_normal(3)
        return self.world.pose @ Pose2(float(x), float(y), float(yaw)) @ self.world.odom.inverse()

    def see(self) -> None:
        place = self.map_from_odom()
        self.navigator.add_scan("scan", self.world.scan(), UPSIDE_DOWN_LASER, self.world.odom, place)
        if self.only_camera:
            picture = self.world.kinect(self.only_camera)
            self.navigator.add_scan("depth", picture, CAMERA, self.world.odom, place)

    def cycle(self) -> Result | None:
        self.see()
        step = self.navigator.step(self.world.now, self.world.odometry(), self.map_from_odom())
        assert step.command is not None
        self.world.command = step.command
        self.feedback = step.feedback
        self.texts.append(step.feedback.text)
        self.commands.append(step.command.linear)
        self.world.advance(0.1)
        return step.result

    def go(self, goal: Pose2, limit: float = 90.0, each: Callable[[World], None] | None = None) -> Result:
        self.navigator.start(PoseGoal(FramedPose(goal)), self.world.now)
        end = self.world.now + limit
        while self.world.now < end:
            if each is not None:
                each(self.world)
            result = self.cycle()
            if result is not None:
                assert self.world.command == STANDSTILL
                assert not self.navigator.active
                self.world.advance(0.6)
                return result
        pytest.fail(f"not over after {limit} s: {self.texts[-1]}")

    def assert_at(self, goal: Pose2) -> None:
        assert self.world.hits == 0
        assert self.world.pose.distance_to(goal) < 0.05
        assert abs(angle_difference(self.world.pose.yaw, goal.yaw)) < 0.1
