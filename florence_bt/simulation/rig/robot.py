"""The hardware of the rig: base, laser and Kinect on one manual clock, with the parameters of their nodes.

Bytes and ROS are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, TypeVar

from florence_bt.core import topic_names
from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.ports import Topic
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage, Odometry
from florence_bt.core.topics import ODOMETRY, SCAN
from florence_bt.core.transforms import TransformBuffer
from florence_bt.drivers.hokuyo.geometry import URG_04LX, scan_from_distances
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.base import connect_base
from florence_bt.simulation.rig.components import Config, parameters_of
from florence_bt.simulation.rig.wires import Wires
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor
from florence_bt.skills.navigation.navigate.navigation import VELOCITY
from florence_bt.skills.people.user_tracker.tracking import COLOUR, DEPTH

LASER_FRAME, CAMERA_FRAME = "base_laser_round_link", "camera_depth_optical_frame"
MAP_FRAME, ODOM_FRAME, BASE_FRAME = "map", "odom", "base_footprint"
KINECT_PERIOD_S = 0.2
"""Slower than the Kinect's 30 Hz: to look for people in a picture is by far the dearest thing in the rig."""
IDLE_SCAN_PERIOD_S = 0.5
"""While the robot stands and drives nowhere, scans are as rare as those that navigation takes then."""
SETTLED_S = 0.5
FILTERED_VELOCITY = Topic(topic_names.FILTERED_CMD_VEL, Twist2)
FROM_FILTERS = {
    topic_names.CMD_VEL: topic_names.FILTERED_CMD_VEL,
    topic_names.MANUAL_CMD_VEL: f"filtered_{topic_names.MANUAL_CMD_VEL}",
}
"""The base takes its commands from the velocity filter, as on the robot (``app.bringup.topology``)."""
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
        wires: Connect it.

    Attributes:
        base: What simulates the base.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        frames: TransformBuffer,
        config: Config,
        clock: ManualClock,
        *,
        seed: int,
        wires: Wires,
    ) -> None:
        self.world = world
        self.frames = frames
        self.base = connect_base(
            wires.ports("turtlebot_node", FROM_FILTERS),
            world,
            parameters_of(TurtlebotParameters, config, "turtlebot_node"),
            parameters_of(TurtlebotNodeParameters, config, "turtlebot_node"),
            clock,
            seed=seed + 1,
        )
        ports = wires.ports("hardware")
        self._depth, self._colour = ports.output(DEPTH), ports.output(COLOUR)
        self._scans = ports.output(SCAN)
        ports.listen(VELOCITY, self._note_command)
        ports.listen(ODOMETRY, self._note_motion)
        self._commanded = -math.inf
        self._clock = clock
        self._laser = LaserSensor(world, frames.lookup(BASE_FRAME, LASER_FRAME), seed + 2)
        mount = frames.lookup(BASE_FRAME, CAMERA_FRAME)
        self._kinect = KinectSensor(world, mount, *PICTURE_SIZE, seed=seed + 4)
        self._moved = clock.now()
        self._next_scan = clock.now()
        call_every(clock, URG_04LX.scan_period, self._scan)
        call_every(clock, KINECT_PERIOD_S, self._look)

    @property
    def odometry(self) -> Odometry:
        """Where the base believes to be since the start."""
        reading = self.base.reading
        return Odometry(self._clock.now(), Pose2()) if reading is None else reading.odometry

    def _note_command(self, _: Twist2) -> None:
        self._commanded = self._clock.now()

    def _note_motion(self, odometry: Odometry) -> None:
        """Scan more often again from the first motion or command on."""
        now, reading = self._clock.now(), self.base.reading
        if (reading is not None and not reading.at_rest) or now - self._commanded < COMMANDED_S:
            self._moved = now
            self._next_scan = now

    def _scan(self) -> None:
        now = self._clock.now()
        if now < self._next_scan:
            return
        if now - self._moved >= SETTLED_S:
            self._next_scan = now + IDLE_SCAN_PERIOD_S - URG_04LX.scan_period / 2
        self.world.step_to(now)
        geometry = URG_04LX
        distances = self._laser.measure(geometry.first_step, geometry.last_step)
        # All beams are of now: the middle of the scan, at which a real one stands for all of them.
        begun = now - geometry.time_increment * (len(distances) - 1) / 2
        scan = scan_from_distances(distances, geometry.first_step, 1, geometry, begun, LASER_FRAME)
        self._scans.send(scan)

    def _look(self) -> None:
        now = self._clock.now()
        self.world.step_to(now)
        self._colour.send(TakenPicture(now, self._colours))
        self._depth.send(TakenPicture(now, self._depths))

    def _depths(self) -> DepthImage:
        depths = metres_from_raw(self._kinect.measure_depth())
        return DepthImage(self._clock.now(), CAMERA_FRAME, self._kinect.camera, depths)

    def _colours(self) -> ColourImage:
        step = self._kinect.camera.width // COLOUR_CAMERA.width
        return ColourImage(self._clock.now(), CAMERA_FRAME, COLOUR_CAMERA, self._kinect.colours(step))
