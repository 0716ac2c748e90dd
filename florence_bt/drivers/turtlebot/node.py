"""The ROS node of the TurtleBot's base: port, thread, messages and services around the driver."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from florence_interfaces.msg import TurtlebotSensorState
from florence_interfaces.srv import SetDigitalOutputs, SetTurtlebotMode
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry as OdometryMsg
from rclpy.context import Context
from sensor_msgs.msg import Imu

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.errors import ConfigError, DeviceError
from florence_bt.core.geometry import Pose2
from florence_bt.drivers.serial_port import BytePort, PortReader, SerialPort
from florence_bt.drivers.turtlebot.codec.packets import SensorState
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import Reading, TurtlebotDriver
from florence_bt.drivers.turtlebot.gyro import GyroReading
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.drivers.turtlebot.odometry import covariance
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.drivers.turtlebot.report import Pace, StateReport
from florence_bt.ros.conversions import odometry_to_ros, pose_to_ros, stamp_to_ros, twist_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.ros.tf import TransformBroadcaster

DIAGNOSTICS_PERIOD_S = 1.0
LONGEST_BACK_OFF = 10
IMU_COVARIANCE = [1e6, 0.0, 0.0, 0.0, 1e6, 0.0, 0.0, 0.0, 1e-6]
"""Of orientation and rate: only the turn about z is measured (REFERENCE 1.8)."""

NOT_MEASURED = [-1.0, *([0.0] * 8)]


class TurtlebotNode(FlorenceNode):
    """Drives the base by ``cmd_vel`` and publishes what it senses. Opens the port again whenever it is lost.

    Publishes ``odom``, ``imu/data``, ``~/sensor_state``, ``diagnostics`` and the transform of the base;
    serves ``~/set_digital_outputs`` and ``~/set_operation_mode``.
    Parameters: the fields of :class:`TurtlebotParameters` and :class:`TurtlebotNodeParameters`.

    Source: document, section 2.3; REFERENCE 2.1.
    """

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        context: Context | None = None,
        open_port: Callable[[str, int], BytePort] = SerialPort,
    ) -> None:
        """Make the node and try to open the port.

        Args:
            parameters: Values of parameters by name.
            namespace: Goes before the node's name and topics.
            context: The ROS context.
            open_port: Opens a path at a baud rate.
        """
        super().__init__("turtlebot_node", parameters=parameters, namespace=namespace, context=context)
        self._settings = self.read_parameters(TurtlebotNodeParameters)
        self._driver = TurtlebotDriver(self.read_parameters(TurtlebotParameters))
        self._open_port = open_port
        self._port: BytePort | None = None
        self._reader: PortReader | None = None
        self._port_problem = ""
        self._attempts = 0
        self._reading: Reading | None = None
        self._stop_reason: StopReason | None = None
        self._state_report = StateReport()
        self._odometry_pace = Pace(self._settings.update_rate)
        self._state_pace = Pace(self._settings.sensor_state_rate)
        self._make_interfaces()
        self._deadline: Timer | None = None
        self._diagnosing = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)
        self._connect()

    def close(self) -> None:
        """Stop the base, then let go of the port."""
        self._diagnosing.cancel()
        self._set_deadline(None)
        if self._port is None:
            return
        try:
            self._port.write(self._driver.shutdown())
        except DeviceError as error:
            self.get_logger().error(f"the base may still be driving: {error}")
        self._release()

    def _make_interfaces(self) -> None:
        self._odometry_topic = self.create_publisher(OdometryMsg, "odom", RELIABLE)
        self._imu_topic = self.create_publisher(Imu, "imu/data", RELIABLE)
        self._state_topic = self.create_publisher(TurtlebotSensorState, "~/sensor_state", RELIABLE)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
        self._transforms = TransformBroadcaster(self) if self._settings.publish_tf else None
        self.create_subscription(Twist, "cmd_vel", self._on_command, RELIABLE)
        self.create_service(SetDigitalOutputs, "~/set_digital_outputs", self._on_set_outputs)
        self.create_service(SetTurtlebotMode, "~/set_operation_mode", self._on_set_mode)

    # ---- port -------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        try:
            port = self._open_port(self._settings.port, self._settings.baud_rate)
        except DeviceError as error:
            self._retry_later(error)
            return
        self._port = port
        self._reader = PortReader(port, partial(self._on_data, port), partial(self._on_lost, port))
        self._reader.start()
        self.get_logger().info(f"opened {self._settings.port}")
        self._driver.start(self.timebase.now())
        self._pump()

    def _release(self) -> None:
        port, reader = self._port, self._reader
        self._port = self._reader = self._reading = None
        if reader is not None:
            reader.stop()
        if port is not None:
            port.close()

    def _lose(self, error: DeviceError) -> None:
        """Let go of a port that failed; the base is told to stop, should it still listen."""
        last_words = self._driver.shutdown()
        if self._port is not None:
            with contextlib.suppress(DeviceError):
                self._port.write(last_words)
        self._release()
        self._retry_later(error)

    def _retry_later(self, error: DeviceError) -> None:
        if str(error) != self._port_problem:
            self.get_logger().error(str(error))
        self._port_problem = str(error)
        delay = self._settings.reconnect_delay_s * min(2 ** min(self._attempts, 4), LONGEST_BACK_OFF)
        self._attempts += 1
        self._set_deadline(self.timebase.now() + delay, self._connect)

    # ---- the reader's thread ----------------------------------------------------------------------------

    def _on_data(self, port: BytePort, data: bytes) -> None:
        arrived = self.timebase.now()
        self.call_soon(lambda: self._receive(port, data, arrived))

    def _on_lost(self, port: BytePort, error: DeviceError) -> None:
        self.call_soon(lambda: self._lose(error) if port is self._port else None)

    # ---- the executor's thread --------------------------------------------------------------------------

    def _receive(self, port: BytePort, data: bytes, arrived: float) -> None:
        if port is not self._port:
            return  # left over from before the port was lost
        for reading in self._driver.receive(data, arrived):
            self._port_problem, self._attempts = "", 0
            self._reading = reading
            self._publish(reading)
        self._pump()

    def _pump(self) -> None:
        """Send what the driver wants to say, and come back when it next has something to do."""
        if self._port is None:
            return
        try:
            data = self._driver.poll(self.timebase.now())
            if data:
                self._port.write(data)
        except DeviceError as error:
            self._lose(error)
            return
        self._set_deadline(self._driver.next_deadline(), self._pump)

    def _set_deadline(self, when: float | None, callback: Callable[[], None] | None = None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None if when is None or callback is None else self.timebase.call_at(when, callback)

    def _on_command(self, message: Twist) -> None:
        refused = self._driver.refused_commands
        self._driver.command(twist_from_ros(message), self.timebase.now())
        if self._driver.refused_commands > refused:
            self.get_logger().warning(
                "a velocity command is not finite: the base stops", throttle_duration_sec=5.0
            )
        self._pump()

    def _on_set_outputs(
        self, request: SetDigitalOutputs.Request, response: SetDigitalOutputs.Response
    ) -> SetDigitalOutputs.Response:
        values = (request.digital_out_0, request.digital_out_1, request.digital_out_2)
        try:
            if self._port is None:
                raise ConfigError("the base is not connected")
            self._driver.set_digital_outputs(sum(1 << place for place, value in enumerate(values) if value))
        except ConfigError as error:
            self.get_logger().warning(f"digital outputs stay as they are: {error}")
            return response
        response.done = True
        self._pump()
        return response

    def _on_set_mode(
        self, request: SetTurtlebotMode.Request, response: SetTurtlebotMode.Response
    ) -> SetTurtlebotMode.Response:
        try:
            self._driver.set_mode(request.mode, self.timebase.now())
        except ConfigError as error:
            self.get_logger().warning(str(error))
            return response
        response.valid_mode = True
        self._pump()
        return response

    # ---- messages ---------------------------------------------------------------------------------------

    def _publish(self, reading: Reading) -> None:
        self._state_report.add(reading.state)
        if reading.stop_reason is not self._stop_reason:
            self._stop_reason = reading.stop_reason
            if self._stop_reason is not None:
                self.get_logger().warning(self._stop_reason.value)
        if self._odometry_pace.is_due(reading.stamp):
            self._publish_motion(reading)
        if self._state_pace.is_due(reading.stamp):
            self._state_topic.publish(_state_to_ros(self._state_report.take(reading.state), reading.stamp))

    def _publish_motion(self, reading: Reading) -> None:
        settings, matrix = self._settings, covariance(reading.at_rest)
        self._odometry_topic.publish(
            odometry_to_ros(reading.odometry, settings.odom_frame, settings.base_frame, matrix, matrix)
        )
        if self._transforms is not None:
            self._transforms.send(
                settings.odom_frame, settings.base_frame, reading.stamp, reading.odometry.pose
            )
        if reading.gyro is not None:
            self._imu_topic.publish(_imu_to_ros(reading.gyro, settings.gyro_frame, reading.stamp))

    def _publish_diagnostics(self) -> None:
        found = diagnose(self._driver, self._reading, self._settings.port, self._port_problem)
        message = DiagnosticArray()
        message.header.stamp = stamp_to_ros(self.timebase.now())
        message.status = [
            DiagnosticStatus(
                level=bytes([diagnosis.level]),
                name=f"{self.get_name()}: {name}",
                message=diagnosis.message,
                hardware_id="iRobot Create",
                values=[KeyValue(key=key, value=value) for key, value in diagnosis.values.items()],
            )
            for name, diagnosis in found.items()
        ]
        self._diagnostics_topic.publish(message)


def _state_to_ros(state: SensorState, stamp: float) -> TurtlebotSensorState:
    """The fields have the same names on both sides."""
    message = TurtlebotSensorState(
        **{field.name: getattr(state, field.name) for field in dataclasses.fields(state)}
    )
    message.header.stamp = stamp_to_ros(stamp)
    return message


def _imu_to_ros(gyro: GyroReading, frame_id: str, stamp: float) -> Imu:
    message = Imu(
        orientation=pose_to_ros(Pose2(yaw=gyro.yaw)).orientation,
        orientation_covariance=IMU_COVARIANCE,
        angular_velocity_covariance=IMU_COVARIANCE,
        linear_acceleration_covariance=NOT_MEASURED,
    )
    message.header.stamp = stamp_to_ros(stamp)
    message.header.frame_id = frame_id
    message.angular_velocity.z = gyro.rate
    return message
