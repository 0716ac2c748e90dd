"""The node ``turtlebot_calibration``: turns the base before a wall and measures (document, section 7.2)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.msg import TurtlebotSensorState
from geometry_msgs.msg import Twist
from rclpy.context import Context
from sensor_msgs.msg import Imu
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.clock import call_every
from florence_bt.core.geometry import STANDSTILL
from florence_bt.core.topic_names import CMD_VEL, IMU, KINECT_SCAN, SENSOR_STATE
from florence_bt.ros.conversions import scan_from_ros, stamp_from_ros, twist_to_ros, yaw_from_quaternion
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.skills.calibration.calibration import STEP_PERIOD_S, CalibrationParameters, CalibrationRounds
from florence_bt.skills.calibration.factors import Source
from florence_bt.skills.calibration.wall_angle import WallParameters, find_wall

FIRST_MESSAGES_S = 20.0
"""Wall seconds to wait for the first message of every sensor; simulated time may outrun discovery."""


@dataclass(frozen=True, slots=True)
class CalibrationNodeParameters:
    """The sources of the readings.

    Attributes:
        scan_topic: Scans whose angle zero is straight ahead and whose z axis points up; the Kinect as a laser
            (document, section 7.2).
        odom_scale: The value of ``odom_angular_scale_correction`` that the base works with.
    """

    scan_topic: str = KINECT_SCAN
    odom_scale: float = 1.0


class CalibrationNode(FlorenceNode):
    """Runs all rounds, then stands still.

    Args:
        on_feedback: Called with what goes on, whenever it changes.
        on_end: Called once, when there is a result.

    Attributes:
        rounds: What was measured.
    """

    parameter_classes = (CalibrationNodeParameters, CalibrationParameters, WallParameters)

    def __init__(
        self,
        on_feedback: Callable[[str], None],
        on_end: Callable[[], None],
        *,
        parameters: Mapping[str, Any] | None = None,
        context: Context | None = None,
    ) -> None:
        super().__init__("turtlebot_calibration", parameters=parameters, context=context)
        settings = self.read_parameters(CalibrationNodeParameters)
        turning = self.read_parameters(CalibrationParameters)
        self.rounds = CalibrationRounds(turning)
        self._wall = self.read_parameters(WallParameters)
        self._scale = settings.odom_scale
        self._turned = 0.0
        self._on_feedback = on_feedback
        self._on_end = on_end
        self._reported = ""
        self._missing = set(Source) if turning.has_gyro else set(Source) - {Source.GYRO}
        self._begin_by = time.monotonic() + FIRST_MESSAGES_S
        self._commands = self.create_publisher(Twist, CMD_VEL, RELIABLE)
        self.create_subscription(LaserScanMsg, settings.scan_topic, self._on_scan, SENSOR)
        self.create_subscription(TurtlebotSensorState, SENSOR_STATE, self._on_state, RELIABLE)
        self.create_subscription(Imu, IMU, self._on_gyro, RELIABLE)
        self._steps = call_every(self.timebase, STEP_PERIOD_S, self._step)

    def close(self) -> None:
        """Stop the base."""
        self._steps.cancel()
        self._commands.publish(twist_to_ros(STANDSTILL))

    def _on_scan(self, message: LaserScanMsg) -> None:
        scan = self.timed(scan_from_ros(message))
        self._missing.discard(Source.WALL)
        wall = find_wall(scan, self._wall)
        readings = self.rounds.current.readings
        if isinstance(wall, str):
            readings.take_no_wall(scan.middle_stamp, wall)
        else:
            readings.take(Source.WALL, scan.middle_stamp, wall.angle)

    def _on_state(self, message: TurtlebotSensorState) -> None:
        """Take the turn of the wheels alone: the heading of ``odom`` is the gyro's."""
        self._missing.discard(Source.ODOMETRY)
        self._turned += message.angle * self._scale
        self.rounds.current.readings.take(
            Source.ODOMETRY,
            self.time_of(stamp_from_ros(message.header.stamp)),
            math.remainder(self._turned, math.tau),
        )

    def _on_gyro(self, message: Imu) -> None:
        self._missing.discard(Source.GYRO)
        self.rounds.current.readings.take(
            Source.GYRO,
            self.time_of(stamp_from_ros(message.header.stamp)),
            yaw_from_quaternion(message.orientation),
        )

    def _step(self) -> None:
        now = self.timebase.now()
        if now <= 0.0:
            return  # the simulated time is not known yet
        if self._missing and time.monotonic() < self._begin_by:
            return
        going_on = self.rounds.current
        turns = len(going_on.turns)
        twist = self.rounds.step(now)
        for turn in going_on.turns[turns:]:
            self._on_feedback(f"    at {turn.speed:g} rad/s: {turn}")
        self._commands.publish(twist_to_ros(twist))
        if self.rounds.result is not None:
            self._steps.cancel()
            self._on_end()
        elif self.rounds.feedback != self._reported:
            self._reported = self.rounds.feedback
            self._on_feedback(self._reported)
