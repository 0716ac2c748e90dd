"""The Hokuyo driver on a real serial line (RS-232), where both ends must have one speed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip_models import ScipFaults
from tests.emulators.program_bench import LONG_S
from tests.emulators.scip_bench import Bench
from tools.emulators.scip_program import ScipOptions, ScipProgram

PLAIN = HokuyoParameters(calibrate_time=False)


class Wire(Bench):
    """A bench whose line turns everything into garbage while the two ends have different speeds."""

    def __init__(self, bit_rate: int, **how: object) -> None:
        super().__init__(PLAIN, **how)  # type: ignore[arg-type]
        self.driver = HokuyoDriver(PLAIN, self.problems.append, bit_rate)

    def run(self, seconds: float, step: float = 0.005) -> list[object]:  # type: ignore[override]
        before = len(self.scans)
        for _ in range(round(seconds / step)):
            self.now += step
            self.world.now = self.now
            self._deliver(self._heard(self.scanner.poll(self.now), self.scanner.bit_rate))
            while data := self.driver.poll(self.now):
                rate = self.scanner.bit_rate  # SS is answered at the old one
                answer = self.scanner.receive(self._heard(data, rate), self.now)
                self._deliver(self._heard(answer, rate))
        return list(self.scans[before:])

    def _heard(self, data: bytes, rate: int) -> bytes:
        return data if rate == self.driver.bit_rate else b"\xff" * len(data)


def measuring(wire: Wire) -> int:
    assert wire.driver.phase is DriverPhase.MEASURING
    assert wire.scanner.bit_rate == wire.driver.bit_rate
    assert len(wire.run(1.0)) >= 9
    return wire.scanner.bit_rate


@pytest.mark.parametrize("wanted", [19200, 38400, 115200, 750000])
@pytest.mark.parametrize("scip1", [False, True])
def test_a_sensor_that_was_just_switched_on(wanted: int, scip1: bool) -> None:
    wire = Wire(wanted, scip1=scip1)
    wire.driver.start(0.0)
    wire.run(25.0)
    assert measuring(wire) == wanted


@pytest.mark.parametrize("left", ["019200", "038400", "057600", "115200"])
def test_a_sensor_that_somebody_left_at_another_speed(left: str) -> None:
    wire = Wire(115200)
    wire.scanner.receive(b"SS" + left.encode() + b"\nMD0100020001000\n", 0.0)
    wire.driver.start(0.0)
    wire.run(20.0)
    assert measuring(wire) == 115200


def test_a_power_cut_slows_the_sensor_down_again() -> None:
    wire = Wire(115200)
    wire.driver.start(0.0)
    wire.run(10.0)
    wire.scanner.set_power(False, wire.now)
    wire.run(1.0)
    wire.scanner.set_power(True, wire.now)
    wire.run(20.0)
    assert measuring(wire) == 115200


def test_a_sensor_that_cannot_be_faster() -> None:
    wire = Wire(115200)
    wire.scanner.faults = ScipFaults(statuses={"SS": "04"})
    wire.driver.start(0.0)
    wire.run(20.0)
    assert measuring(wire) == 19200


def test_a_line_without_speed_is_left_alone() -> None:
    bench = Bench(PLAIN)
    bench.driver.start(0.0)
    bench.run(1.0)
    assert bench.driver.bit_rate is None
    assert bench.scanner.bit_rate == 19200  # SS was not sent


@pytest.fixture
def program(tmp_path: Path) -> Iterator[ScipProgram]:
    program = ScipProgram(ScipOptions(link=tmp_path / "laser", strict_baud=True), time.monotonic)
    yield program
    program.close()


def test_on_a_port(program: ScipProgram) -> None:
    port = SerialPort(program.path, 115200)
    driver = HokuyoDriver(HokuyoParameters(calibrate_time=False, reply_timeout_s=0.3), bit_rate=115200)
    driver.start(0.0)
    scans = 0
    start = time.monotonic()
    while scans < 3 and time.monotonic() < start + 6.0 * LONG_S:
        now = time.monotonic() - start
        if data := driver.poll(now):
            assert driver.bit_rate is not None
            port.set_baud_rate(driver.bit_rate)
            port.write(data)
        program.step()
        scans += len(driver.receive(port.read(0.001), now))
    assert scans >= 3
    assert program.scanner.bit_rate == 115200
    with pytest.raises(DeviceLost, match="cannot be set to -1 baud"):
        port.set_baud_rate(-1)
    port.close()


def test_a_client_at_the_wrong_speed(program: ScipProgram) -> None:
    port = SerialPort(program.path, 115200)
    line = program._line
    assert isinstance(line, PseudoTerminal)
    read, taken = line.read, bytearray()

    def note_read() -> bytes:
        data = read()
        taken.extend(data)
        return data

    line.read = note_read  # type: ignore[method-assign]

    def say(data: bytes) -> None:
        """Speak, and wait until it has come: the speed counts that the line has then."""
        taken.clear()
        port.write(data)
        while len(taken) < len(data):
            program.step()

    def hear(size: int) -> bytes:
        heard, end = b"", time.monotonic() + LONG_S
        while len(heard) < size and time.monotonic() < end:
            program.step()
            heard += port.read(0.001)
        return heard

    say(b"QT")
    port.set_baud_rate(19200)
    port.write(b"PP\n")  # what was said before does not spoil it
    assert hear(8).startswith(b"PP\n00P\n")
    say(b"MD0044072501000\n")
    port.set_baud_rate(115200)
    assert hear(1500)[-400:] == b"\xff" * 400
    port.close()
