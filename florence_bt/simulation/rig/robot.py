"""The hardware of the rig: the pure parts of base, laser and Kinect on one manual clock.

Bytes and ROS are left out; everything else is what the nodes use, with the parameters the nodes have. Each
part runs at its node's rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, TypeVar

from florence_bt.core import topic_names
from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.ports import Ports, Topic
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage, Odometry
from florence_bt.core.topics import ODOMETRY, SCAN
from florence_bt.core.transforms import TransformBuffer
from florence_bt.drivers.hokuyo.geometry import URG_04LX, scan_from_distances
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.drivers.turtlebot.codec.packets import BUMP_LEFT, BUMP_RIGHT
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.drive_control import DriveControl
from florence_bt.drivers.turtlebot.hazards import StopReason, describe
from florence_bt.drivers.turtlebot.odometry import MotionEstimator
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.components import Config, parameters_of
from florence_bt.simulation.sensors.base_noise import BaseSensors
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor
from florence_bt.skills.navigation.mapping.map_making import BUMPS, Bumps
from florence_bt.skills.navigation.navigate.navigation import BASE_STOP, VELOCITY
from florence_bt.skills.navigation.navigate.results import BaseStop
from florence_bt.skills.people.user_tracker.tracking import COLOUR, DEPTH

LASER_FRAME, CAMERA_FRAME = "base_laser_round_link", "camera_depth_optical_frame"
MAP_FRAME, ODOM_FRAME, BASE_FRAME = "map", "odom", "base_footprint"
BASE_PERIOD_S = 0.02
KINECT_PERIOD_S = 0.2
"""Slower than the Kinect's 30 Hz: to look for people in a picture is by far the dearest thing in the rig."""
IDLE_SCAN_PERIOD_S = 0.5
"""While the robot stands and drives nowhere, scans are as rare as those that navigation takes then."""
SETTLED_S = 0.5
FILTERED_VELOCITY = Topic(topic_names.FILTERED_CMD_VEL, Twist2)
COMMANDED_S = 0.5
"""So long after a velocity command the robot counts as driven, whether it moves or not."""
PICTURE_SIZE = 320, 240
"""Columns and rows of the depth picture, as on the robot."""
COLOUR_CAMERA = CameraModel(160, 120, 131.25, 131.25, 79.5, 59.5)
"""Of the colour picture: the detector looks at the colours of so many pixels only."""

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


class RigRobot:
    """Sensors and odometry.

    Args:
        world: The physics.
        frames: The robot's static frames.
        config: Parameters by node name.
        clock: Drives everything.
        seed: Start of every noise generator.
        ports: Where its pictures, scans and frames go.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        frames: TransformBuffer,
        config: Config,
        clock: ManualClock,
        *,
        seed: int,
        ports: Ports,
    ) -> None:
        self.world = world
        self.frames = frames
        self.odometry = Odometry(clock.now(), Pose2())
        self._ports = ports
        self._depth, self._colour = ports.output(DEPTH), ports.output(COLOUR)
        self._odometry = ports.output(ODOMETRY)
        self._stops = ports.output(BASE_STOP)
        self._scans = ports.output(SCAN)
        self._bumps = ports.output(BUMPS)
        ports.listen(FILTERED_VELOCITY, self._drive)
        ports.listen(VELOCITY, self._note_command)
        self._held = BaseStop()
        self._commanded = -math.inf
        self._clock = clock
        base = parameters_of(TurtlebotParameters, config, "turtlebot_node")
        self._control = DriveControl(base.wheels(), base.cmd_vel_timeout, base.drive_mode)
        self._stop_on_bump = base.stop_motors_on_bump
        self._motion = MotionEstimator(base.odometry(), base.gyro(), has_gyro=base.has_gyro)
        self._base = BaseSensors(world, seed + 1)
        self._laser = LaserSensor(world, frames.lookup(BASE_FRAME, LASER_FRAME), seed + 2)
        mount = frames.lookup(BASE_FRAME, CAMERA_FRAME)
        self._kinect = KinectSensor(world, mount, *PICTURE_SIZE, seed=seed + 4)
        self._moved = clock.now()
        self._next_scan = clock.now()
        call_every(clock, BASE_PERIOD_S, self._step_base)
        call_every(clock, URG_04LX.scan_period, self._scan)
        call_every(clock, KINECT_PERIOD_S, self._look)

    def _hold(self) -> None:
        """Look at the bumper, and tell what holds the base when that has changed."""
        bits = sum(bit for bit, on in zip((BUMP_LEFT, BUMP_RIGHT), self.world.bumpers(), strict=True) if on)
        if self._bumps.listeners:
            self._bumps.send(Bumps(bits))
        held = BaseStop()
        if bits and self._stop_on_bump:
            bumper = StopReason.BUMPER
            held = BaseStop(bumper.code, describe(bumper, SensorState(bumps_wheeldrops=bits)))
        if held != self._held:
            self._held = held
            self._stops.send(held)

    def _note_command(self, _: Twist2) -> None:
        self._commanded = self._clock.now()

    def _drive(self, twist: Twist2) -> None:
        self._control.command(twist, self._clock.now())
        self._turn_wheels()

    def _turn_wheels(self) -> None:
        """Give the wheels their speeds; the bytes that would tell the base go nowhere."""
        objection = StopReason.BUMPER if self._held.code else None
        self._control.take(self._clock.now(), objection, enabled=True)
        wheels = self._control.wheels
        self.world.set_wheels(wheels.left_mmps / 1000.0, wheels.right_mmps / 1000.0)

    def _step_base(self) -> None:
        now = self._clock.now()
        self.world.step_to(now)
        self._hold()
        self._turn_wheels()
        self._base.update(now)
        motion = self._motion.update(
            now,
            self._base.take_distance_mm() / 1000.0,
            math.radians(self._base.take_angle_deg()),
            self._base.gyro_adc(),
            wheels_stopped=not self._control.wants_motion(now),
        )
        self.odometry = motion.odometry
        self._ports.send_frame(ODOM_FRAME, BASE_FRAME, now, self.odometry.pose)
        self._odometry.send(self.odometry)
        if not motion.at_rest or now - self._commanded < COMMANDED_S:
            self._moved = now
            self._next_scan = now

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
        self._scans.send(scan)

    def _look(self) -> None:
        now = self._clock.now()
        self._colour.send(TakenPicture(now, self._colours))
        self._depth.send(TakenPicture(now, self._depths))

    def _depths(self) -> DepthImage:
        depths = metres_from_raw(self._kinect.measure_depth())
        return DepthImage(self._clock.now(), CAMERA_FRAME, self._kinect.camera, depths)

    def _colours(self) -> ColourImage:
        step = self._kinect.camera.width // COLOUR_CAMERA.width
        return ColourImage(self._clock.now(), CAMERA_FRAME, COLOUR_CAMERA, self._kinect.colours(step))
