"""The rig's base gives values in place of bytes: the driver makes the same of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.driver import STREAM_PERIOD_S, BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.rig.base import SimulatedBase
from florence_bt.simulation.sensors.base_noise import BaseSensors

SEED, BEGIN_S = 4, 3.0


@dataclass
class Plant:
    """A base that does at once what it is told."""

    time: float = 0.0
    wheels: tuple[float, float] = (0.0, 0.0)
    rolled: tuple[float, float] = (0.0, 0.0)
    pressed: bool = False

    def step_to(self, now: float) -> None:
        passed, self.time = now - self.time, now
        self.rolled = tuple(way + speed * passed for way, speed in zip(self.rolled, self.wheels, strict=True))  # type: ignore[assignment]

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        self.wheels = (left_mps, right_mps)

    def travel(self) -> tuple[float, float]:
        return self.rolled

    def yaw_rate(self) -> float:
        return (self.wheels[1] - self.wheels[0]) / 0.26

    def bumpers(self) -> tuple[bool, bool]:
        return (self.pressed, False)


@dataclass
class Side:
    """A driver with what is before it, and what it has read."""

    driver: TurtlebotDriver = field(default_factory=TurtlebotDriver)
    plant: Plant = field(default_factory=Plant)
    readings: list[BaseReading] = field(default_factory=list)


def with_bytes(side: Side) -> Callable[[float], None]:
    emulator = CreateEmulator(side.plant, BaseSensors(side.plant, SEED))
    side.driver.start(0.0)

    def step(now: float) -> None:
        side.plant.step_to(now)
        side.readings += side.driver.receive(emulator.poll(now), now)
        emulator.receive(side.driver.poll(now), now)

    return step


def with_values(side: Side) -> Callable[[float], None]:
    clock = ManualClock()
    base = SimulatedBase(side.plant, side.driver, clock, BaseSensors(side.plant, SEED))  # type: ignore[arg-type]

    def step(now: float) -> None:
        clock.advance_to(now)
        side.readings += base.measure()
        base.pump()

    return step


def drive(connect: Callable[[Side], Callable[[float], None]]) -> Side:
    """Wait, drive a bend, meet something, back off, and stand."""
    side = Side()
    step = connect(side)
    for number in range(1, round(12.0 / STREAM_PERIOD_S)):
        now = number * STREAM_PERIOD_S
        side.plant.pressed = BEGIN_S + 4.0 < now < BEGIN_S + 5.5
        if BEGIN_S < now < BEGIN_S + 4.5:
            side.driver.command(Twist2(0.2, 0.1), now)
        elif BEGIN_S + 4.5 <= now < BEGIN_S + 6.0:
            side.driver.command(Twist2(-0.1, 0.0), now)
        step(now)
    return side


def test_the_driver_makes_the_same_of_bytes_and_of_values() -> None:
    robot, rig = drive(with_bytes), drive(with_values)
    assert robot.readings[-1].odometry.pose.distance_to(rig.readings[-1].odometry.pose) < 0.005
    assert robot.readings[-1].odometry.pose.yaw == pytest.approx(rig.readings[-1].odometry.pose.yaw, abs=0.02)
    assert robot.plant.rolled == pytest.approx(rig.plant.rolled, abs=0.005)
    for side in (robot, rig):
        held = [each.stamp for each in side.readings if each.stop_reason is StopReason.BUMPER]
        assert held[0] == pytest.approx(BEGIN_S + 4.0, abs=0.04)
        assert held[-1] == pytest.approx(BEGIN_S + 5.5, abs=0.04)
        assert side.readings[-1].at_rest and side.readings[-1].stop_reason is None
    since = BEGIN_S - 0.5
    told = [len([each for each in side.readings if each.stamp > since]) for side in (robot, rig)]
    assert abs(told[0] - told[1]) <= 1
