"""Driver, serial port, pseudo-terminal and emulated scanner in one line: real bytes through real files.

The time is driven by hand; only reading waits, and only for bytes that are known to be under way.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.errors import DeviceLost
from florence_bt.core.sensing import LaserScan
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import ScipEmulator


class Room:
    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        return np.arange(first_step, last_step + 1, dtype=np.int32) + 1000


class Line:
    def __init__(self, link: Path) -> None:
        self.scanner = ScipEmulator(Room())
        self.driver = HokuyoDriver(HokuyoParameters(calibrate_time=False))
        self.now = 0.0
        self._link = link
        self.plug_in()

    def plug_in(self) -> None:
        self.terminal = PseudoTerminal(self._link)
        self.port = SerialPort(str(self._link), 115200)

    def close(self) -> None:
        self.port.close()
        self.terminal.close()

    def run(self, seconds: float) -> list[LaserScan]:
        scans: list[LaserScan] = []
        for _ in range(round(seconds / 0.005)):
            self.now += 0.005
            scans += self._to_host(self.scanner.poll(self.now))
            while data := self.driver.poll(self.now):
                scans += self._to_host(self.scanner.receive(self._to_device(data), self.now))
        return scans

    def _to_device(self, data: bytes) -> bytes:
        self.port.write(data)
        arrived = b""
        while len(arrived) < len(data):
            arrived += self.terminal.read()
        assert arrived == data
        return arrived

    def _to_host(self, data: bytes) -> list[LaserScan]:
        self.terminal.write(data)
        assert self.terminal.lost_bytes == 0
        scans: list[LaserScan] = []
        arrived = 0
        while arrived < len(data):
            piece = self.port.read(60.0)
            assert piece
            arrived += len(piece)
            scans += self.driver.receive(piece, self.now)
        return scans


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    line = Line(tmp_path / "ttyACM0")
    yield line
    line.close()


def test_scans_through_a_pseudo_terminal(line: Line) -> None:
    line.driver.start(0.0)
    scans = line.run(2.0)
    assert len(scans) >= 18
    expected = np.arange(1044, 1726, dtype=np.float32) / np.float32(1000.0)
    assert all((scan.ranges == expected).all() for scan in scans)
    assert line.driver.corrupted == 0


def test_only_its_owner_may_use_the_line(line: Line) -> None:
    assert Path(line.terminal.path).stat().st_mode & 0o077 == 0


def test_every_byte_value_passes_the_line(line: Line) -> None:
    line.driver.start(0.0)
    line.run(1.0)
    line.scanner.faults.noise = bytes(range(256))
    assert len(line.run(1.0)) == 10
    assert line.driver.corrupted == 1


def test_a_pulled_plug_and_its_return(line: Line) -> None:
    line.driver.start(0.0)
    line.run(1.0)
    line.terminal.unplug()
    with pytest.raises(DeviceLost) as lost:
        line.port.read(60.0)
    line.driver.disconnected(str(lost.value))
    line.port.close()
    assert line.driver.phase is DriverPhase.STOPPED
    assert line.driver.lost == 1
    line.plug_in()
    line.driver.start(line.now)
    assert len(line.run(1.0)) >= 8


def test_shutdown_reaches_the_scanner(line: Line) -> None:
    line.driver.start(0.0)
    line.run(1.0)
    assert line.scanner.laser_on
    line.port.write(line.driver.shutdown())
    data = b""
    while not data.endswith(b"\n"):
        data += line.terminal.read()
    line.scanner.receive(data, line.now)
    assert not line.scanner.laser_on
