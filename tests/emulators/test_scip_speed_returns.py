"""A scanner on a real serial line that falls silent and returns: driver, port and pseudo-terminal.

The bytes go through a real device file whose two ends must have one speed; the time is driven by hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import ScipEmulator
from tests.emulators.program_bench import LONG_S
from tests.emulators.scip_bench import Clockwork

STEP_S = 0.01
WANTED = 115200
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 5.0
"""Those of the node, whose port is closed and opened again when the sensor is not heard."""


class Line:
    """The node's way with a port, without threads: nothing heard, it is opened again, later each time."""

    def __init__(self, link: Path) -> None:
        self.clock = ManualClock()
        self.world = Clockwork()
        self.scanner = ScipEmulator(self.world)
        self.problems: list[str] = []
        wanted = HokuyoParameters(calibrate_time=False)
        self.driver = HokuyoDriver(wanted, self.problems.append, bit_rate=WANTED)
        self.scans = 0
        self.connected = True
        self.opened = 0
        self._link = link
        self._terminal = PseudoTerminal(link)
        self._pause_s = FIRST_PAUSE_S
        self._reopen_at = 0.0
        self._port: SerialPort | None = None

    def close(self) -> None:
        if self._port is not None:
            self._port.close()
        self._terminal.close()

    def run(self, seconds: float) -> int:
        """Let time pass; gives the scans that came."""
        before = self.scans
        for _ in range(round(seconds / STEP_S)):
            self.step()
        return self.scans - before

    def until_scans(self) -> float:
        """Seconds until the next scan."""
        start, before = self.clock.now(), self.scans
        while self.scans == before:
            assert self.clock.now() < start + 120.0, self.driver.phase
            self.step()
        return self.clock.now() - start

    def step(self) -> None:
        self.clock.advance(STEP_S)
        now = self.world.now = self.clock.now()
        if self._port is None:
            if now < self._reopen_at:
                return
            self._port = SerialPort(str(self._link), WANTED)
            self.opened += 1
            self.driver.start(now)
        self._to_host(self._port, self.scanner.poll(now), self.scanner.bit_rate)
        while self._port is not None and (data := self.driver.poll(now)):
            self._to_device(self._port, data)
        if self.driver.no_answer:
            self._port.close()
            self._port = None
            self.driver.disconnected("nothing answers")
            self._reopen_at = now + self._pause_s
            self._pause_s = min(2.0 * self._pause_s, LONGEST_PAUSE_S)

    def _to_device(self, port: SerialPort, data: bytes) -> None:
        assert self.driver.bit_rate is not None
        port.set_baud_rate(self.driver.bit_rate)
        port.write(data)
        arrived = b""
        while len(arrived) < len(data):
            arrived += self._terminal.read()
        rate = self.scanner.bit_rate  # SS is answered at the old one
        if self.connected:
            self._to_host(port, self.scanner.receive(self._heard(arrived, rate), self.clock.now()), rate)

    def _to_host(self, port: SerialPort, data: bytes, rate: int) -> None:
        data = self._heard(data, rate)
        if not data or not self.connected:
            return
        self._terminal.write(data)
        arrived = b""
        while len(arrived) < len(data):
            piece = port.read(LONG_S)
            assert piece
            arrived += piece
        new = len(self.driver.receive(arrived, self.clock.now()))
        self.scans += new
        if new:
            self._pause_s = FIRST_PAUSE_S

    def _heard(self, data: bytes, rate: int) -> bytes:
        return data if self._terminal.client_baud == rate else b"\xff" * len(data)


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    line = Line(tmp_path / "ttyUSB0")
    line.until_scans()
    line.run(2.0)
    assert line.driver.phase is DriverPhase.MEASURING
    assert line.scanner.bit_rate == WANTED
    yield line
    line.close()


OUTAGES_S = [(0.5, 6.5), (3.0, 6.5), (5.0, 6.5), (7.3, 6.5), (12.0, 6.5), (31.7, 10.0), (60.0, 10.0)]
"""How long the sensor is away, and in what time it must be back: the pauses grow with the first."""


@pytest.mark.parametrize(("away_s", "limit_s"), OUTAGES_S)
def test_after_a_power_cut(line: Line, away_s: float, limit_s: float) -> None:
    """It has the speed of power on then: 19200."""
    line.scanner.set_power(False, line.clock.now())
    assert line.run(away_s) == 0
    line.scanner.set_power(True, line.clock.now())
    assert line.until_scans() < limit_s
    assert line.scanner.bit_rate == WANTED
    assert line.run(3.0) >= 28


@pytest.mark.parametrize(("away_s", "limit_s"), OUTAGES_S)
def test_after_the_cable_was_out(line: Line, away_s: float, limit_s: float) -> None:
    """It went on measuring at the speed that it was given."""
    line.connected = False
    assert line.run(away_s) == 0
    line.connected = True
    assert line.until_scans() < limit_s
    assert line.run(3.0) >= 28


@pytest.mark.parametrize("left", ["038400", "057600"])
def test_another_sensor_at_another_speed_is_found_too(line: Line, left: str) -> None:
    line.connected = False
    line.run(4.0)
    line.scanner.receive(b"QT\nSS" + left.encode() + b"\n", line.clock.now())
    assert line.scanner.bit_rate == int(left)
    line.connected = True
    assert line.until_scans() < 25.0
    assert line.scanner.bit_rate == WANTED


def test_a_silent_line_is_opened_again_soon(line: Line) -> None:
    line.connected = False
    line.run(7.0)  # 1 s of silence, 1 s of rest, two speeds of two answers' time, half a second
    assert line.opened == 2
    assert line.problems == [
        "no scan arrived in time",
        "no answer at 115200, 19200 baud; check the sensor's power and its cable",
    ]


def test_a_start_after_power_on_wastes_no_time(tmp_path: Path) -> None:
    """Two answers' time for the wanted speed, and none after ``RS``, which leads to the speed of power on."""
    line = Line(tmp_path / "ttyUSB0")
    assert line.until_scans() < 2.5
    line.close()
