"""Wheels, hazards, gyro and odometry: the numbers of REFERENCE 1.8, 2.3, 2.5 and 13."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import Pose2, Twist2, integrate_twist
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.packets import OiMode
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.drive_control import DriveControl
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.gyro import Gyro, GyroParameters, rate_from_adc
from florence_bt.drivers.turtlebot.hazards import StopReason, contact, hold_forward, lost_mode
from florence_bt.drivers.turtlebot.odometry import (
    MotionEstimator,
    OdometryParameters,
    WheelOdometry,
    covariance,
)
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters, TurtlebotParameters
from florence_bt.drivers.turtlebot.report import RateLimiter, StateReport
from florence_bt.drivers.turtlebot.wheels import (
    STOPPED,
    WheelParameters,
    WheelSpeeds,
    limit_yaw_rate,
    wheels_from_twist,
)

PLAIN = WheelParameters()


# -- wheels ------------------------------------------------------------------------------------------------


def test_vectors_of_the_reference() -> None:
    slow = wheels_from_twist(Twist2(0.2, 0.5), PLAIN)
    assert slow == WheelSpeeds(left_mmps=135, right_mmps=265)
    assert commands.drive_direct(slow.right_mmps, slow.left_mmps) == bytes([145, 1, 9, 0, 135])
    fast = wheels_from_twist(Twist2(0.5, 1.5), PLAIN)
    assert fast == WheelSpeeds(left_mmps=110, right_mmps=500)
    assert commands.drive_direct(fast.right_mmps, fast.left_mmps) == bytes([145, 1, 244, 0, 110])


def test_too_fast_a_turn_does_not_flip_the_advance() -> None:
    assert wheels_from_twist(Twist2(0.3, 5.0), PLAIN) == WheelSpeeds(-500, 500)
    assert wheels_from_twist(Twist2(-0.3, -5.0), PLAIN) == WheelSpeeds(500, -500)


def test_truncation_is_toward_zero() -> None:
    assert wheels_from_twist(Twist2(0.0019, 0.0), PLAIN) == WheelSpeeds(1, 1)
    assert wheels_from_twist(Twist2(-0.0019, 0.0), PLAIN) == WheelSpeeds(-1, -1)


@given(st.floats(-2, 2), st.floats(-8, 8))
def test_wheels_stay_within_the_motors(linear: float, angular: float) -> None:
    wheels = wheels_from_twist(Twist2(linear, angular), PLAIN)
    assert max(abs(wheels.left_mmps), abs(wheels.right_mmps)) <= 500
    # The sense of the turn always survives, and the advance never changes its sign.
    assert (wheels.right_mmps - wheels.left_mmps) * angular >= 0
    assert (wheels.right_mmps + wheels.left_mmps) * linear >= 0


@given(st.integers(-500, 500), st.integers(-500, 500))
def test_there_and_back(left: int, right: int) -> None:
    twist = Twist2((left + right) / 2000.0, (right - left) / 1000.0 / PLAIN.wheel_separation)
    assert wheels_from_twist(twist, PLAIN) == WheelSpeeds(left, right)


def test_yaw_limits() -> None:
    limits = WheelParameters(min_abs_yaw_vel=0.3, max_abs_yaw_vel=1.0)
    assert [limit_yaw_rate(rate, limits) for rate in (0.0, 0.1, -0.1, 0.5, 2.0, -2.0)] == [
        0.0, 0.3, -0.3, 0.5, 1.0, -1.0,
    ]  # fmt: skip
    assert limit_yaw_rate(2.5, WheelParameters(max_abs_yaw_vel=0.0)) == 2.5


# -- hazards -----------------------------------------------------------------------------------------------


def test_bump_rule() -> None:
    for forward in (WheelSpeeds(100, 100), WheelSpeeds(-99, 100)):
        assert hold_forward(forward, StopReason.BUMPER) == STOPPED
        assert hold_forward(forward, None) == forward
    for allowed in (WheelSpeeds(-100, -100), WheelSpeeds(-100, 100), STOPPED):
        assert hold_forward(allowed, StopReason.BUMPER) == allowed


def test_contacts() -> None:
    def seen(bumps: bool = True, cliffs: bool = True, **fields: int | bool) -> StopReason | None:
        return contact(SensorState(**fields), use_bumpers=bumps, use_cliffs=cliffs)  # type: ignore[arg-type]

    assert seen() is None
    assert seen(bumps_wheeldrops=1) is StopReason.BUMPER
    assert seen(bumps_wheeldrops=2, cliff_right=True) is StopReason.CLIFF
    assert seen(bumps_wheeldrops=0b10011) is StopReason.WHEEL_DROP
    assert seen(bumps=False, bumps_wheeldrops=31) is None
    assert seen(cliffs=False, cliff_left=True) is None


def test_lost_mode() -> None:
    passive = SensorState(oi_mode=1)
    assert lost_mode(passive, OiMode.FULL) is StopReason.MODE_LOST
    assert lost_mode(passive, OiMode.PASSIVE) is None
    assert lost_mode(SensorState(oi_mode=2), OiMode.SAFE) is None
    assert lost_mode(SensorState(oi_mode=1, charging_sources_available=1), OiMode.SAFE) is StopReason.CHARGER
    assert (
        lost_mode(SensorState(oi_mode=1, charging_sources_available=2), OiMode.SAFE) is StopReason.MODE_LOST
    )


def test_drive_control_forgets_a_held_command_and_an_old_one() -> None:
    control = DriveControl(PLAIN, timeout_s=0.6)
    control.command(Twist2(0.1, 0.0), 0.0)
    go = commands.drive_direct(100, 100)
    stop = commands.drive_direct(0, 0)
    assert control.take(0.0, None, enabled=True) == go
    assert control.take(0.01, None, enabled=True) == b""  # nothing new, not yet due
    assert control.take(0.04, None, enabled=True) == go  # repeated
    assert control.take(0.05, StopReason.BUMPER, enabled=True) == stop  # at once
    assert control.take(0.1, None, enabled=True) == stop  # the objection is gone, the command too
    control.command(Twist2(0.1, 0.0), 0.2)
    assert control.take(0.79, None, enabled=True) == go
    assert control.take(0.81, None, enabled=True) == stop  # 0.6 s are over


def test_a_flood_of_commands_does_not_fill_the_line() -> None:
    """1000 different commands a second: 57600 baud carry 5760 bytes."""
    control = DriveControl(PLAIN, timeout_s=0.6)
    sent = []
    for millisecond in range(1000):
        now = millisecond / 1000.0
        control.command(Twist2(0.1 + millisecond / 10_000.0, 0.0), now)
        if data := control.take(now, None, enabled=True):
            sent.append(now)
        assert now < control.due <= now + 0.034
    assert sent[0] == 0.0
    assert 60 <= len(sent) <= 70
    control.command(Twist2(0.0, 0.0), 0.9995)
    assert control.take(0.9995, None, enabled=True) == commands.drive_direct(0, 0)  # a stop does not wait
    assert data == b""


def test_the_newest_command_waits_for_its_turn() -> None:
    control = DriveControl(PLAIN, timeout_s=0.6)
    control.command(Twist2(0.1, 0.0), 0.0)
    control.take(0.0, None, enabled=True)
    control.command(Twist2(0.2, 0.0), 0.005)
    assert control.take(0.005, None, enabled=True) == b""
    assert control.due == pytest.approx(0.015)
    assert control.take(control.due, None, enabled=True) == commands.drive_direct(200, 200)


def test_a_clock_that_is_set_back_stops_the_base() -> None:
    control = DriveControl(PLAIN, timeout_s=0.6)
    control.command(Twist2(0.1, 0.0), 1000.0)
    control.take(1000.0, None, enabled=True)
    assert control.take(400.0, None, enabled=True) == commands.drive_direct(0, 0)
    assert control.due == pytest.approx(400.0, abs=0.04)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_stops(wrong: float) -> None:
    control = DriveControl(PLAIN, timeout_s=0.6)
    control.command(Twist2(0.1, 0.0), 0.0)
    control.command(Twist2(0.1, wrong), 0.1)
    assert control.take(0.1, None, enabled=True) == commands.drive_direct(0, 0)
    assert control.refused == 1


# -- gyro --------------------------------------------------------------------------------------------------


def test_rate_of_the_reference() -> None:
    rate = rate_from_adc(398, 512, GyroParameters())
    assert math.degrees(rate) == pytest.approx(45.09, abs=0.005)
    assert math.degrees(rate_from_adc(511, 512, GyroParameters())) == pytest.approx(0.3955, abs=5e-5)


def test_offset_needs_settled_rest() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=2, settle_s=0.5, rest_samples=3))
    # stamp, adc, at_rest -> offset: moving samples and those of the first half second do not count.
    assert gyro.update(0.0, 900, True) is None
    assert gyro.update(0.4, 900, True) is None
    assert gyro.update(0.5, 510, True) is None  # one sample
    reading = gyro.update(0.6, 511, True)
    assert reading is not None
    assert (reading.offset, reading.resting) == (510.5, True)
    moving = gyro.update(0.7, 400, False)
    assert moving is not None
    assert (moving.offset, moving.resting) == (510.5, False)
    for stamp in (0.8, 1.4, 1.5, 1.6):
        reading = gyro.update(stamp, 512, True)
    assert reading is not None
    assert reading.offset == 512.0  # only the newest three


def test_a_dead_gyro_has_no_offset() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=1, settle_s=0.0))
    assert gyro.update(0.0, 0, True) is None


def test_heading_of_the_gyro() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=1, settle_s=0.0))
    gyro.update(0.0, 512, True)
    reading = gyro.update(1.0, 398, False)
    assert reading is not None
    assert math.degrees(reading.yaw) == pytest.approx(45.09, abs=0.005)


# -- odometry ----------------------------------------------------------------------------------------------


@given(st.floats(-0.5, 0.5), st.floats(-1.5, 1.5))
def test_small_steps_follow_the_arc(linear: float, angular: float) -> None:
    odometry, twist, step = WheelOdometry(), Twist2(linear, angular), 0.02
    odometry.update(0.0, 0.0, 0.0)
    for number in range(1, 101):
        result = odometry.update(number * step, linear * step, angular * step)
    true = integrate_twist(Pose2(), twist, 100 * step)
    assert result.pose.distance_to(true) < 1e-3
    assert result.pose.yaw == pytest.approx(true.yaw, abs=1e-9)
    assert (result.twist.linear, result.twist.angular) == pytest.approx((linear, angular), abs=1e-9)


def test_scales() -> None:
    odometry = WheelOdometry(OdometryParameters(linear_scale=1.1, angular_scale=0.9))
    pose = odometry.update(0.0, 0.1, 0.0).pose
    assert pose.x == pytest.approx(0.11)
    assert odometry.update(0.1, 0.0, 0.1).pose.yaw == pytest.approx(0.09)


def test_the_gyro_tells_the_heading_unless_the_gap_is_long() -> None:
    odometry = WheelOdometry()
    odometry.update(0.0, 0.0, 0.0)
    assert odometry.update(0.1, 0.0, 0.5, gyro_rate=1.0).pose.yaw == pytest.approx(0.1)
    assert odometry.update(1.1, 0.0, 0.5, gyro_rate=1.0).pose.yaw == pytest.approx(0.6)


def test_equal_stamps() -> None:
    odometry = WheelOdometry()
    odometry.update(5.0, 0.01, 0.0)
    again = odometry.update(5.0, 0.01, 0.0)
    assert again.twist == Twist2()
    assert again.pose.x == pytest.approx(0.02)
    assert odometry.update(5.1, 0.01, 0.0).twist.linear == pytest.approx(0.2)


@pytest.mark.parametrize(("distance", "angle"), [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.6), (0.0, -0.6)])
def test_impossible_steps_are_refused(distance: float, angle: float) -> None:
    odometry = WheelOdometry()
    odometry.update(0.0, 0.0, 0.0)
    with pytest.raises(FrameError, match="not motion of this base"):
        odometry.update(0.015, distance, angle)
    assert odometry.update(0.03, 0.0, 0.0).pose == Pose2()


def test_velocity_is_a_mean_over_the_window() -> None:
    odometry = WheelOdometry()
    # 4 and 5 mm in turn every 15 ms: 0.3 m/s, though each frame by itself says 0.267 or 0.333.
    for number in range(40):
        result = odometry.update(number * 0.015, 0.004 + 0.001 * (number % 2), 0.0)
    assert result.twist.linear == pytest.approx(0.3, abs=0.011)


def test_heading_holds_at_rest_in_spite_of_gyro_noise() -> None:
    motion = MotionEstimator(gyro=GyroParameters(first_offset_after=10))
    for number in range(400):
        result = motion.update(
            number * 0.015, 0.0, 0.0, 512 + (-1) ** number + number // 200, wheels_stopped=True
        )
    assert result.gyro is not None
    assert result.odometry.pose.yaw == 0.0
    assert result.at_rest


def test_covariances() -> None:
    moving, resting = covariance(False), covariance(True)
    assert [moving[place] for place in (0, 7, 14, 21, 28, 35)] == [1e-3, 1e-3, 1e6, 1e6, 1e6, 1e3]
    assert [resting[place] for place in (0, 7, 14, 21, 28, 35)] == [1e-9, 1e-9, 1e6, 1e6, 1e6, 1e-9]
    assert len(moving) == 36
    assert sum(moving) == pytest.approx(3e6 + 1e3 + 2e-3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"operation_mode": 4},
        {"operation_mode": 0},
        {"wheel_separation": 0.0},
        {"cmd_vel_timeout": 0.0},
        {"cmd_vel_timeout": 1.5},
        {"min_abs_yaw_vel": -0.1},
        {"max_abs_yaw_vel": 3.5},
        {"gyro_measurement_range": 0.0},
        {"gyro_scale_correction": 7.0},
        {"odom_linear_scale_correction": -1.0},
        {"odom_angular_scale_correction": math.nan},
        {"data_timeout": 0.0},
        {"recovery_delay": -1.0},
        {"digital_outputs": 8},
    ],
)
def test_wrong_parameters_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        TurtlebotParameters(**wrong)  # type: ignore[arg-type]


# -- reports and diagnostics ------------------------------------------------------------------------------


def test_pace_picks_30_of_66() -> None:
    limiter = RateLimiter(30.0)
    assert sum(limiter.is_due(number * 0.015) for number in range(667)) == pytest.approx(300, abs=1)
    # A gap causes no burst.
    assert [limiter.is_due(stamp) for stamp in (60.0, 60.015, 60.03, 60.045)] == [True, False, False, True]


def test_reports_add_up() -> None:
    report = StateReport()
    for _ in range(3):
        report.add(SensorState(distance=0.01, angle=-0.02))
    taken = report.take(SensorState(distance=0.01, voltage=15000))
    assert (taken.distance, taken.angle, taken.voltage) == pytest.approx((0.03, -0.06, 15000))
    assert report.take(SensorState()).distance == 0.0


def reading(stop_reason: StopReason | None = None, **fields: int) -> BaseReading:
    state = SensorState(**{"voltage": 15_000, "charge": 2000, "capacity": 2700, **fields})  # type: ignore[arg-type]
    return BaseReading(0.0, state, Odometry(0.0, Pose2()), None, True, stop_reason)


def test_diagnoses() -> None:
    driver = TurtlebotDriver()

    def judged(newest: BaseReading | None, problem: str = "") -> list[tuple[Severity, str]]:
        found = diagnose(driver, newest, "/dev/ttyUSB0", problem)
        assert list(found) == [
            "TurtleBot Node",
            "Operating Mode",
            "Battery",
            "Charging Sources",
            "Cliff Sensor",
            "Wall Sensor",
            "Gyro Sensor",
            "Digital Outputs",
        ]
        return [(diagnosis.level, diagnosis.message) for diagnosis in found.values()][:3]

    assert judged(reading(oi_mode=3)) == [
        (Severity.OK, "RUNNING"),
        (Severity.OK, "Full"),
        (Severity.OK, "OK"),
    ]
    assert judged(None)[0] == (Severity.WARN, "STARTING")
    assert judged(None, "no such port")[0] == (Severity.ERROR, "no such port")
    assert judged(None)[2][0] is Severity.STALE
    for code in (0, 4, 32):
        assert judged(reading(oi_mode=code))[1] == (Severity.ERROR, f"unknown mode {code}")
    held = judged(reading(StopReason.BUMPER, oi_mode=2))[1]
    assert held == (Severity.WARN, "Safe: a bumper is pressed: forward motion is held")
    assert judged(reading(oi_mode=3, charging_state=5))[2][0] is Severity.ERROR


@pytest.mark.parametrize(
    "wrong",
    [{"baud_rate": 0}, {"update_rate": 100.0}, {"sensor_state_rate": 0.0}, {"reconnect_delay_s": 0.0}],
)
def test_wrong_node_parameters_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        TurtlebotNodeParameters(**wrong)  # type: ignore[arg-type]


def test_a_moment_is_told_once():
    limiter = RateLimiter(30.0)
    assert [limiter.is_due(stamp) for stamp in (1.0, 1.0, 1.05, 1.05, 1.10, 1.10)] == [True, False] * 3
