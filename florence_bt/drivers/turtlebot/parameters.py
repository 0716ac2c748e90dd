"""The driver's and the node's parameters, by the old node's names where it had them (REFERENCE 2.2)."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import CheckedParameters, Limits, Positive
from florence_bt.drivers.turtlebot.codec.models import MODELS, Model, model_named
from florence_bt.drivers.turtlebot.gyro import GyroParameters
from florence_bt.drivers.turtlebot.odometry import OdometryParameters
from florence_bt.drivers.turtlebot.wheels import WheelParameters

OPERATION_MODES = {1: "1 for passive", 2: "2 for safe", 3: "3 for full"}
"""The modes that can be asked for."""


class DriveMode(enum.Enum):
    """The ways to send velocities (REFERENCE 2.3)."""

    TWIST = "twist"
    """As wheel speeds; where both wheels are too fast the turn wins over the advance."""
    TURTLE = "turtle"
    """As wheel speeds; a wheel that is too fast is slowed down by itself."""
    DRIVE = "drive"
    """As velocity and radius."""


@dataclass(frozen=True, slots=True)
class TurtlebotParameters(CheckedParameters):
    """Parameters of the driver.

    Attributes:
        robot_type: The base: ``create``, ``create2`` or ``roomba`` (series 500 and later).
        drive_mode: How velocities are sent: ``twist``, ``turtle`` or ``drive``.
        operation_mode: Mode to work in: 1 passive, 2 safe, 3 full.
        wheel_separation: Metres between the wheels; None for what the robot_type has.
        min_abs_yaw_vel: Slowest turn in rad/s, 0 to 3; None for no limit.
        max_abs_yaw_vel: Fastest turn in rad/s, 0 to 3; None or 0 for no limit.
        cmd_vel_timeout: Seconds after which an old velocity command is no longer driven.
        stop_motors_on_bump: Hold forward motion while a bumper is pressed or a wheel hangs in the air.
        stop_on_cliff: Hold forward motion while a cliff sensor misses the floor; the firmware does that in
            Safe mode only.
        check_acknowledgement: Hold a base that reports, for a second, other wheel speeds than were sent. Off
            for a firmware that does not report them.
        recovery_delay: Seconds without an objection before the base may return to its mode by itself.
        data_timeout: Seconds of silence after which the base counts as lost; not longer than cmd_vel_timeout,
            or a silent base would be driven for longer than one without commands.
        lowest_charge: Charge, as a fraction of the capacity, below which the base stands still, also when it
            is not known; 0 for never.
        max_gyro_disagreement: rad/s that the gyro may measure while the wheels go straight; with more the
            base stops and calibrates it. 0 for any.
        charge_reset: Reset a base that stands at a charger with a low battery and does not charge.
        has_gyro: A gyro is wired to the analog pin; of no effect on a base without that pin.
        gyro_measurement_range: Degrees per second.
        gyro_scale_correction: Calibrated factor on the gyro's rate.
        odom_linear_scale_correction: Calibrated factor on each distance.
        odom_angular_scale_correction: Calibrated factor on each angle of the wheels.
        digital_outputs: Outputs switched on with the drive mode, as bits; output 0 is the 12 V breaker that
            feeds the camera.
        oi_mode_offset: What this firmware reports its mode too high by; some Create 2 report one more.
        bonus: Play a tune when the base is ready.
    """

    robot_type: str = "create"
    drive_mode: DriveMode = DriveMode.TWIST
    operation_mode: int = 3
    wheel_separation: Positive | None = None
    min_abs_yaw_vel: Annotated[float, Limits(0.0, 3.0)] | None = None
    max_abs_yaw_vel: Annotated[float, Limits(0.0, 3.0)] | None = None
    cmd_vel_timeout: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.6
    stop_motors_on_bump: bool = True
    stop_on_cliff: bool = True
    check_acknowledgement: bool = True
    recovery_delay: Annotated[float, Limits(0.0)] = 1.0
    data_timeout: Annotated[float, Limits(0.1)] = 0.5
    lowest_charge: Annotated[float, Limits(0.0, 0.5)] = 0.02
    max_gyro_disagreement: Annotated[float, Limits(0.0)] = 0.2
    charge_reset: bool = True
    has_gyro: bool = True
    gyro_measurement_range: Annotated[float, Limits(0.0, 300.0, above=True)] = 150.0
    gyro_scale_correction: Annotated[float, Limits(0.0, 6.0)] = 1.35
    odom_linear_scale_correction: Annotated[float, Limits(0.0, 3.0)] = 1.0
    odom_angular_scale_correction: Annotated[float, Limits(0.0, 3.0)] = 1.0
    digital_outputs: Annotated[int, Limits(0, 7)] = 1
    oi_mode_offset: Annotated[int, Limits(0, 252)] = 0
    bonus: bool = False

    def _check(self) -> None:
        model_named(self.robot_type)
        if self.operation_mode not in OPERATION_MODES:
            raise ConfigError(
                f"there is no operation_mode {self.operation_mode}", valid=OPERATION_MODES.values()
            )

    @property
    def model(self) -> Model:
        """The base."""
        return MODELS[self.robot_type]

    @property
    def gyro_fitted(self) -> bool:
        """Tell whether there is a gyro to read."""
        return self.has_gyro and self.model.cargo_bay

    def wheels(self) -> WheelParameters:
        """Return the part for the wheel speeds."""
        separation = self.wheel_separation
        return WheelParameters(
            self.model.wheel_separation_m if separation is None else separation,
            self.min_abs_yaw_vel,
            self.max_abs_yaw_vel,
        )

    def gyro(self) -> GyroParameters:
        """Return the part for the gyro."""
        return GyroParameters(self.gyro_measurement_range, self.gyro_scale_correction)

    def odometry(self) -> OdometryParameters:
        """Return the part for the odometry."""
        return OdometryParameters(self.odom_linear_scale_correction, self.odom_angular_scale_correction)


@dataclass(frozen=True, slots=True)
class TurtlebotNodeParameters(CheckedParameters):
    """Parameters of the node around the driver.

    Attributes:
        port: The serial device.
        baud_rate: Bits per second; None for what the robot_type talks at.
        wake_with_rts: Wake a base that stays silent by pulses on the line RTS, where the port has one.
        reconnect_delay_s: Pause before a lost port is opened again; doubled each time, up to ten times.
        update_rate: Odometry, tf and imu per second; the base measures 66 times a second.
        sensor_state_rate: Sensor states per second (document, table 5).
        joint_state_rate: Joint states per second.
        publish_tf: Tell the transform from the odometry frame to the base. The old node left that to a
            Kalman filter; here the odometry already takes its heading from the gyro.
        odom_frame: Frame of the odometry.
        base_frame: Frame of the base.
        gyro_frame: Frame of the gyro.
        wheel_radius: Metres, for the joint states.
        legacy_imu_raw: Compute ``imu/raw`` by the old node's formula (REFERENCE 1.8).
        override_file: Exists while the manual override is on, so that it outlives restarts; empty keeps
            nothing.
    """

    port: str = "/dev/ttyUSB0"
    baud_rate: Annotated[int, Limits(300, 115200)] | None = None
    wake_with_rts: bool = True
    reconnect_delay_s: Annotated[float, Limits(0.05, 60.0)] = 0.5
    update_rate: Annotated[float, Limits(1.0, 66.0)] = 30.0
    sensor_state_rate: Annotated[float, Limits(0.1, 66.0)] = 10.0
    joint_state_rate: Annotated[float, Limits(0.1, 66.0)] = 10.0
    publish_tf: bool = True
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"
    gyro_frame: str = "gyro_link"
    wheel_radius: Annotated[float, Limits(0.001, 1.0)] = 0.033
    legacy_imu_raw: bool = False
    override_file: str = ""
