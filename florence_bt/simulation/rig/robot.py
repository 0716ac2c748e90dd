"""The robot of the rig: the pure parts of base, laser, Kinect, filters and localisation on one manual clock.

Bytes and ROS are left out; everything else is what the nodes use, with the parameters the nodes have. Each
part runs at its node's rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Generic, TypeVar

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.ports import Delivery, Ports, Topic
from florence_bt.core.sensing import ColourImage, DepthImage, LaserScan, OccupancyGrid, Odometry
from florence_bt.core.transforms import TransformBuffer
from florence_bt.drivers.hokuyo.geometry import URG_04LX, scan_from_distances
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.drivers.turtlebot.codec.packets import BUMP_LEFT, BUMP_RIGHT
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.hazards import StopReason, describe, hold_forward
from florence_bt.drivers.turtlebot.odometry import MotionEstimator
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.drivers.turtlebot.wheels import wheels_from_twist
from florence_bt.ros.parameters import fill_dataclass
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.base_noise import BaseSensors
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser, FakeLaserParameters
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters, LowObstacles
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters, Overhangs
from florence_bt.skills.filters.laser_combinator.combinator import LaserCombinator
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter, LaserFilterParameters
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    VelocityFilterParameters,
    VelocityTicker,
)
from florence_bt.skills.navigation.localisation.localiser import Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap, Progress
from florence_bt.skills.navigation.navigate.navigation import BASE_STOP, ODOMETRY, SCANS, VELOCITY
from florence_bt.skills.navigation.navigate.navigator import FEET
from florence_bt.skills.navigation.navigate.results import BaseStop
from florence_bt.skills.people.user_tracker.tracking import COLOUR, DEPTH

LASER_FRAME, KINECT_SCAN_FRAME = "base_laser_round_link", "camera_depth_frame"
CAMERA_FRAME = "camera_depth_optical_frame"
MAP_FRAME, ODOM_FRAME, BASE_FRAME = "map", "odom", "base_footprint"
BASE_PERIOD_S = 0.02
KINECT_PERIOD_S = 0.2
"""Slower than the Kinect's 30 Hz: a depth image is by far the dearest thing in the rig."""
IDLE_SCAN_PERIOD_S = 0.5
"""While the robot stands and drives nowhere, scans are as rare as those that navigation takes then."""
SETTLED_S = 0.5
COMMANDED_S = 0.5
"""So long after a velocity command the robot counts as driven, whether it moves or not."""
DRIVING_SIZE, LOOKING_SIZE = (160, 120), (320, 240)
"""Columns and rows of the depth image: coarse for obstacles, as on the robot for looking at people."""
TRANSFORM_PERIOD_S, TRANSFORM_AHEAD_S = 0.05, 0.2
"""How often the place of the odometry frame is published, and how far ahead it is stamped: as the localiser's
node does by default."""

T = TypeVar("T")


class TakenPicture(Generic[T]):
    """A picture that is rendered when somebody reads it first, before the world moves on."""

    def __init__(self, stamp: float, render: Callable[[], T]) -> None:
        self.stamp = stamp
        self._render = render
        self._rendered: T | None = None

    def read(self) -> T:
        """Return the picture."""
        if self._rendered is None:
            self._rendered = self._render()
        return self._rendered


Config = Mapping[str, Mapping[str, Any]]


def parameters_of(cls: type[T], config: Config, node: str) -> T:
    """Return the part of a node's configuration that a pure component has parameters for."""
    return fill_dataclass(cls, config.get(node, {}).get)


class RigRobot:
    """Sensors, filters, odometry and localisation.

    Args:
        world: The physics.
        grid: The map that the robot is localised in.
        mapping: What makes the map in its place, None for nothing.
        frames: The robot's static frames.
        config: Parameters by node name.
        clock: Drives everything.
        seed: Start of every noise generator.
        start: Where the robot believes to be at first, in the map frame.
        ports: Where its pictures, scans and frames go.
        on_map: Called with each newer map that is made.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        grid: OccupancyGrid,
        frames: TransformBuffer,
        config: Config,
        clock: ManualClock,
        *,
        seed: int,
        start: Pose2,
        ports: Ports,
        mapping: GrowingMap | None = None,
        on_map: Callable[[OccupancyGrid], None] = lambda grid: None,
    ) -> None:
        self.world = world
        self.frames = frames
        self.odometry = Odometry(clock.now(), Pose2())
        self._ports = ports
        self._depth, self._colour = ports.output(DEPTH), ports.output(COLOUR)
        self._odometry = ports.output(ODOMETRY)
        self._stops = ports.output(BASE_STOP)
        self._scans = {
            source: ports.output(Topic(name, LaserScan, Delivery.SENSOR)) for name, source in SCANS.items()
        }
        ports.listen(VELOCITY, self.command)
        self._told_stop = BaseStop()
        self._commanded = -math.inf
        self._clock = clock
        base = parameters_of(TurtlebotParameters, config, "turtlebot_node")
        self._wheels = base.wheels()
        self._stop_on_bump = base.stop_motors_on_bump
        self._motion = MotionEstimator(base.odometry(), base.gyro(), has_gyro=base.has_gyro)
        self._base = BaseSensors(world, seed + 1)
        self._twist = STANDSTILL
        self.velocity = VelocityTicker(
            clock, self._drive, parameters_of(VelocityFilterParameters, config, "velocity_filter")
        )
        self._laser = LaserSensor(world, frames.lookup(BASE_FRAME, LASER_FRAME), seed + 2)
        self._laser_in_base = frames.lookup(BASE_FRAME, LASER_FRAME)
        mount = frames.lookup(BASE_FRAME, CAMERA_FRAME)
        self._driving_kinect = KinectSensor(world, mount, *DRIVING_SIZE, seed=seed + 3)
        self._looking_kinect = KinectSensor(world, mount, *LOOKING_SIZE, seed=seed + 4)
        self._fake_laser = FakeLaser(parameters_of(FakeLaserParameters, config, "kinect_laser"))
        self._low_obstacles = LowObstacles.between(
            self._fake_laser.parameters, parameters_of(LowObstacleParameters, config, "kinect_laser")
        )
        self._overhangs = Overhangs.within(
            self._fake_laser.parameters, parameters_of(OverhangParameters, config, "kinect_laser")
        )
        self._combinator = LaserCombinator(
            parameters_of(CombinatorParameters, config, "laser_combinator"),
            frames.lookup(LASER_FRAME, KINECT_SCAN_FRAME),
        )
        self._laser_filter = LaserFilter(parameters_of(LaserFilterParameters, config, "laser_filter"))
        self._mapping, self._on_map = mapping, on_map
        self._touching = False
        self._localiser = Localiser(grid, parameters_of(LocaliserParameters, config, "localiser"), seed)
        self._localiser.set_pose(start, (0.05, 0.05, 0.03))
        self._localiser.believe(Pose2())
        self._last_map_from_odom = start
        self._moved = clock.now()
        self._next_scan = self._next_kinect_scan = clock.now()
        call_every(clock, BASE_PERIOD_S, self._step_base)
        call_every(clock, URG_04LX.scan_period, self._scan)
        call_every(clock, KINECT_PERIOD_S, self._look)
        call_every(clock, TRANSFORM_PERIOD_S, self._send_place)

    @property
    def map_from_odom(self) -> Pose2 | None:
        """The place of the odometry frame in the map, None while the robot is lost."""
        source = self._mapping or self._localiser
        return source.map_from_odom

    @property
    def progress(self) -> Progress | None:
        """How far the map is; None when none is made."""
        return None if self._mapping is None else self._mapping.progress

    @property
    def pose(self) -> Pose2:
        """Where the robot believes to be in the map frame, or believed before it was lost."""
        return self._last_map_from_odom @ self.odometry.pose

    @property
    def stop(self) -> tuple[str, str]:
        """What holds the base: its code and its sentence, both empty when nothing does."""
        bits = sum(bit for bit, on in zip((BUMP_LEFT, BUMP_RIGHT), self.world.bumpers(), strict=True) if on)
        if not bits or not self._stop_on_bump:
            return "", ""
        bumper = StopReason.BUMPER
        return bumper.code, describe(bumper, SensorState(bumps_wheeldrops=bits))

    def command(self, twist: Twist2) -> None:
        """Take a velocity command, as the topic cmd_vel does."""
        self._commanded = self._clock.now()
        self.velocity.command(twist)

    def _drive(self, twist: Twist2) -> None:
        self._twist = twist
        bumped = StopReason.BUMPER if self.stop[0] else None
        wheels = hold_forward(wheels_from_twist(twist, self._wheels), bumped)
        self.world.set_wheels(wheels.left_mmps / 1000.0, wheels.right_mmps / 1000.0)

    def _step_base(self) -> None:
        now = self._clock.now()
        self.world.step_to(now)
        self._base.update(now)
        motion = self._motion.update(
            now,
            self._base.take_distance_mm() / 1000.0,
            math.radians(self._base.take_angle_deg()),
            self._base.gyro_adc(),
            wheels_stopped=self._twist.is_zero(),
        )
        self.odometry = motion.odometry
        self._ports.send_frame(ODOM_FRAME, BASE_FRAME, now, self.odometry.pose)
        self._odometry.send(self.odometry)
        stop = BaseStop(*self.stop)
        if stop != self._told_stop:
            self._told_stop = stop
            self._stops.send(stop)
        before, self._touching = self._touching, bool(self.stop[0])
        if self._mapping is not None and self._touching and not before:
            left, right = self.world.bumpers()
            self._mapping.touched(self.odometry.pose, left=left, right=right)
        if not motion.at_rest or now - self._commanded < COMMANDED_S:
            self._moved = now
            self._next_scan = self._next_kinect_scan = now

    def _scan(self) -> None:
        now = self._clock.now()
        if now < self._next_scan:
            return
        if now - self._moved >= SETTLED_S:
            self._next_scan = now + IDLE_SCAN_PERIOD_S - URG_04LX.scan_period / 2
        geometry = URG_04LX
        distances = self._laser.measure(geometry.first_step, geometry.last_step)
        # All beams are of now: the middle of the scan, at which a real one stands for all of them.
        begun = now - geometry.time_increment * (len(distances) - 1) / 2
        scan = scan_from_distances(distances, geometry.first_step, 1, geometry, begun, LASER_FRAME)
        if self._mapping is None:
            self._localiser.update(scan, self._laser_in_base, self.odometry.pose)
        elif grid := self._mapping.update(scan, self._laser_in_base, self.odometry.pose, now):
            self._on_map(grid)
        self._last_map_from_odom = self.map_from_odom or self._last_map_from_odom
        self._combinator.update_laser(scan, now)
        self._pass_on(FEET, scan)

    def _send_place(self) -> None:
        if self.map_from_odom is not None:
            when = self._clock.now() + TRANSFORM_AHEAD_S
            self._ports.send_frame(MAP_FRAME, ODOM_FRAME, when, self.map_from_odom)

    def _look(self) -> None:
        now = self._clock.now()
        if self._depth.listeners:
            self._colour.send(TakenPicture(now, self._colours))
            self._depth.send(TakenPicture(now, partial(self._depths, self._looking_kinect)))
        if now < self._next_kinect_scan:
            return
        if now - self._moved >= SETTLED_S:
            self._next_kinect_scan = now + IDLE_SCAN_PERIOD_S - KINECT_PERIOD_S / 2
        depth = self._depths(self._driving_kinect)
        kinect_scan = self._fake_laser.project(depth)
        self._pass_on("depth", kinect_scan)
        if self._low_obstacles is not None:
            self._pass_on("low", self._low_obstacles.project(depth, kinect_scan))
        if self._overhangs is not None:
            self._pass_on("overhangs", self._overhangs.project(depth))
        combined = self._combinator.update_kinect(kinect_scan, now)
        if combined is not None:
            self._pass_on("scan", combined)

    def _pass_on(self, source: str, scan: LaserScan) -> None:
        self._scans[source].send(self._laser_filter.filter(scan))

    def _depths(self, kinect: KinectSensor) -> DepthImage:
        depths = metres_from_raw(kinect.measure_depth())
        return DepthImage(self._clock.now(), CAMERA_FRAME, kinect.camera, depths)

    def _colours(self) -> ColourImage:
        # Of so many pixels only: the detector looks at no more.
        camera = self._driving_kinect.camera
        step = self._looking_kinect.camera.width // camera.width
        return ColourImage(self._clock.now(), CAMERA_FRAME, camera, self._looking_kinect.colours(step))
