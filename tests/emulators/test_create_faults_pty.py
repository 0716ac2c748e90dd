"""Every fault, over a real pseudo-terminal: the base stops, the diagnostics tell, and it recovers."""

import math
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Twist2
from florence_bt.simulation.emulators.create_body import CreateFaults
from tests.emulators.create_bench import PtyBench

FORWARD, BACK = Twist2(0.2, 0.0), Twist2(-0.2, 0.0)
MakeBench = Callable[..., PtyBench]


@pytest.fixture
def make(base: Any, tmp_path: Path) -> Iterator[MakeBench]:
    benches: list[PtyBench] = []

    def made(**how: Any) -> PtyBench:
        benches.append(PtyBench(base, tmp_path / "create", **how))
        benches[-1].run(2.5)  # awake, and the gyro has its offset
        return benches[-1]

    yield made
    for bench in benches:
        bench.close()


def drives(bench: PtyBench, twist: Twist2 = FORWARD, seconds: float = 0.5) -> bool:
    bench.run(seconds, twist)
    return bool(bench.base.wheels == (twist.linear, twist.linear))


def fault(bench: PtyBench, **values: Any) -> None:
    for name, value in values.items():
        assert hasattr(CreateFaults(), name)
        setattr(bench.create.faults, name, value)


def heal(bench: PtyBench) -> None:
    fault(bench, **{name: getattr(CreateFaults(), name) for name in CreateFaults.__slots__})


def worst(bench: PtyBench, name: str) -> tuple[Severity, str]:
    found = bench.diagnoses()[name]
    return found.level, found.message


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize(
    ("values", "reason", "text"),
    [
        ({"wheel_drops": 4}, "WHEEL_DROP", "wheel hangs in the air"),
        ({"wheel_drops": 16}, "WHEEL_DROP", "caster hangs in the air"),
        ({"cliffs": (False, False, True, False)}, "CLIFF", "misses the floor"),
        ({"left_bumper": True}, "BUMPER", "bumper is pressed"),
        ({"charger": True}, "CHARGER", "unplug it"),
        ({"dock": True}, "", "dock|returns to it"),
    ],
)
def test_what_touches_the_base_stops_it_is_told_and_recovers(
    make: MakeBench, mode: int, values: dict[str, Any], reason: str, text: str
) -> None:
    bench = make(operation_mode=mode)
    assert drives(bench)
    moved = bench.base.advanced
    fault(bench, **values)
    bench.run(0.03)
    assert bench.base.wheels == (0.0, 0.0)
    assert bench.base.advanced - moved < 0.2 * 0.03
    assert bench.reading is not None
    assert bench.reading.stop_reason is not None
    assert not reason or bench.reading.stop_reason.name == reason
    level, message = worst(bench, "Operating Mode")
    assert level is Severity.WARN
    assert any(part in message for part in text.split("|"))
    heal(bench)
    bench.run(0.5)
    assert bench.base.wheels == (0.0, 0.0)  # not by itself
    assert drives(bench, seconds=2.0)
    assert worst(bench, "Operating Mode")[0] is Severity.OK


def test_a_spin_is_stopped_too_and_may_be_begun_again(make: MakeBench) -> None:
    bench = make()
    bench.run(0.5, Twist2(0.0, 1.0))
    fault(bench, left_bumper=True)
    bench.run(0.04)
    assert bench.base.wheels == (0.0, 0.0)
    bench.run(0.3, Twist2(0.0, 1.0))
    assert bench.base.wheels == (-0.13, 0.13)
    assert drives(bench, BACK)


def test_the_charger_holds_every_motion_and_the_dock_leaves_the_way_back(make: MakeBench) -> None:
    bench = make()
    fault(bench, charger=True)
    assert not drives(bench, BACK)
    heal(bench)
    fault(bench, dock=True, cliffs=(True, True, True, True))  # its plate looks like a cliff
    assert not drives(bench, FORWARD)
    assert worst(bench, "Charging Sources") == (Severity.OK, "Base Dock")
    assert drives(bench, BACK)


def test_a_base_in_safe_mode_drives_off_its_dock(make: MakeBench) -> None:
    bench = make(operation_mode=2)
    fault(bench, dock=True)
    bench.run(2.0)
    assert bench.create.mode.name == "PASSIVE"
    assert drives(bench, BACK, 2.0)
    assert bench.create.mode.name == "SAFE"


@pytest.mark.parametrize(
    "values",
    [{"silent": True}, {"bad_checksums": 10_000}, {"partial_frames": 10_000}],
    ids=["silence", "bad checksums", "partial frames"],
)
def test_a_line_without_good_frames_stops_the_base(make: MakeBench, values: dict[str, Any]) -> None:
    bench = make()
    assert drives(bench)
    fault(bench, **values)
    bench.run(1.2, FORWARD)
    assert bench.base.wheels == (0.0, 0.0)
    level, message = worst(bench, "TurtleBot Node")
    assert level is Severity.ERROR
    assert "no good frame" in message
    assert worst(bench, "Battery")[0] is Severity.STALE
    bench.run(3.0, FORWARD)
    assert bench.base.wheels == (0.0, 0.0)  # nobody drives blind
    heal(bench)
    bench.run(3.0)
    assert worst(bench, "TurtleBot Node") == (Severity.OK, "RUNNING")
    assert drives(bench)


def test_noise_bytes_cost_no_frame(make: MakeBench) -> None:
    bench = make()
    for _ in range(20):
        bench.create.faults.noise = bytes([19, 72, 7, 0, 255, 19] * 5)
        bench.run(0.05, FORWARD)
    assert bench.base.wheels == (0.2, 0.2)
    assert bench.driver.decoder.noise_bytes >= 20 * 30
    assert bench.diagnoses()["TurtleBot Node"].values["Noise Bytes"] != "0"


def test_a_deaf_base_is_told_again(make: MakeBench) -> None:
    bench = make()
    assert drives(bench)
    fault(bench, commands_lost=True)
    bench.run(1.0)
    assert bench.base.wheels == (0.2, 0.2)  # it heard no stop
    heal(bench)
    bench.run(0.05)
    assert bench.base.wheels == (0.0, 0.0)


def test_unplug_and_replug(make: MakeBench) -> None:
    bench = make()
    assert drives(bench)
    bench.unplug()
    bench.run(0.1)
    level, message = worst(bench, "TurtleBot Node")
    assert level is Severity.ERROR
    assert "went away" in message
    bench.run(1.0)
    assert "no such port" in worst(bench, "TurtleBot Node")[1]
    bench.plug()
    bench.run(0.7)
    # The base rolled on without a host; the first byte of the new connection stops it.
    assert bench.base.wheels == (0.0, 0.0)
    bench.run(3.0)
    assert worst(bench, "TurtleBot Node") == (Severity.OK, "RUNNING")
    assert drives(bench)


def test_a_power_cycle(make: MakeBench) -> None:
    bench = make()
    assert drives(bench)
    bench.create.receive(bytes([7]), bench.now)
    bench.run(12.0)
    assert bench.create.mode.name == "FULL"
    assert drives(bench)


def test_an_empty_battery_stops_the_base(make: MakeBench) -> None:
    bench = make()
    bench.create.battery.charge_mah = 0.1 * 2700
    assert drives(bench)
    assert worst(bench, "Battery") == (
        Severity.WARN,
        "the battery is low: bring the base to its charger",
    )
    bench.create.battery.charge_mah = 0.01 * 2700
    bench.run(0.1, FORWARD)
    assert bench.base.wheels == (0.0, 0.0)
    assert "battery is empty" in worst(bench, "Operating Mode")[1]
    assert not drives(bench, BACK)
    bench.create.battery.charge_mah = 0.5 * 2700
    bench.run(0.1)
    assert drives(bench)


def test_a_charging_fault_is_told(make: MakeBench) -> None:
    bench = make(operation_mode=1, charge_reset=False)
    fault(bench, charger=True, charging_fault=True)
    bench.run(0.1)
    level, message = worst(bench, "Battery")
    assert (level, message[:14]) == (Severity.ERROR, "charging fault")


def test_a_gyro_that_drifts_stops_the_base_until_it_is_calibrated(make: MakeBench) -> None:
    bench = make()
    fault(bench, gyro_drift=10.0)
    for _ in range(20):
        bench.run(0.5, FORWARD)
        if bench.base.wheels == (0.0, 0.0):
            break
    assert bench.base.wheels == (0.0, 0.0)
    level, message = worst(bench, "Gyro Sensor")
    assert level is Severity.ERROR
    assert "calibrate" in message
    fault(bench, gyro_drift=0.0)
    bench.run(0.5, FORWARD)
    assert bench.base.wheels == (0.0, 0.0)
    bench.run(1.5)
    assert worst(bench, "Gyro Sensor")[0] is Severity.OK
    assert drives(bench)
    assert bench.reading is not None
    assert bench.reading.gyro is not None
    assert bench.reading.gyro.rate == pytest.approx(0.0, abs=0.01)


def test_a_gyro_that_drifts_at_rest_is_followed(make: MakeBench) -> None:
    bench = make()
    fault(bench, gyro_drift=4.0)
    bench.run(5.0)
    fault(bench, gyro_drift=0.0)
    bench.run(1.0)
    assert drives(bench, seconds=1.5)
    assert bench.reading is not None
    assert bench.reading.gyro is not None
    assert bench.reading.gyro.offset == pytest.approx(532, abs=4.1)


@pytest.mark.parametrize("twist", [FORWARD, Twist2(0.2, 0.4)], ids=["straight", "turning"])
def test_a_gyro_that_dies_leaves_the_heading_to_the_wheels(make: MakeBench, twist: Twist2) -> None:
    bench = make()
    bench.run(0.5, twist)
    assert bench.base.wheels[0] > 0.0
    fault(bench, gyro_dead=True)
    bench.run(0.7, twist)
    assert "GYRO" in bench.reasons
    bench.run(0.6, twist)
    assert bench.base.wheels == (0.0, 0.0)
    bench.run(2.0)
    level, message = worst(bench, "Gyro Sensor")
    assert level is Severity.ERROR
    assert "power" in message
    assert drives(bench)
    assert bench.reading is not None
    assert bench.reading.gyro is None


def test_a_base_that_hears_nothing_is_told_of_and_stopped_when_it_hears(make: MakeBench) -> None:
    bench = make()
    assert drives(bench)
    fault(bench, commands_lost=True)
    bench.run(1.5, BACK)
    assert bench.base.wheels == (0.2, 0.2)  # nobody can help that
    bench.run(0.8, BACK)
    level, message = worst(bench, "TurtleBot Node")
    assert (level, "does not acknowledge its commands" in message) == (Severity.ERROR, True)
    heal(bench)
    bench.run(0.1, BACK)
    assert bench.base.wheels == (0.0, 0.0)
    bench.run(0.2)
    assert worst(bench, "TurtleBot Node") == (Severity.OK, "RUNNING")
    assert drives(bench, BACK)


def test_a_firmware_that_reports_no_speeds_drives_when_nobody_checks_them(make: MakeBench) -> None:
    for checked in (True, False):
        bench = make(check_acknowledgement=checked)
        assert drives(bench)
        fault(bench, commands_lost=True)  # what it reports stays the same, whatever it is told
        bench.run(3.0, BACK)
        assert ("NO_RESPONSE" in bench.reasons) is checked


def test_quick_changes_of_speed_are_not_taken_for_a_missing_acknowledgement(make: MakeBench) -> None:
    bench = make()
    for number in range(300):
        bench.run(0.01, Twist2(0.1 + 0.3 * math.sin(number / 7.0), 0.0))
    assert bench.reasons == []


# -- a line that spoils what it carries ----------------------------------------------------------------------


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flipped(data: bytes) -> bytes:
    return bytes(byte ^ 0x40 for byte in data)


@pytest.mark.parametrize(
    "spoil",
    [
        cut,
        flipped,
        lambda data: b"\xff" * len(data),
        lambda data: bytes(len(data)),
        lambda data: b"\x13" * len(data),
        lambda data: data[::-1],
        lambda data: random.Random(len(data)).randbytes(len(data)),
    ],
    ids=["cut", "flipped", "ff", "zeros", "headers", "reversed", "noise"],
)
def test_a_base_whose_words_are_spoilt_stands_is_told_and_recovers(
    make: MakeBench, spoil: Callable[[bytes], bytes]
) -> None:
    bench = make()
    assert drives(bench)
    where = bench.base.advanced
    bench.spoil = spoil
    bench.run(3.0, FORWARD)
    assert bench.base.wheels == (0.0, 0.0)
    assert bench.base.advanced - where < 0.2 * 0.8
    assert bench.reading is None, "nothing is told in its place"
    level, message = worst(bench, "TurtleBot Node")
    assert level is Severity.ERROR and "no good frame" in message
    assert len(bench.driver.decoder._buffer) < 200
    bench.spoil = bytes
    bench.run(3.0)
    assert drives(bench)
    assert worst(bench, "TurtleBot Node")[0] is not Severity.ERROR


def test_a_line_that_spoils_every_third_frame_is_told(make: MakeBench) -> None:
    bench = make()
    calls = 0

    def now_and_then(data: bytes) -> bytes:
        nonlocal calls
        calls += bool(data)
        return cut(data) if data and calls % 3 == 0 else data

    bench.spoil = now_and_then
    assert drives(bench, seconds=3.0)
    level, message = worst(bench, "TurtleBot Node")
    assert level is Severity.WARN and "damaged" in message
    bench.spoil = bytes
    bench.run(11.0)
    assert worst(bench, "TurtleBot Node") == (Severity.OK, "RUNNING")
