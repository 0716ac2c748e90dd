"""The ROS node of the TurtleBot's base: port, thread, messages and services around the driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from florence_interfaces.msg import Create2Sensors, TurtlebotSensorState
from florence_interfaces.msg import StopReason as StopReasonMsg
from florence_interfaces.srv import PlaySong, SetDigitalOutputs, SetLeds, SetTurtlebotMode
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_srvs.srv import SetBool

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError, DeviceError, DeviceTimeout
from florence_bt.core.geometry import STANDSTILL
from florence_bt.core.topic_names import (
    BATTERY_STATE,
    CMD_VEL,
    IMU,
    JOINT_STATES,
    MANUAL_CMD_VEL,
    ODOMETRY,
    RAW_IMU,
)
from florence_bt.drivers.driver_port import DriverPort
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.turtlebot.battery import battery_of, is_full
from florence_bt.drivers.turtlebot.codec.packets import ChargingState
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.drivers.turtlebot.odometry import JOINT_NAMES, WheelJoints, covariance
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.drivers.turtlebot.override_switch import BaseWord, OverrideSwitch
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.drivers.turtlebot.report import RateLimiter, StateReport
from florence_bt.ros.base_messages import battery_to_ros, gyro_to_ros, joints_to_ros
from florence_bt.ros.conversions import odometry_to_ros, stamp_to_ros, twist_from_ros
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import COMMAND, LATCHED, RELIABLE
from florence_bt.ros.tf import TransformBroadcaster

DIAGNOSTICS_PERIOD_S = 1.0
SILENT_S = 0.5
"""Seconds without a frame of the base after which it is not said to stand; one comes each 15 ms."""
CHARGING = (ChargingState.RECOVERY, ChargingState.CHARGING, ChargingState.TRICKLE)
STATE_FIELDS, CREATE_2_FIELDS = (
    tuple(name for name in message.get_fields_and_field_types() if name != "header")
    for message in (TurtlebotSensorState, Create2Sensors)
)
"""They have the same names in :class:`SensorState`."""


class TurtlebotNode(FlorenceNode):
    """Drives the base by ``cmd_vel`` and publishes what it senses. Opens the port again whenever it is lost.

    While the manual override is on (``florenceLocator/manualOverride``), the base stops and obeys
    ``manual_cmd_vel`` only. This node alone says whether it is on (:class:`OverrideSwitch`): it acts where
    the wheels are, needs no other process, and is kept over restarts.

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
        self._settings = self.read_parameters(TurtlebotNodeParameters)
        parameters_of_driver = self.read_parameters(TurtlebotParameters)
        self._driver = TurtlebotDriver(parameters_of_driver)
        self._rts: bool | None = None
        self._silent = False
        self._reading: BaseReading | None = None
        self._stop_reason: StopReason | None = None
        self._published_stop: tuple[str, str] | None = None
        self._state_report = StateReport()
        self._joints = WheelJoints(
            self._settings.wheel_radius, parameters_of_driver.wheels().wheel_separation
        )
        self._odometry_limiter = RateLimiter(self._settings.update_rate)
        self._state_limiter = RateLimiter(self._settings.sensor_state_rate)
        self._joint_limiter = RateLimiter(self._settings.joint_state_rate)
        self._make_interfaces()
        self._diagnosing = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)
        baud_rate = self._settings.baud_rate or parameters_of_driver.model.baud_rate
        self._port = DriverPort(
            self._driver,
            self.timebase,
            self.call_soon,
            lambda: open_port(self._settings.port, baud_rate),
            on_open=self._on_open,
            on_bytes=self._receive,
            on_lost=self._on_lost,
            on_problem=self._on_problem,
            send=self._send,
            delay_s=self._settings.reconnect_delay_s,
            name=self._settings.port,
        )
        file = self._settings.override_file
        kept = OverrideFile(Path(file) if file else None)
        self._override = OverrideSwitch(self, kept, self._give_to_person, self._word)
        self._driver.manual_override = self._override.on
        self._port.open()

    def close(self) -> None:
        """Stop the base, then release the port."""
        self._diagnosing.cancel()
        if not_sent := self._port.close():
            self.get_logger().error(f"the base may still be driving: {not_sent}")

    def _make_interfaces(self) -> None:
        self._odometry_topic = self.create_publisher(OdometryMsg, ODOMETRY, RELIABLE)
        self._imu_topic = self.create_publisher(Imu, IMU, RELIABLE)
        self._raw_imu_topic = self.create_publisher(Imu, RAW_IMU, RELIABLE)
        self._state_topic = self.create_publisher(TurtlebotSensorState, "~/sensor_state", RELIABLE)
        self._stop_topic = self.create_publisher(StopReasonMsg, "~/stop_reason", LATCHED)
        self._joint_topic = self.create_publisher(JointState, JOINT_STATES, RELIABLE)
        self._battery_topic = self.create_publisher(BatteryState, BATTERY_STATE, LATCHED)
        self._diagnostics_topic = diagnostics_publisher(self)
        self._transforms = TransformBroadcaster(self) if self._settings.publish_tf else None
        self.create_subscription(Twist, CMD_VEL, self._on_command, COMMAND)
        self.create_subscription(Twist, MANUAL_CMD_VEL, self._on_manual_command, COMMAND)
        self.create_service(SetDigitalOutputs, "~/set_digital_outputs", self._on_set_outputs)
        self.create_service(SetTurtlebotMode, "~/set_operation_mode", self._on_set_mode)
        self._create_2_topic = (
            None
            if self._driver.parameters.model.metres_per_tick is None
            else self.create_publisher(Create2Sensors, "~/create2_sensors", RELIABLE)
        )
        self.create_service(SetLeds, "~/set_leds", self._on_leds)
        self.create_service(PlaySong, "~/play_song", self._on_song)
        self.create_service(SetBool, "~/dock", self._on_dock)

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
        self._reading = None
        shutdown_command, port = self._driver.shutdown(), self._port.device
        try:
            if port is not None:
                port.write(shutdown_command)
        except DeviceError as not_sent:
            self.get_logger().debug(f"the base did not receive the command to stop: {not_sent}")

    def _on_problem(self, problem: str) -> None:
        self.get_logger().error(problem)
        self._publish_stop(StopReason.NO_RESPONSE.code, problem)
        self._publish_diagnostics()

    def _receive(self, data: bytes, arrived: float) -> None:
        """Take what the base sent: what stops it is sent first, then published, before the next command."""
        readings = self._driver.receive(data, arrived)
        self._port.pump()
        for reading in readings:
            self._silent = False
            self._port.works()
            self._reading = reading
            self._publish(reading)

    def _send(self, port: BytePort, data: bytes) -> None:
        if data:
            port.write(data)
        if self._driver.rts is not None and self._driver.rts is not self._rts:
            self._rts = self._driver.rts
            port.set_rts(self._rts)

    # ---- trouble ----------------------------------------------------------------------------------------

    def on_failure(self, reason: str) -> None:
        """Stop the base until the next good command."""
        self._driver.command(STANDSTILL, self.timebase.now(), manual=self._driver.manual_override)
        self._port.pump()

    def on_refused(self, topic: str) -> None:
        """Stop the base on a command that makes no sense."""
        self.on_failure(f"a message on {topic} was refused")

    # ---- commands ---------------------------------------------------------------------------------------

    def _give_to_person(self, on: bool) -> None:
        """Give the base to a person, or back; the wheels have their zero when this returns."""
        self._driver.set_manual_override(on, self.timebase.now())
        self._port.pump()

    def _word(self) -> BaseWord:
        now, reading = self.timebase.now(), self._reading
        problem = self._port.problem
        if reading is None or now - reading.stamp > SILENT_S:
            problem = problem or "the base says nothing"
        elif reading.stop_reason is StopReason.NO_RESPONSE:
            problem = reading.stop_text
        standing = reading is not None and reading.at_rest and not problem
        return BaseWord(standing, self._driver.driven_by_hand(now), problem)

    def _on_command(self, message: Twist) -> None:
        self._command(message, manual=False)

    def _on_manual_command(self, message: Twist) -> None:
        self._command(message, manual=True)

    def _command(self, message: Twist, *, manual: bool) -> None:
        refused = self._driver.refused_commands
        self._driver.command(twist_from_ros(message), self.timebase.now(), manual=manual)
        if self._driver.refused_commands > refused:
            self.get_logger().warning(
                "a velocity command is not finite: the base stops", throttle_duration_sec=5.0
            )
        self._port.pump()

    def _on_set_outputs(
        self, request: SetDigitalOutputs.Request, response: SetDigitalOutputs.Response
    ) -> SetDigitalOutputs.Response:
        values = (request.digital_out_0, request.digital_out_1, request.digital_out_2)
        bits = sum(1 << place for place, value in enumerate(values) if value)
        response.done = not self._refusal(lambda: self._driver.set_digital_outputs(bits))
        return response

    def _on_set_mode(
        self, request: SetTurtlebotMode.Request, response: SetTurtlebotMode.Response
    ) -> SetTurtlebotMode.Response:
        now = self.timebase.now()
        response.valid_mode = not self._refusal(
            lambda: self._driver.set_mode(request.mode, now), when_connected=False
        )
        return response

    def _on_leds(self, request: SetLeds.Request, response: SetLeds.Response) -> SetLeds.Response:
        colour, intensity = request.power_colour, request.power_intensity
        return self._answer(response, lambda: self._driver.set_leds(request.leds, colour, intensity))

    def _on_song(self, request: PlaySong.Request, response: PlaySong.Response) -> PlaySong.Response:
        notes, durations_s = list(request.notes), list(request.durations)
        return self._answer(response, lambda: self._driver.play_song(notes, durations_s))

    def _on_dock(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        now = self.timebase.now()
        return self._answer(
            response, lambda: self._driver.dock(now) if request.data else self._driver.end_docking(now)
        )

    def _answer(self, response: Any, act: Callable[[], None]) -> Any:
        response.message = self._refusal(act)
        response.success = not response.message
        return response

    def _refusal(self, act: Callable[[], None], *, when_connected: bool = True) -> str:
        """Act on the base; why it was refused, empty when it was not. A refusal is also logged."""
        try:
            if when_connected and self._port.device is None:
                raise ConfigError("the base is not connected")
            act()
        except ConfigError as error:
            self.get_logger().warning(str(error))
            return str(error)
        self._port.pump()
        return ""

    # ---- messages ---------------------------------------------------------------------------------------

    def _publish(self, reading: BaseReading) -> None:
        self._state_report.add(reading.state)
        self._joints.add(reading.state)
        news = reading.stop_reason is not self._stop_reason
        if news:
            self._stop_reason = reading.stop_reason
            if self._stop_reason is not None:
                self.get_logger().warning(reading.stop_text)
        self._publish_stop("" if reading.stop_reason is None else reading.stop_reason.code, reading.stop_text)
        stamp = self.stamp(reading.stamp)
        if self._odometry_limiter.is_due(reading.stamp):
            self._publish_motion(reading, stamp)
        if self._joint_limiter.is_due(reading.stamp):
            self._publish_joints(reading, stamp)
        if self._state_limiter.is_due(reading.stamp) or news:
            state = self._state_report.take(reading.state)
            if self._state_topic.get_subscription_count():
                self._state_topic.publish(_state_to_ros(state, stamp))
            self._publish_create_2(reading, stamp)
        if news:
            self._publish_diagnostics()

    def _publish_create_2(self, reading: BaseReading, stamp: float) -> None:
        if self._create_2_topic is not None:
            message = Create2Sensors(**{name: getattr(reading.state, name) for name in CREATE_2_FIELDS})
            message.header.stamp = stamp_to_ros(stamp)
            self._create_2_topic.publish(message)

    def _publish_stop(self, code: str, text: str) -> None:
        """Say what holds the base, once for each change."""
        if self._published_stop == (code, text):
            return
        self._published_stop = (code, text)
        message = StopReasonMsg(code=code, text=text)
        message.header.stamp = stamp_to_ros(self.stamp())
        self._stop_topic.publish(message)

    def _publish_motion(self, reading: BaseReading, stamp: float) -> None:
        settings, matrix = self._settings, covariance(reading.at_rest)
        self._odometry_topic.publish(
            odometry_to_ros(
                self.stamped(reading.odometry), settings.odom_frame, settings.base_frame, matrix, matrix
            )
        )
        if self._transforms is not None:
            self._transforms.send(
                settings.odom_frame, settings.base_frame, reading.stamp, reading.odometry.pose
            )
        gyro = reading.gyro
        if gyro is None:
            return
        if self._imu_topic.get_subscription_count():
            self._imu_topic.publish(gyro_to_ros(gyro.rate, gyro.yaw, settings.gyro_frame, stamp))
        if self._raw_imu_topic.get_subscription_count():
            raw = (
                (gyro.legacy_raw_rate, gyro.legacy_raw_yaw)
                if settings.legacy_imu_raw
                else (gyro.raw_rate, gyro.raw_yaw)
            )
            self._raw_imu_topic.publish(gyro_to_ros(*raw, settings.gyro_frame, stamp))

    def _publish_joints(self, reading: BaseReading, stamp: float) -> None:
        twist = reading.odometry.twist
        velocities = self._joints.velocities(twist.linear, twist.angular)
        self._joint_topic.publish(joints_to_ros(JOINT_NAMES, self._joints.positions, velocities, stamp))

    def _publish_diagnostics(self) -> None:
        found = diagnose(self._driver, self._reading, self._settings.port, self._port.problem)
        hardware = self._driver.parameters.model.name
        self._diagnostics_topic.publish(diagnostics_to_ros(found, self.get_name(), hardware, self.stamp()))
        if self._reading is not None:
            self._battery_topic.publish(_battery_to_ros(self._reading, self.stamp(self._reading.stamp)))


def _state_to_ros(state: SensorState, stamp: float) -> TurtlebotSensorState:
    message = TurtlebotSensorState(**{name: getattr(state, name) for name in STATE_FIELDS})
    message.header.stamp = stamp_to_ros(stamp)
    return message


def _battery_to_ros(reading: BaseReading, stamp: float) -> BatteryState:
    state, battery = reading.state, battery_of(reading.state)
    return battery_to_ros(
        voltage_v=battery.voltage_v,
        current_a=battery.current_a,
        temperature_c=battery.temperature_c,
        charge_ah=battery.charge_ah,
        capacity_ah=battery.capacity_ah,
        fraction=battery.fraction,
        charging=state.charging_state in CHARGING,
        full=is_full(state),
        plugged=state.charging_sources_available != 0,
        failed=state.charging_state == ChargingState.FAULT,
        stamp=stamp,
    )
