"""The driver's and the node's parameters, by the old node's names where it had them (REFERENCE 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.gyro import GyroParameters
from florence_bt.drivers.turtlebot.odometry import OdometryParameters
from florence_bt.drivers.turtlebot.wheels import WheelParameters

OPERATION_MODES = {1: "1 for passive", 2: "2 for safe", 3: "3 for full"}
"""The modes that can be asked for."""


@dataclass(frozen=True, slots=True)
class TurtlebotParameters:
    """What the driver may be told.

    Attributes:
        operation_mode: Mode to work in: 1 passive, 2 safe, 3 full.
        wheel_separation: Metres between the wheels.
        min_abs_yaw_vel: Slowest turn in rad/s, 0 to 3; None for no limit.
        max_abs_yaw_vel: Fastest turn in rad/s, 0 to 3; None or 0 for no limit.
        cmd_vel_timeout: Seconds after which an old velocity command is no longer driven.
        stop_motors_on_bump: Hold forward motion while a bumper is pressed or a wheel hangs in the air.
        stop_on_cliff: Hold forward motion while a cliff sensor misses the floor; the firmware does that in
            Safe mode only.
        recovery_delay: Seconds without an objection before the base may return to its mode by itself.
        data_timeout: Seconds of silence after which the base counts as lost.
        has_gyro: A gyro is wired to the analog pin.
        gyro_measurement_range: Degrees per second.
        gyro_scale_correction: Calibrated factor on the gyro's rate.
        odom_linear_scale_correction: Calibrated factor on each distance.
        odom_angular_scale_correction: Calibrated factor on each angle of the wheels.
        digital_outputs: Outputs switched on with the drive mode, as bits; output 0 is the 12 V breaker that
            feeds the camera.
    """

    operation_mode: int = 3
    wheel_separation: float = 0.260
    min_abs_yaw_vel: float | None = None
    max_abs_yaw_vel: float | None = None
    cmd_vel_timeout: float = 0.6
    stop_motors_on_bump: bool = True
    stop_on_cliff: bool = True
    recovery_delay: float = 1.0
    data_timeout: float = 1.0
    has_gyro: bool = True
    gyro_measurement_range: float = 150.0
    gyro_scale_correction: float = 1.35
    odom_linear_scale_correction: float = 1.0
    odom_angular_scale_correction: float = 1.0
    digital_outputs: int = 1

    def __post_init__(self) -> None:
        if self.operation_mode not in OPERATION_MODES:
            raise ConfigError(
                f"there is no operation_mode {self.operation_mode}", valid=OPERATION_MODES.values()
            )
        if not 0.0 < self.cmd_vel_timeout <= 1.0:
            raise ConfigError(
                f"cmd_vel_timeout must be above 0 and at most 1 s, not {self.cmd_vel_timeout}: "
                "the base itself never stops by itself"
            )
        if not self.data_timeout >= 0.1:
            raise ConfigError(f"data_timeout must be at least 0.1 s, not {self.data_timeout}")
        if not self.recovery_delay >= 0.0:
            raise ConfigError(f"recovery_delay must be at least 0 s, not {self.recovery_delay}")
        if not 0 <= self.digital_outputs <= 7:
            raise ConfigError(f"digital_outputs must be 0 to 7 (three bits), not {self.digital_outputs}")
        self.wheels()
        self.gyro()
        self.odometry()

    def wheels(self) -> WheelParameters:
        """The part for the wheel speeds."""
        return WheelParameters(self.wheel_separation, self.min_abs_yaw_vel, self.max_abs_yaw_vel)

    def gyro(self) -> GyroParameters:
        """The part for the gyro."""
        return GyroParameters(self.gyro_measurement_range, self.gyro_scale_correction)

    def odometry(self) -> OdometryParameters:
        """The part for the odometry."""
        return OdometryParameters(self.odom_linear_scale_correction, self.odom_angular_scale_correction)


@dataclass(frozen=True, slots=True)
class TurtlebotNodeParameters:
    """What the node around the driver may be told.

    Attributes:
        port: The serial device.
        baud_rate: Bits per second; a Create talks at 57600.
        reconnect_delay_s: Pause before a lost port is opened again; doubled each time, up to ten times.
        update_rate: Odometry, tf and imu per second; the base measures 66 times a second.
        sensor_state_rate: Sensor states per second (document, table 5).
        publish_tf: Tell the transform from the odometry frame to the base. The old node left that to a
            Kalman filter; here the odometry already takes its heading from the gyro.
        odom_frame: Frame of the odometry.
        base_frame: Frame of the base.
        gyro_frame: Frame of the gyro.
    """

    port: str = "/dev/ttyUSB0"
    baud_rate: int = 57600
    reconnect_delay_s: float = 0.5
    update_rate: float = 30.0
    sensor_state_rate: float = 10.0
    publish_tf: bool = True
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"
    gyro_frame: str = "gyro_link"

    def __post_init__(self) -> None:
        for name, lowest, highest in (
            ("baud_rate", 300, 115200),
            ("reconnect_delay_s", 0.05, 60.0),
            ("update_rate", 1.0, 66.0),
            ("sensor_state_rate", 0.1, 66.0),
        ):
            if not lowest <= getattr(self, name) <= highest:
                raise ConfigError(f"{name} must be {lowest} to {highest}, not {getattr(self, name)}")
