"""VV and II only identify the sensor: what is wrong with their answers is told, and the laser measures."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import DriverPhase
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.simulation.emulators.scip_models import UTM_30LX
from tests.emulators.scip_bench import Bench
from tests.sweeps import sweep

Change = Callable[[bytes], bytes]


def lines_of(change: Callable[[list[bytes]], list[bytes]]) -> Change:
    """Change the data lines of a reply."""

    def changed(data: bytes) -> bytes:
        echo, status, *lines = data[:-2].split(b"\n")
        return b"\n".join([echo, status, *change(lines), b"", b""])

    return changed


def summed(text: bytes) -> bytes:
    return text + b";" + bytes([(sum(text) & 0x3F) + 0x30])


FAULTS: dict[str, Change] = {
    "a wrong sum in the first line": lines_of(lambda lines: [lines[0][:-1] + b"~", *lines[1:]]),
    "a wrong sum in the last line": lines_of(lambda lines: [*lines[:-1], lines[-1][:-1] + b"~"]),
    "wrong sums everywhere": lines_of(lambda lines: [line[:-1] + b"~" for line in lines]),
    "an extra line": lines_of(lambda lines: [*lines, b"I"]),
    "an extra line in the middle": lines_of(lambda lines: [lines[0], b"I", *lines[1:]]),
    "an extra line with a sum": lines_of(lambda lines: [summed(b"I"), *lines]),
    "a byte over 0x7F": lines_of(lambda lines: [b"\xe9" + lines[0], *lines[1:]]),
    "bytes over 0x7F with a good sum": lines_of(lambda lines: [*lines[:-1], summed(b"STAT:\xff\x80")]),
    "no sums": lines_of(lambda lines: [line[:-2] for line in lines]),
    "missing lines": lines_of(lambda lines: lines[:-2]),
    "unknown keys": lines_of(lambda lines: [summed(b"X" + line[:-2]) for line in lines]),
    "an empty reply": lines_of(lambda lines: []),
    "a truncated reply": lambda data: data[: len(data) // 2],
    "nothing but the echo": lambda data: data[:3],
    "a bad status line": lambda data: data[:3] + b"\xff\xff\n" + data[7:],
    "another echo": lambda data: b"XX" + data[2:],
    "no answer": lambda data: b"",
    "the answer twice": lambda data: data + data,
    "a refusal": lambda data: data[:3] + b"0EU\n\n",
    "an unknown status": lambda data: data[:3] + b"77n\n\n",
}
HARMLESS = {("the answer twice", "VV"), ("the answer twice", "II")}
"""What leaves nothing out."""


def disturbed(command: str, change: Change, times: int = 1000, model: object = None) -> Bench:
    """A scanner whose answers to a command are changed so many times, and its driver."""
    bench = Bench() if model is None else Bench(HokuyoParameters(calibrate_time=False), model=model)  # type: ignore[arg-type]
    receive, left = bench.scanner.receive, [times]

    def answer(data: bytes, now: float) -> bytes:
        reply = receive(data, now)
        if command.encode() in data.split() and left[0] > 0:
            left[0] -= 1
            return change(reply)
        return reply

    bench.scanner.receive = answer  # type: ignore[method-assign]
    bench.driver.start(0.0)
    return bench


@pytest.mark.parametrize(("name", "command"), sweep(itertools.product(FAULTS, ["VV", "II"]), every=3))
def test_the_laser_measures_and_says_what_it_does_not_know(name: str, command: str) -> None:
    bench = disturbed(command, FAULTS[name])
    bench.run(8.0)
    assert bench.driver.phase is DriverPhase.MEASURING, bench.problems
    assert len(bench.run(1.0)) >= 9 and bench.driver.retry.failures == 0
    found = diagnose(bench.driver, HokuyoParameters(), "", "", bench.now)
    if (name, command) in HARMLESS:
        assert (bench.problems, found.level) == ([], Severity.OK)
    else:
        assert len(bench.problems) == 1 and command in bench.problems[0], bench.problems
        assert (found.level, found.message) == (Severity.WARN, bench.problems[0])


@pytest.mark.parametrize("name", sweep(FAULTS, every=4))
def test_both_answers_may_be_bad(name: str) -> None:
    bench = disturbed("VV", FAULTS[name])
    receive = bench.scanner.receive
    bench.scanner.receive = lambda data, now: (  # type: ignore[method-assign]
        FAULTS[name](receive(data, now)) if b"II" in data.split() else receive(data, now)
    )
    bench.run(12.0)
    assert len(bench.run(1.0)) >= 9, bench.problems


@pytest.mark.parametrize(("name", "command"), sweep(itertools.product(FAULTS, ["VV", "II"]), every=3))
def test_a_disturbance_that_passes_is_not_even_told(name: str, command: str) -> None:
    bench = disturbed(command, FAULTS[name], times=1)
    bench.run(4.0)
    assert bench.problems == [] and len(bench.run(1.0)) >= 9
    assert bench.driver.sensor is not None and not bench.driver.sensor.warnings
    assert bench.driver.sensor.device_id == "H0614967" and bench.driver.sensor.stat == "Sensor works well."


def test_what_can_be_read_is_known() -> None:
    bench = disturbed("VV", FAULTS["a wrong sum in the first line"])
    bench.run(2.0)
    assert bench.driver.sensor is not None
    assert bench.driver.sensor.device_id == "H0614967" and "VEND" not in bench.driver.sensor.version


@pytest.mark.parametrize("name", [name for name in FAULTS if name != "the answer twice"])
def test_what_is_needed_of_the_parameters_stays_needed(name: str) -> None:
    bench = disturbed("PP", FAULTS[name])
    assert bench.run(8.0) == [] and bench.problems
    assert bench.driver.phase is not DriverPhase.MEASURING


def test_a_sensor_that_says_that_it_is_ill_is_not_used_though_another_line_is_bad() -> None:
    bench = disturbed("II", FAULTS["an extra line"])
    bench.scanner.faults.stat = "Sensor is ill."
    assert bench.run(8.0) == []
    assert "Sensor is ill." in bench.problems[0]


def test_a_utm_that_does_not_say_who_it_is_stays_safe_with_intensities() -> None:
    """Its windows are limited for the eyes; PP has its model, too."""
    wanted = HokuyoParameters(calibrate_time=False, intensity=True, min_ang=-2.0, max_ang=2.0)
    whole, unknown = Bench(wanted, model=UTM_30LX), Bench(wanted, model=UTM_30LX)
    unknown.scanner.faults.statuses["VV"] = "0E"
    for bench in (whole, unknown):
        bench.driver.start(0.0)
        bench.run(8.0)
        assert bench.driver.measurement is not None, bench.problems
    assert whole.driver.measurement is not None and unknown.driver.measurement is not None
    assert unknown.driver.measurement.last_step <= whole.driver.measurement.last_step
