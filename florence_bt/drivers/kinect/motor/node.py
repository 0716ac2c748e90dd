"""The ROS node of the Kinect's motor, light and accelerometer, with the topics of kinect_aux."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sensor_msgs.msg import Imu
from std_msgs.msg import Float64, UInt8, UInt16

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.diagnosis import DIAGNOSTICS_PERIOD_S
from florence_bt.drivers.kinect.motor import codec
from florence_bt.drivers.kinect.motor.driver import MotorParameters, diagnose, tilt_warning
from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
from florence_bt.ros.conversions import header_to_ros
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR

COVARIANCE = 0.01
"""(m/s²)², of each axis."""
NAMESPACE = "kinect_aux"


class KinectMotorNode(FlorenceNode):
    """Tilts the head, sets the light, and publishes angle, status and acceleration while somebody listens.

    Opens the device again, with growing pauses, whenever it is lost; the last wishes are sent again then.

    Parameters: the fields of :class:`MotorParameters`.

    Source: document, table 4; REFERENCE 5.5, 5.6.
    """

    parameter_classes = (MotorParameters,)

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        open_motor: Callable[[int], UsbMotor] = UsbMotor,
    ) -> None:
        """Make the node and try to open the device.

        Args:
            parameters: Values of parameters by name.
            open_motor: Opens the motor of the Kinect with that number.
        """
        super().__init__("kinect_aux", parameters=parameters)
        self._settings = self.read_parameters(MotorParameters)
        self._state: codec.MotorState | None = None
        self._requests_by_kind: dict[int, codec.MotorRequest] = {}
        self._imu = self.create_publisher(Imu, f"{NAMESPACE}/imu", SENSOR)
        self._angle = self.create_publisher(Float64, f"{NAMESPACE}/cur_tilt_angle", RELIABLE)
        self._status = self.create_publisher(UInt8, f"{NAMESPACE}/cur_tilt_status", RELIABLE)
        self._diagnostics = diagnostics_publisher(self)
        self.create_subscription(Float64, f"{NAMESPACE}/tilt_angle", self._on_tilt, RELIABLE)
        for name in ("led_option", "led_options"):  # kinect_aux's name and the document's
            self.create_subscription(UInt16, f"{NAMESPACE}/{name}", self._on_led, RELIABLE)
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
        self._connection: Connection[UsbMotor, codec.MotorState] = Connection(
            self.timebase,
            self.call_soon,
            partial(open_motor, self._settings.device_index),
            on_open=self._on_open,
            on_item=self._on_state,
            on_lost=lambda _error: None,
            on_problem=lambda problem: self.get_logger().error(problem),
            delay_s=self._settings.reconnect_delay_s,
            name="the Kinect's motor",
        )
        self._connection.open()

    def close(self) -> None:
        """Let go of the device; the head stays where it is."""
        self._reports.cancel()
        self._connection.close()

    def _on_open(self, motor: UsbMotor) -> None:
        for request in self._requests_by_kind.values():
            motor.send(request)
        self.get_logger().info("the Kinect's motor is open")

    def _on_tilt(self, message: Float64) -> None:
        try:
            request = codec.tilt_request(message.data)
        except ConfigError as error:
            self.get_logger().warning(str(error))
            return
        warning = tilt_warning(message.data)
        if warning:
            self.get_logger().warning(warning)
        self._send(request)

    def _on_led(self, message: UInt16) -> None:
        try:
            self._send(codec.led_request(message.data))
        except ConfigError as error:
            self.get_logger().warning(str(error))

    def _send(self, request: codec.MotorRequest) -> None:
        self._requests_by_kind[request.request] = request
        if self._connection.device is not None:
            self._connection.device.send(request)

    def _on_state(self, state: codec.MotorState, arrived: float) -> None:
        self._connection.works()
        self._state = state
        if self._imu.get_subscription_count():
            self._imu.publish(self._imu_message(state, arrived))
        if state.tilt_deg is not None and self._angle.get_subscription_count():
            self._angle.publish(Float64(data=state.tilt_deg))
        if self._status.get_subscription_count():
            self._status.publish(UInt8(data=state.status))

    def _imu_message(self, state: codec.MotorState, arrived: float) -> Imu:
        message = Imu(header=header_to_ros(self._settings.frame_id, self.stamp(arrived)))
        acceleration = message.linear_acceleration
        acceleration.x, acceleration.y, acceleration.z = state.acceleration
        message.linear_acceleration_covariance[[0, 4, 8]] = COVARIANCE
        message.angular_velocity_covariance[0] = -1.0
        message.orientation_covariance[0] = -1.0
        return message

    def _report(self) -> None:
        found = {"Kinect Motor": diagnose(self._state, self._connection.problem, self._connection.lost)}
        self._diagnostics.publish(diagnostics_to_ros(found, self.get_name(), "Kinect motor", self.stamp()))
