"""The hardware of the rig: base, laser and Kinect on one manual clock, with the parameters of their nodes.

Bytes and ROS are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

from florence_bt.core import topic_names
from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.ports import Topic
from florence_bt.core.sensing import Odometry
from florence_bt.core.transforms import Transform3, TransformBuffer
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.base import connect_base
from florence_bt.simulation.rig.components import Config, parameters_of
from florence_bt.simulation.rig.kinect import PICTURE_SIZE, connect_kinect
from florence_bt.simulation.rig.laser import connect_laser
from florence_bt.simulation.rig.wires import Wires
from florence_bt.simulation.sensors.base_noise import BaseNoiseParameters
from florence_bt.simulation.sensors.kinect_sensor import KinectNoiseParameters, KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserParameters, LaserSensor

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SensorQuality:
    """Quality of the sensors; by default as those of the robot.

    Attributes:
        base: Odometry and gyro.
        laser: The laser.
        kinect: The Kinect.
        camera_pitch: How far the camera looks further down than the robot's description says, radians.
    """

    base: BaseNoiseParameters = field(default_factory=BaseNoiseParameters)
    laser: LaserParameters = field(default_factory=LaserParameters)
    kinect: KinectNoiseParameters = field(default_factory=KinectNoiseParameters)
    camera_pitch: float = 0.0


USUAL_QUALITY = SensorQuality()
LASER_FRAME, CAMERA_FRAME = "base_laser_round_link", "camera_depth_optical_frame"
MAP_FRAME, ODOM_FRAME, BASE_FRAME = "map", "odom", "base_footprint"
FILTERED_VELOCITY = Topic(topic_names.FILTERED_CMD_VEL, Twist2)
FROM_FILTERS = {
    topic_names.CMD_VEL: topic_names.FILTERED_CMD_VEL,
    topic_names.MANUAL_CMD_VEL: f"filtered_{topic_names.MANUAL_CMD_VEL}",
}
"""The base takes its commands from the velocity filter, as on the robot (``app.bringup.topology``)."""


class RigRobot:
    """Sensors and odometry.

    Args:
        world: The physics.
        frames: The robot's static frames.
        config: Parameters by node name.
        clock: Drives everything.
        seed: Start of every noise generator.
        wires: Connect it.
        quality: How good its sensors are.

    Attributes:
        base: What simulates the base.
        kinect: What renders the Kinect's pictures.
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
        quality: SensorQuality = USUAL_QUALITY,
    ) -> None:
        self.world, self.frames, self._clock = world, frames, clock

        def of(kind: type[T], node: str) -> T:
            return parameters_of(kind, config, node)

        self.base = connect_base(
            wires.ports("turtlebot_node", FROM_FILTERS),
            world,
            of(TurtlebotParameters, "turtlebot_node"),
            of(TurtlebotNodeParameters, "turtlebot_node"),
            clock,
            seed=seed + 1,
            noise=quality.base,
        )
        laser = LaserSensor(world, frames.lookup(BASE_FRAME, LASER_FRAME), seed + 2, quality.laser)
        connect_laser(wires.ports("hokuyo_node"), laser, world, of(HokuyoParameters, "hokuyo_node"), clock)
        # The axes of an optical frame: x to the right, y down, z ahead.
        pitched = Transform3.from_xyz_rpy((0.0, 0.0, 0.0), (-quality.camera_pitch, 0.0, 0.0))
        mount = frames.lookup(BASE_FRAME, CAMERA_FRAME) @ pitched
        self.kinect = KinectSensor(world, mount, *PICTURE_SIZE, seed=seed + 4, parameters=quality.kinect)
        connect_kinect(
            wires.ports("kinect_node"), self.kinect, world, of(KinectParameters, "kinect_node"), clock
        )

    @property
    def odometry(self) -> Odometry:
        """Return where the base believes to be since the start."""
        reading = self.base.reading
        return Odometry(self._clock.now(), Pose2()) if reading is None else reading.odometry
