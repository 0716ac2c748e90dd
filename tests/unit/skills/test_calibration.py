"""The calibration: wall angle, the sequence on a turning robot that can be wrong in every way, its limits."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import normalize_angle
from florence_bt.core.sensing import LaserScan
from florence_bt.skills.calibration.calibration import (
    STEP_PERIOD_S,
    Calibration,
    CalibrationParameters,
    State,
)
from florence_bt.skills.calibration.factors import (
    Direction,
    Readings,
    Source,
    factors_from_turns,
    measure_turn,
)
from florence_bt.skills.calibration.wall_angle import Wall, WallParameters, find_wall


def scan_of_wall(yaw: float, distance: float = 1.5, noise: float = 0.0, reach: float = 5.0) -> LaserScan:
    """A wall along the y axis at x = distance, seen by a robot at the origin with this heading."""
    angles = np.linspace(-1.5, 1.5, 301)
    with np.errstate(divide="ignore"):
        ranges = distance / np.cos(angles + yaw)
    ranges = np.where((ranges > 0) & (ranges < reach), ranges, np.inf)
    ranges = ranges + np.random.default_rng(1).normal(0.0, 1.0, len(angles)) * noise
    return LaserScan(0.0, "laser", -1.5, 0.01, 0.1, reach, ranges.astype(np.float32))


@pytest.mark.parametrize("yaw", [-0.45, -0.1, 0.0, 0.05, 0.4])
@pytest.mark.parametrize("distance", [0.6, 2.0])
def test_wall_angle_is_the_heading(yaw, distance):
    wall = find_wall(scan_of_wall(yaw, distance))
    assert isinstance(wall, Wall)
    assert wall.angle == pytest.approx(yaw, abs=1e-4)
    assert wall.distance == pytest.approx(distance, abs=1e-3)


def test_noise_hardly_matters():
    wall = find_wall(scan_of_wall(0.2, 1.5, noise=0.01))
    assert isinstance(wall, Wall) and wall.angle == pytest.approx(0.2, abs=0.03)


def test_no_wall_says_why():
    assert "0 beams" in str(find_wall(scan_of_wall(math.pi)))
    assert "46 degrees off" in str(find_wall(scan_of_wall(0.8, 0.8)))
    corner = scan_of_wall(0.0)
    bent = np.where(corner.angles() > 0.0, 1.0, 2.0).astype(np.float32)
    scan = LaserScan(0.0, "laser", -1.5, 0.01, 0.1, 5.0, bent)
    assert "not a straight wall" in str(find_wall(scan))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: WallParameters(min_angle=0.3, max_angle=0.3),
        lambda: WallParameters(min_points=1),
        lambda: CalibrationParameters(speeds=()),
        lambda: CalibrationParameters(speeds=(9.0,)),
        lambda: CalibrationParameters(rounds=0),
        lambda: CalibrationParameters(settle=math.nan),
    ],
)
def test_bad_parameters(wrong):
    with pytest.raises(ConfigError):
        wrong()


class TurningRobot:
    """A robot before a wall: truth, wrong odometry, wrong gyro; sees the wall within half a radian."""

    def __init__(
        self,
        odometry=1.0,
        gyro=1.0,
        drift=0.0,
        heading=0.0,
        stuck=False,
        wall=True,
        delay_steps=0,
        late_scans=0,
    ):
        self.commands = deque([0.0] * delay_steps)
        self.scans = deque([(-1.0, math.pi)] * late_scans)
        self.now = 0.0
        self.rate = 0.0
        self.true = heading
        self.odometry = 0.3
        self.gyro = -1.0
        self.scales = odometry, gyro
        self.drift = drift
        self.stuck = stuck
        self.wall = wall
        self.silent: set[Source] = set()

    def move(self, twist, duration=STEP_PERIOD_S):
        self.commands.append(twist.angular)
        wanted = self.commands.popleft()
        # The velocity filter brakes at 1 rad/s^2.
        self.rate = max(wanted, self.rate - duration) if self.rate > 0.0 else wanted
        turn = 0.0 if self.stuck else self.rate * duration
        self.now += duration
        self.true += turn
        self.odometry += turn * self.scales[0]
        self.gyro += turn * self.scales[1] + self.drift * duration

    def tell(self, readings: Readings):
        if Source.ODOMETRY not in self.silent:
            readings.take(Source.ODOMETRY, self.now, normalize_angle(self.odometry))
        if Source.GYRO not in self.silent:
            readings.take(Source.GYRO, self.now, normalize_angle(self.gyro))
        if Source.WALL in self.silent:
            return
        self.scans.append((self.now, normalize_angle(self.true)))
        stamp, heading = self.scans.popleft()
        if self.wall and abs(heading) < 0.5:
            readings.take(Source.WALL, stamp, heading)
        else:
            readings.take_no_wall(stamp, "only 0 beams straight ahead hit something")


def run(robot: TurningRobot, parameters=None, limit=600.0) -> Calibration:
    calibration = Calibration(parameters)
    while calibration.result is None:
        robot.tell(calibration.readings)
        robot.move(calibration.step(robot.now))
        assert robot.now < limit, f"still {calibration.feedback} after {limit} s"
    assert calibration.state is State.DONE and calibration.step(robot.now).is_zero()
    return calibration


@pytest.mark.parametrize(("odometry", "gyro"), [(1.0, 1.0), (0.985, 0.854), (1.2, 1.2), (0.82, 0.9)])
@pytest.mark.parametrize("drift", [0.0, 0.002])
def test_factors_undo_the_wrong_scales(odometry, gyro, drift):
    factors = run(TurningRobot(odometry, gyro, drift, heading=0.5)).factors
    assert factors is not None
    assert factors.odometry == pytest.approx(1.0 / odometry, rel=2e-3)
    assert factors.gyro == pytest.approx(1.0 / gyro, rel=2e-3)
    assert [turn.speed for turn in factors.turns] == [0.3, 0.7, 1.0, 1.5]
    assert factors.near(0.01) == (odometry == gyro == 1.0)


def test_a_base_that_stops_late_turns_back_to_the_wall():
    factors = run(TurningRobot(0.985, 0.854, heading=-0.6, delay_steps=32)).factors
    assert factors is not None
    assert factors.odometry == pytest.approx(1.0 / 0.985, rel=5e-3)
    assert factors.gyro == pytest.approx(1.0 / 0.854, rel=5e-3)


@pytest.mark.parametrize("missed", [6.0, 12.0])
def test_a_wall_that_was_missed_on_the_way_back_is_looked_for_on_both_sides(missed):
    robot, calibration, turned_at = TurningRobot(0.985, 0.854), Calibration(), None
    while calibration.result is None and robot.now < 600.0:
        robot.tell(calibration.readings)
        robot.move(calibration.step(robot.now))
        if turned_at is None and calibration.state is State.RETURN:
            turned_at = robot.now
        robot.wall = turned_at is None or robot.now > turned_at + missed
    assert calibration.factors is not None, calibration.result
    assert calibration.factors.odometry == pytest.approx(1.0 / 0.985, rel=5e-3)


def test_without_gyro():
    robot = TurningRobot(odometry=0.9)
    robot.silent = {Source.GYRO}
    factors = run(robot, CalibrationParameters(has_gyro=False)).factors
    assert factors is not None and factors.gyro is None
    assert list(factors.by_parameter()) == ["odom_angular_scale_correction"]


@pytest.mark.parametrize(
    ("robot", "code", "words"),
    [
        (TurningRobot(wall=False), "no_wall", "0 beams"),
        (TurningRobot(heading=0.05, stuck=True), "no_turn", "0 of 360"),
        (TurningRobot(gyro=1.6), "bad_turn", "gyro saw"),
    ],
)
def test_what_cannot_be_calibrated_ends_with_a_reason(robot, code, words):
    result = run(robot).result
    assert result is not None and not result.succeeded
    assert result.code == code and words in result.reason


def test_late_scans_and_late_commands_do_not_take_it_past_the_wall():
    robot = TurningRobot(0.985, 0.854, heading=-0.6, delay_steps=16, late_scans=8)
    factors = run(robot).factors
    assert factors is not None
    assert factors.odometry == pytest.approx(1.0 / 0.985, rel=5e-3)


def test_it_does_not_turn_on_without_a_fresh_scan():
    robot, calibration = TurningRobot(heading=0.45), Calibration()
    while robot.true > 0.4 and robot.now < 60.0:
        robot.tell(calibration.readings)
        robot.move(calibration.step(robot.now))
    robot.silent, blind_at = {Source.WALL}, robot.now
    while robot.now < blind_at + 4.0:
        robot.tell(calibration.readings)
        command = calibration.step(robot.now)
        assert command.is_zero() or robot.now < blind_at + 0.5 + STEP_PERIOD_S
        robot.move(command)
    robot.silent = set()
    while calibration.result is None and robot.now < 600.0:
        robot.tell(calibration.readings)
        robot.move(calibration.step(robot.now))
    assert calibration.factors is not None


@pytest.mark.parametrize("source", list(Source))
def test_a_silent_sensor_is_named(source):
    robot = TurningRobot()
    robot.silent = {source}
    result = run(robot).result
    assert result is not None and result.code == "no_sensor" and source.value in result.reason


def test_numbers_of_the_document():
    # Document, section 7.2: 1.171401 and 1.015922, from one noise-free turn.
    start = {source: Direction(0.0, 0.0) for source in Source}
    end = {
        Source.WALL: Direction(10.0, 0.0),
        Source.ODOMETRY: Direction(10.0, math.tau / 1.015922 - math.tau),
        Source.GYRO: Direction(10.0, math.tau / 1.171401 - math.tau + 0.05),
    }
    factors = factors_from_turns([measure_turn(0.7, start, end, drift=0.005)])
    assert factors.by_parameter() == {
        "gyro_scale_correction": pytest.approx(1.171401),
        "odom_angular_scale_correction": pytest.approx(1.015922),
    }


def test_readings_drop_what_is_old_or_no_number():
    readings = Readings()
    readings.take(Source.ODOMETRY, 1.0, 3.0)
    readings.take(Source.ODOMETRY, 1.0, 0.0)
    readings.take(Source.ODOMETRY, 2.0, math.nan)
    readings.take(Source.ODOMETRY, 3.0, -3.0)
    assert readings.turned == pytest.approx(math.tau - 6.0)
