"""The driver's settings against the emulated bases: a Create 2, drive modes, charging, waking, the tune."""

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.driver import TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import CHARGING_TIMEOUT_S, RESET_PAUSE_S
from florence_bt.drivers.turtlebot.parameters import DriveMode, TurtlebotParameters
from florence_bt.simulation.emulators.create import Mode
from tests.emulators.create_bench import PtyBench

MakeBench = Callable[..., PtyBench]


@pytest.fixture
def make(base: Any, tmp_path: Path) -> Iterator[MakeBench]:
    benches: list[PtyBench] = []

    def made(model: str = "create", **how: Any) -> PtyBench:
        base.separation = 0.235 if model == "create2" else 0.26
        benches.append(PtyBench(base, tmp_path / "create", model, **how))
        benches[-1].run(2.5)
        return benches[-1]

    yield made
    for bench in benches:
        bench.close()


@pytest.mark.parametrize("robot_type", ["create2", "roomba"])
def test_a_create_2_drives_and_measures_with_its_encoders(make: MakeBench, robot_type: str) -> None:
    bench = make("create2", robot_type=robot_type)
    bench.run(3.0, Twist2(0.25, 0.4))
    bench.run(1.0)
    assert bench.reading is not None
    pose = bench.reading.odometry.pose
    assert bench.base.turned > 1.0
    assert pose.yaw == pytest.approx(bench.base.turned, abs=0.005)
    assert math.hypot(pose.x, pose.y) > 0.6
    assert bench.reading.gyro is None
    assert bench.driver.decoder.checksum_form is not None
    assert bench.driver.decoder.checksum_form.name == "WITH_HEADER"
    assert bench.diagnoses()["Gyro Sensor"].message == "this base has no input for a gyro"
    with pytest.raises(ConfigError, match="no digital outputs"):
        bench.driver.set_digital_outputs(1)


def test_encoders_wrap_without_a_jump(make: MakeBench) -> None:
    bench = make("create2", robot_type="create2")
    for twist in (Twist2(-0.2, 0.0), Twist2(0.3, 0.0)):  # they begin at 0: below it they wrap, and back
        bench.run(2.0, twist)
        bench.run(1.0)
        assert bench.reading is not None
        assert bench.driver.refused_readings == 0
        assert bench.reading.odometry.pose.x == pytest.approx(bench.base.advanced, abs=0.003)
        assert bench.base.advanced * twist.linear > 0.03


def test_switching_a_create_2_off_and_on_is_no_motion(make: MakeBench) -> None:
    bench = make("create2", robot_type="create2")
    bench.run(3.0, Twist2(0.2, 0.0))
    bench.run(1.0)
    assert bench.reading is not None
    before = bench.reading.odometry.pose
    assert before.x > 0.5
    bench.create.set_power(False, bench.now)
    bench.run(2.0, Twist2(0.2, 0.0))
    assert bench.diagnoses()["TurtleBot Node"].level is Severity.ERROR
    bench.create.set_power(True, bench.now)
    bench.run(8.0)
    assert bench.reading is not None
    assert bench.diagnoses()["TurtleBot Node"].message == "RUNNING"
    assert bench.reading.odometry.pose == before
    bench.run(0.5, Twist2(0.2, 0.0))
    assert bench.base.wheels == (0.2, 0.2)


def test_a_firmware_that_tells_its_mode_too_high(make: MakeBench) -> None:
    bench = make("create2", robot_type="create2", oi_mode_offset=1)
    bench.create.faults.oi_mode_offset = 1
    bench.run(0.5, Twist2(0.2, 0.0))
    assert bench.base.wheels == (0.2, 0.2)
    assert bench.reading is not None
    assert bench.reading.state.oi_mode == 3


@pytest.mark.parametrize(
    ("mode", "twist", "wheels"),
    [
        (DriveMode.TWIST, Twist2(0.5, 1.5), (0.110, 0.5)),
        (DriveMode.TURTLE, Twist2(0.5, 1.5), (0.305, 0.5)),
        (DriveMode.DRIVE, Twist2(0.2, 0.5), (0.135, 0.265)),
        (DriveMode.DRIVE, Twist2(-0.2, 0.5), (-0.265, -0.135)),
        (DriveMode.DRIVE, Twist2(0.2, 0.0), (0.2, 0.2)),
        (DriveMode.DRIVE, Twist2(0.0, -1.0), (0.13, -0.13)),
    ],
)
def test_drive_modes(make: MakeBench, mode: DriveMode, twist: Twist2, wheels: tuple[float, float]) -> None:
    bench = make(drive_mode=mode)
    bench.run(0.5, twist)
    assert bench.base.wheels == pytest.approx(wheels)
    assert bench.reading is not None
    assert not bench.reading.at_rest
    bench.run(1.5)
    assert bench.base.wheels == (0.0, 0.0)
    assert bench.reading.at_rest


def test_a_base_that_does_not_charge_is_reset_once_and_then_charges(make: MakeBench) -> None:
    bench = make()
    bench.create.battery.charge_mah = 0.1 * 2700
    bench.create.faults.dock = True
    bench.run(CHARGING_TIMEOUT_S - 1.0)
    assert bench.create.mode is Mode.FULL  # in which it does not charge
    bench.run(8.0)
    assert bench.driver.charge_resets == 1
    assert bench.create.mode is Mode.PASSIVE
    assert bench.reading is not None
    assert bench.reading.state.charging_state == 2
    assert bench.reading.state.user_digital_outputs == 0
    # A command drives it off, backward.
    bench.run(3.0, Twist2(-0.1, 0.0))
    assert (bench.create.mode, bench.base.wheels) == (Mode.FULL, (-0.1, -0.1))
    assert bench.create.digital_outputs == 1


def test_a_reset_that_does_not_help_is_not_repeated_soon(make: MakeBench) -> None:
    bench = make(operation_mode=1)
    bench.create.faults.charger = bench.create.faults.charging_fault = True
    bench.run(60.0)
    assert bench.driver.charge_resets == 1
    assert RESET_PAUSE_S > 60.0


def test_no_reset_when_told_so_or_when_full(make: MakeBench) -> None:
    bench = make(operation_mode=1, charge_reset=False)
    bench.create.faults.charger = bench.create.faults.charging_fault = True
    bench.run(20.0)
    assert bench.driver.charge_resets == 0


def test_the_bonus_tune_plays_when_the_base_is_ready(make: MakeBench) -> None:
    assert make(bonus=True).create.songs.played == [0]
    assert make("create2", robot_type="create2", bonus=True, operation_mode=2).create.songs.played == [0]
    assert make(bonus=True, operation_mode=1).create.songs.played == []


def test_waking_pulses_come_before_everything_else() -> None:
    driver = TurtlebotDriver(TurtlebotParameters())
    driver.start(0.0, wake=True)
    levels: list[tuple[float, bool | None]] = []
    now, sent = 0.0, b""
    while not sent:
        sent = driver.poll(now)
        if not levels or levels[-1][1] is not driver.rts:
            levels.append((round(now, 2), driver.rts))
        now += 0.01
    assert [level for _, level in levels] == [False, True, False, True, False, True, False, True]
    waits = [after[0] - before[0] for before, after in itertools.pairwise(levels)]
    # REFERENCE 1.1: low 0.1 s, high 0.75 s, then three times low and high 0.25 s.
    assert waits == pytest.approx([0.1, 0.75, 0.25, 0.25, 0.25, 0.25, 0.25], abs=0.021)
    assert sent == bytes([128] * 5)
    driver.start(10.0)
    assert driver.poll(10.0) == bytes([128] * 5)
