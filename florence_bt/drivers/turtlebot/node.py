"""The ROS node of the TurtleBot's base: port, thread and messages around the driver and its component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import Imu

from florence_bt.core.errors import DeviceError, DeviceTimeout
from florence_bt.core.topics import ODOMETRY
from florence_bt.drivers.driver_port import DriverPort
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.turtlebot.driver import TurtlebotDriver
from florence_bt.drivers.turtlebot.driving import BaseDriving
from florence_bt.drivers.turtlebot.messages import IMU, RAW_IMU, BaseOdometry, TurnRate
from florence_bt.drivers.turtlebot.odometry import covariance
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.ros.base_messages import gyro_to_ros
from florence_bt.ros.conversions import odometry_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts


class TurtlebotNode(FlorenceNode):
    """Drives the base by ``cmd_vel`` and publishes what it senses. Opens the port again whenever it is lost.

    While the manual override is on (``florenceLocator/manualOverride``), the base stops and obeys
    ``manual_cmd_vel`` only.

    Publishes ``odom``, ``imu/data``, ``imu/raw``, ``~/sensor_state``, ``~/stop_reason``, ``joint_states``,
    ``battery_state``, ``diagnostics``, of a Create 2 ``~/create2_sensors``, and the transform of the base;
    serves ``~/set_digital_outputs``, ``~/set_operation_mode``, ``~/set_leds``, ``~/play_song``, ``~/dock``.
    Parameters: the fields of :class:`TurtlebotParameters` and :class:`TurtlebotNodeParameters`.

    Source: document, section 2.3; REFERENCE 2.1.
    """

    parameter_classes = (TurtlebotNodeParameters, TurtlebotParameters)

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        open_port: Callable[[str, int], BytePort] = SerialPort,
    ) -> None:
        """Make the node and try to open the port.

        Args:
            parameters: Values of parameters by name.
            open_port: Opens a path at a baud rate.
        """
        super().__init__("turtlebot_node", parameters=parameters)
        settings = self._settings = self.read_parameters(TurtlebotNodeParameters)
        self._driver = TurtlebotDriver(self.read_parameters(TurtlebotParameters))
        self._rts: bool | None = None
        self._silent = False
        baud_rate = settings.baud_rate or self._driver.parameters.model.baud_rate
        self._port = DriverPort(
            self._driver,
            self.timebase,
            self.call_soon,
            lambda: open_port(settings.port, baud_rate),
            on_open=self._on_open,
            on_bytes=self._receive,
            on_lost=self._on_lost,
            on_problem=self._on_problem,
            send=self._send,
            delay_s=settings.reconnect_delay_s,
            name=settings.port,
        )
        kept = OverrideFile(Path(settings.override_file) if settings.override_file else None)
        self._driving = BaseDriving(self._ports(), self._driver, self._port, settings, kept)
        self._port.open()

    def close(self) -> None:
        """Stop the base, then release the port."""
        self._driving.close()
        if not_sent := self._port.close():
            self.get_logger().error(f"the base may still be driving: {not_sent}")

    def _ports(self) -> RosPorts:
        return RosPorts(
            self, {ODOMETRY: self._odometry_to_ros, IMU: self._gyro_to_ros, RAW_IMU: self._gyro_to_ros}
        )

    def _odometry_to_ros(self, odometry: BaseOdometry) -> OdometryMsg:
        matrix, settings = covariance(odometry.at_rest), self._settings
        return odometry_to_ros(
            self.stamped(odometry), settings.odom_frame, settings.base_frame, matrix, matrix
        )

    def _gyro_to_ros(self, turning: TurnRate) -> Imu:
        return gyro_to_ros(turning.rate, turning.yaw, self._settings.gyro_frame, self.stamp(turning.stamp))

    # ---- port -------------------------------------------------------------------------------------------

    def _on_open(self, port: BytePort) -> None:
        self.get_logger().info(f"opened {port.name}")
        # A base that answers needs no waking, and its power button would be a bad thing to press.
        wake = self._silent and self._settings.wake_with_rts and port.set_rts(True)
        self._rts = None
        self._driver.start(self.timebase.now(), wake=wake)

    def _on_lost(self, error: DeviceError) -> None:
        """Tell the base to stop, should it still listen."""
        self._silent = isinstance(error, DeviceTimeout)
        self._driving.forget()
        shutdown_command, port = self._driver.shutdown(), self._port.device
        try:
            if port is not None:
                port.write(shutdown_command)
        except DeviceError as not_sent:
            self.get_logger().debug(f"the base did not receive the command to stop: {not_sent}")

    def _on_problem(self, problem: str) -> None:
        self.get_logger().error(problem)
        self._driving.lost(problem)

    def _receive(self, data: bytes, arrived: float) -> None:
        """Take what the base sent: what stops it is sent first, then published, before the next command."""
        readings = self._driver.receive(data, arrived)
        if readings:
            self._silent = False
        self._driving.take(readings)

    def _send(self, port: BytePort, data: bytes) -> None:
        if data:
            port.write(data)
        if self._driver.rts is not None and self._driver.rts is not self._rts:
            self._rts = self._driver.rts
            port.set_rts(self._rts)

    # ---- trouble ----------------------------------------------------------------------------------------

    def on_failure(self, reason: str) -> None:
        """Stop the base until the next good command."""
        self._driving.fail()

    def on_refused(self, topic: str) -> None:
        """Stop the base on a command that makes no sense."""
        self.on_failure(f"a message on {topic} was refused")
