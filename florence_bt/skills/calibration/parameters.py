"""Parameters of the calibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import Limits, Positive, check_limits


@dataclass(frozen=True, slots=True)
class CalibrationParameters:
    """How the base is turned and what counts as calibrated.

    Attributes:
        has_gyro: Whether the gyro is calibrated too (document: ``turtlebot_node/has_gyro``).
        speeds: Turning speeds of the measurements in rad/s, counter-clockwise (REFERENCE 3.3).
        initial_wall_angle: The robot looks straight at the wall when the angle is at most this, radians
            (REFERENCE 3.1: ``inital_wall_angle``).
        align_speed: Turning speed towards the wall, rad/s (REFERENCE 3.3, step 2a).
        braking: How fast a turn ends, rad/s^2: what the velocity filter allows (document, table 8).
        imu_calibrate_time: Seconds at rest to measure the gyro's drift (REFERENCE 3.3, step 1).
        settle: Every sensor must have spoken this long after a stop before it counts, seconds (step 2b).
        near: The calibration is over when both factors are within this of 1 (REFERENCE 3.3, stop rule).
        rounds: How often it is repeated at most (REFERENCE 3.3, stop rule).
        patience: How long any sensor may be silent, seconds.
    """

    has_gyro: bool = True
    speeds: tuple[float, ...] = (0.3, 0.7, 1.0, 1.5)
    initial_wall_angle: Positive = 0.1
    align_speed: Positive = 0.3
    braking: Positive = 1.0
    imu_calibrate_time: Positive = 10.0
    settle: Positive = 0.5
    near: Positive = 0.01
    rounds: Annotated[int, Limits(1, 20)] = 5
    patience: Positive = 5.0

    def __post_init__(self) -> None:
        check_limits(self)
        if not self.speeds or not all(0.05 <= speed <= 3.0 for speed in self.speeds):
            raise ConfigError(
                f"speeds is {self.speeds}", valid=("[0.3, 0.7, 1.0, 1.5], each 0.05 to 3 rad/s",)
            )
