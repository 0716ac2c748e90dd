"""Dead reckoning from wheels and gyro, encoders of a Create 2, wheel joints (REFERENCE 1.1, 2.1, 2.5)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot.codec.commands import MAX_WHEEL_SPEED_MMPS
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.gyro import Gyro, GyroParameters, GyroReading

TOP_SPEED_MPS = MAX_WHEEL_SPEED_MMPS / 1000.0
MAX_TURN_RADPS = 2.0 * TOP_SPEED_MPS / 0.235
"""The fastest turn of any of these bases (REFERENCE 1.1)."""

MAX_STEP_M, MAX_STEP_RAD = 0.25, 0.5
"""Larger steps within one frame are not motion, whatever the base counts. Chosen: half a second at full speed
and of a usual turn, which frames that a full port has lost can hide. The old node, which asked for a
reading a few times a second, took up to 1 m and 1 rad (REFERENCE 2.4, row 4)."""

LONGEST_GYRO_STEP_S = 0.25
"""Over a longer gap the rate of one moment says nothing; the angle of the wheels then serves."""


@dataclass(frozen=True, slots=True)
class OdometryParameters(CheckedParameters):
    """Calibration of the wheels.

    Attributes:
        linear_scale: Factor on each distance, 0 to 3.
        angular_scale: Factor on each angle of the wheels, 0 to 3; the gyro has its own.
        twist_window_s: The velocity is the mean over this time: over one frame of 15 ms, whole millimetres
            and the jitter of arrival would make it useless.
    """

    linear_scale: Annotated[float, Limits(0.0, 3.0)] = 1.0
    angular_scale: Annotated[float, Limits(0.0, 3.0)] = 1.0
    twist_window_s: float = 0.1


class WheelOdometry:
    """Adds up steps of the base into a pose."""

    def __init__(self, parameters: OdometryParameters | None = None) -> None:
        self._parameters = parameters or OdometryParameters()
        self._pose = Pose2()
        self._stamp: float | None = None
        self._steps: deque[tuple[float, float, float]] = deque()

    def update(
        self, stamp: float, distance_m: float, angle_rad: float, gyro_rate: float | None = None
    ) -> Odometry:
        """Add one step, as an arc (mid-point rule).

        Args:
            stamp: End of the step in seconds.
            distance_m: Forward travel since the last step, by the wheels.
            angle_rad: Turn since the last step, by the wheels.
            gyro_rate: Turning rate in rad/s now; None takes the heading from the wheels.

        Returns:
            The new pose in the odom frame and the velocity.

        Raises:
            FrameError: The step is more than the base can do; the pose stays as it was.
        """
        duration = 0.0 if self._stamp is None else stamp - self._stamp
        self._stamp = stamp
        _refuse_jump(distance_m, angle_rad, duration)
        distance = distance_m * self._parameters.linear_scale
        if gyro_rate is not None and duration <= LONGEST_GYRO_STEP_S:
            turn = gyro_rate * duration
        else:
            turn = angle_rad * self._parameters.angular_scale
        step = Pose2(distance * math.cos(turn / 2.0), distance * math.sin(turn / 2.0), turn)
        self._pose = self._pose @ step
        self._steps.append((stamp, distance, turn))
        return Odometry(stamp, self._pose, self._mean_twist())

    def _mean_twist(self) -> Twist2:
        """Return the velocity over the window, from the end of its first step; zero without a duration."""
        newest = self._steps[-1][0]
        while len(self._steps) > 2 and newest - self._steps[1][0] >= self._parameters.twist_window_s:
            self._steps.popleft()
        duration = newest - self._steps[0][0]
        if duration <= 0.0:
            return STANDSTILL
        first_distance, first_turn = self._steps[0][1:]
        return Twist2(
            (sum(step[1] for step in self._steps) - first_distance) / duration,
            (sum(step[2] for step in self._steps) - first_turn) / duration,
        )


def _refuse_jump(distance_m: float, angle_rad: float, duration_s: float) -> None:
    """Raise FrameError for a step beyond one read's limit and what the duration explains."""
    if abs(distance_m) > MAX_STEP_M + TOP_SPEED_MPS * duration_s:
        raise FrameError(f"a step of {distance_m:.3f} m in {duration_s:.3f} s is not motion of this base")
    if abs(angle_rad) > MAX_STEP_RAD + MAX_TURN_RADPS * duration_s:
        raise FrameError(f"a turn of {angle_rad:.3f} rad in {duration_s:.3f} s is not motion of this base")


@dataclass(frozen=True, slots=True)
class Motion:
    """The motion of the base, by its own sensors.

    Attributes:
        odometry: Pose in the odom frame and velocity.
        gyro: The gyro's reading, None without a gyro or before its rest offset is known.
        at_rest: The wheels are commanded to stand still and do.
    """

    odometry: Odometry
    gyro: GyroReading | None
    at_rest: bool


class MotionEstimator:
    """Wheels for the distance, gyro for the heading: the driver and the in-process rig both use this."""

    def __init__(
        self,
        odometry: OdometryParameters | None = None,
        gyro: GyroParameters | None = None,
        *,
        has_gyro: bool = True,
    ) -> None:
        self._odometry = WheelOdometry(odometry)
        self._gyro = Gyro(gyro) if has_gyro else None

    @property
    def gyro(self) -> Gyro | None:
        """The gyro, None when there is none."""
        return self._gyro

    def update(
        self, stamp: float, distance_m: float, angle_rad: float, analog_input: int, *, wheels_stopped: bool
    ) -> Motion:
        """Take one set of readings.

        Args:
            stamp: Seconds.
            distance_m: Forward travel since the last call, by the wheels.
            angle_rad: Turn since the last call, by the wheels.
            analog_input: The gyro in counts, 0 to 1023.
            wheels_stopped: Both wheels are commanded to stand still.

        Raises:
            FrameError: The step is more than the base can do.
        """
        at_rest = wheels_stopped and distance_m == 0.0 and angle_rad == 0.0
        gyro = self._gyro.update(stamp, analog_input, at_rest) if self._gyro else None
        rate = None
        if gyro is not None:
            # At rest the rate is noise around an offset that is still being learnt: the heading holds.
            rate = 0.0 if gyro.resting else gyro.rate
        return Motion(self._odometry.update(stamp, distance_m, angle_rad, rate), gyro, at_rest)


def covariance(at_rest: bool) -> tuple[float, ...]:
    """Return the 6x6 row-major covariance of pose and twist (x, y, z, roll, pitch, yaw).

    Source: REFERENCE 2.5; the entry that the old node misplaced at rest sits on the diagonal here.
    """
    plane, yaw = (1e-9, 1e-9) if at_rest else (1e-3, 1e3)
    diagonal = (plane, plane, 1e6, 1e6, 1e6, yaw)
    return tuple(diagonal[row] if row == column else 0.0 for row in range(6) for column in range(6))


ENCODER_ROUND = 65536
"""Counts after which an encoder begins again at 0."""

MOST_TICKS_TO_ZERO = 100
"""Two wheels that come to 0 at the same moment, from further away than they turn between two frames (17
counts at full speed), did not roll there: a base begins at 0 when it is switched on or reset."""


def ticks_between(before: int, after: int) -> int:
    """Return the counts from one reading to the next, across the wrap, by the shorter way.

    Args:
        before: 0 to 65535.
        after: 0 to 65535.
    """
    return (after - before + ENCODER_ROUND // 2) % ENCODER_ROUND - ENCODER_ROUND // 2


class EncoderTravel:
    """Distance and turn between readings of both encoders."""

    def __init__(self, metres_per_tick: float, wheel_separation_m: float) -> None:
        """Take the geometry.

        Args:
            metres_per_tick: Travel of a wheel per count.
            wheel_separation_m: Metres between the wheels, above zero.
        """
        self._metres_per_tick = metres_per_tick
        self._separation_m = wheel_separation_m
        self._counts: tuple[int, int] | None = None

    def update(self, left: int, right: int) -> tuple[float, float]:
        """Take a reading.

        Args:
            left: Counts of the left wheel, 0 to 65535.
            right: Counts of the right wheel.

        Returns:
            Metres forward and radians counter-clockwise since the last reading; zero at the first, and when
            the base was switched off and on meanwhile.
        """
        before, self._counts = self._counts or (left, right), (left, right)
        ticks = ticks_between(before[0], left), ticks_between(before[1], right)
        if left == right == 0 and max(map(abs, ticks)) > MOST_TICKS_TO_ZERO:
            ticks = 0, 0
        left_m, right_m = (tick * self._metres_per_tick for tick in ticks)
        return (left_m + right_m) / 2.0, (right_m - left_m) / self._separation_m


JOINT_NAMES = ("left_wheel_joint", "right_wheel_joint", "front_castor_joint", "back_castor_joint")
"""As the old node named them (REFERENCE 2.1); the castors are fixed."""


class WheelJoints:
    """Adds up the travel of each wheel.

    Attributes:
        positions: Radians, in the order of the names.
    """

    def __init__(self, wheel_radius_m: float, wheel_separation_m: float) -> None:
        self._radius_m = wheel_radius_m
        self._half_m = wheel_separation_m / 2.0
        self.positions = [0.0, 0.0, 0.0, 0.0]

    def add(self, state: SensorState) -> None:
        """Take the travel since the last state."""
        self.positions[0] += (state.distance - state.angle * self._half_m) / self._radius_m
        self.positions[1] += (state.distance + state.angle * self._half_m) / self._radius_m

    def velocities(self, linear: float, angular: float) -> list[float]:
        """Return the turning rates of the wheels in rad/s.

        Args:
            linear: m/s of the base.
            angular: rad/s of the base.
        """
        left = (linear - angular * self._half_m) / self._radius_m
        right = (linear + angular * self._half_m) / self._radius_m
        return [left, right, 0.0, 0.0]
