"""Firmware that drops what is below a millimetre or a degree at each reading: noticed, told and made good."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.fractions import most_likely
from tests.emulators.line_bench import Bench, ready
from tests.sweeps import sweep


def dropping(base: Any, **how: Any) -> Bench:
    bench = ready(base, **how)
    bench.create.faults.drops_fractions = True
    return bench


def wandering(bench: Bench, *moves: tuple[float, float, float]) -> None:
    """Drive with (m/s, rad/s, s) each, and rest a second after each."""
    for linear, angular, seconds in moves:
        bench.run(seconds, Twist2(linear, angular))
        bench.run(1.0)


def block(base: Any) -> None:
    """Let the wheels turn no more, whatever they are told."""
    base.step, base.yaw_rate = lambda seconds: None, lambda: 0.0


def level(bench: Bench) -> Severity:
    return diagnose(bench.driver, bench.latest, "", "")["TurtleBot Node"].level


@pytest.mark.parametrize("speed", sweep([0.1, 0.23, 0.45, 0.3], every=2))
def test_a_straight_drive_is_as_long_as_it_was(base: Any, speed: float) -> None:
    bench = dropping(base)
    wandering(bench, (speed, 0.0, 20.0))
    assert bench.driver.fractions.drops and level(bench) is Severity.WARN
    found = diagnose(bench.driver, bench.latest, "", "")["TurtleBot Node"]
    assert "drops fractions" in found.message and found.values["Fractions Of Counts"] == "dropped"
    begin, begun = bench.latest.odometry.pose.x, base.advanced
    wandering(bench, (speed, 0.0, 10.0))
    assert bench.latest.odometry.pose.x - begin == pytest.approx(base.advanced - begun, rel=0.02)


@pytest.mark.parametrize(
    ("rate", "has_gyro"), sweep(itertools.product([0.25, -0.5, 1.0, -1.5], [True, False]), every=3)
)
def test_a_turn_is_as_far_as_it_was_and_the_gyro_is_not_blamed(
    base: Any, rate: float, has_gyro: bool
) -> None:
    bench = dropping(base, has_gyro=has_gyro)
    if not has_gyro or abs(rate) > 1.1:
        # Without a gyro a slow turn looks like a base that is blocked; of a fast one too little is missing.
        wandering(bench, (0.23, 0.0, 10.0))
    wandering(bench, (0.0, rate, 8.0))
    assert bench.driver.fractions.drops
    begin, begun = bench.latest.odometry.pose.yaw, base.turned
    readings = bench.run(6.0, Twist2(0.0, rate))
    assert not any(reading.stop_reason for reading in readings)
    bench.run(1.0)
    turned = math.remainder(bench.latest.odometry.pose.yaw - begin - (base.turned - begun), 2.0 * math.pi)
    assert abs(turned) < 0.05 * 6.0 * abs(rate)


def test_without_the_fault_nothing_changes(base: Any) -> None:
    bench = ready(base)
    for number in range(12):
        wandering(bench, (0.05 + 0.04 * number, 0.1 * (number % 3 - 1), 3.0), (0.0, 0.2 * (number - 6), 3.0))
        assert not bench.driver.fractions.drops and level(bench) is Severity.OK


def test_a_base_that_is_blocked_is_not_taken_for_one_that_drops(base: Any) -> None:
    bench = ready(base)
    block(base)
    wandering(bench, (0.3, 0.0, 6.0), (0.1, 0.0, 6.0), (0.0, 0.5, 6.0), (0.2, 0.3, 6.0))
    assert not bench.driver.fractions.drops
    assert (bench.latest.odometry.pose.x, bench.latest.odometry.pose.y) == (0.0, 0.0)


def test_a_base_that_drops_and_is_blocked_later_stays_where_it_is(base: Any) -> None:
    bench = dropping(base)
    wandering(bench, (0.23, 0.0, 10.0))
    assert bench.driver.fractions.drops
    begin = bench.latest.odometry.pose
    block(base)
    bench.run(5.0, Twist2(0.3, 0.0))
    # Less than a millimetre a reading cannot be seen.
    assert bench.latest.odometry.pose.x - begin.x < 5.0 / 0.015 * 0.001 + 0.01


def test_another_base_on_the_line_is_judged_anew(base: Any) -> None:
    bench = dropping(base)
    wandering(bench, (0.23, 0.0, 10.0))
    assert bench.driver.fractions.drops
    bench.create.faults.drops_fractions = False
    wandering(bench, (0.23, 0.0, 20.0))
    assert not bench.driver.fractions.drops and level(bench) is Severity.OK


@pytest.mark.parametrize(
    ("counted", "commanded", "expected"),
    [
        (4, 4.5, 4.5),
        (4, 3.0, 4.0),
        (4, 9.0, 5.0),
        (0, 0.7, 0.7),
        (0, -3.0, -1.0),
        (-2, -2.3, -2.3),
        (-2, 0.0, -2.0),
    ],
)
def test_a_command_counts_within_what_was_counted(counted: float, commanded: float, expected: float) -> None:
    assert most_likely(counted, commanded) == pytest.approx(expected)
