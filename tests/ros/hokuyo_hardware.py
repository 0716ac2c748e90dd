"""An emulated scanner on a pseudo-terminal for tests of its node, in its own time or in the node's too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.clock import ManualClock
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import ScipEmulator
from tools.emulators.tcp_line import TcpLine


class Room:
    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        return np.arange(first_step, last_step + 1, dtype=np.int32) + 1000


class Hardware:
    """The scanner on its port; its own time passes 5 ms whenever it is served."""

    def __init__(self, link: Path) -> None:
        self.scanner = ScipEmulator(Room())
        self.link = link
        self.now = 0.0
        self.strict_baud = False
        self.terminal: PseudoTerminal | TcpLine | None = None

    def plug_in(self) -> None:
        self.terminal = PseudoTerminal(self.link)

    def unplug(self) -> None:
        if self.terminal is not None:
            self.terminal.unplug()
        self.terminal = None

    def serve(self) -> None:
        if self.terminal is None:
            return
        self.now += self._step_s()
        rate = self.scanner.bit_rate  # SS is answered at the old one
        self.terminal.write(self._heard(self.scanner.poll(self.now), rate))
        if data := self.terminal.read():
            self.terminal.write(self._heard(self.scanner.receive(self._heard(data, rate), self.now), rate))

    def _step_s(self) -> float:
        return 0.005

    def _heard(self, data: bytes, rate: int) -> bytes:
        same = not isinstance(self.terminal, PseudoTerminal) or self.terminal.client_baud == rate
        return data if same or not self.strict_baud else b"\xff" * len(data)


class CountedTerminal(PseudoTerminal):
    """The scanner's end of the line."""

    given = taken = 0

    def write(self, data: bytes) -> None:
        lost = self.lost_bytes
        super().write(data)
        self.given += len(data) - (self.lost_bytes - lost)

    def read(self) -> bytes:
        data = super().read()
        self.taken += len(data)
        return data


class CountedPort(SerialPort):
    """The node's end: what was read counts when it is handed on, that is at the next reading."""

    given = taken = read_last = 0

    def write(self, data: bytes) -> None:
        super().write(data)
        self.given += len(data)

    def read(self, timeout_s: float) -> bytes:
        self.taken += self.read_last
        data = super().read(timeout_s)
        self.read_last = len(data)
        return data


class LockStep(Hardware):
    """The scanner and the node in one time, which stands while bytes are on their way between them.

    So nothing is late between the two, however busy the machine is.
    """

    def __init__(self, link: Path) -> None:
        super().__init__(link)
        self.clock = ManualClock()
        self._port: CountedPort | None = None

    def plug_in(self) -> None:
        self.terminal = CountedTerminal(self.link)

    def open_port(self, path: str, baud_rate: int) -> SerialPort:
        assert isinstance(self.terminal, CountedTerminal)
        self.terminal.given = self.terminal.taken = 0
        self._port = CountedPort(path, baud_rate)
        return self._port

    def _step_s(self) -> float:
        port, terminal = self._port, self.terminal
        assert port is not None and isinstance(terminal, CountedTerminal)
        if port.given != terminal.taken or terminal.given != port.taken:
            return 0.0
        self.clock.advance(0.005)
        return 0.005
