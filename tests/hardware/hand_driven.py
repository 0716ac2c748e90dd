"""Stands for a device that nobody named: an emulator on a real pseudo-terminal, in a time driven by hand."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from tools.emulators.standalone import StandaloneEmulator

LONG_S = 60.0
"""A limit for bytes that are under way already."""


class Emulated:
    """An emulator whose time passes only while its client reads: nothing is late on a busy machine.

    Args:
        make: Makes the emulator; given its clock.

    Attributes:
        now: The time, seconds.
        sent: Bytes that clients wrote.
        taken: Bytes that the emulator read.
        given: Bytes that the emulator wrote.
    """

    def __init__(self, make: Callable[[Callable[[], float]], StandaloneEmulator]) -> None:
        self.now = 100.0
        self.sent = self.taken = self.given = 0
        self.program = make(self.clock)
        line = self.program._line
        assert isinstance(line, PseudoTerminal)
        read, write = line.read, line.write

        def count_read() -> bytes:
            data = read()
            self.taken += len(data)
            return data

        def count_write(data: bytes) -> None:
            lost = line.lost_bytes
            write(data)
            self.given += len(data) - (line.lost_bytes - lost)

        line.read, line.write = count_read, count_write  # type: ignore[method-assign]

    def clock(self) -> float:
        """The time."""
        return self.now

    def hear(self) -> None:
        """Let the emulator take what was sent to it."""
        while self.taken < self.sent:
            self.program.step()


class HandPort(SerialPort):
    """The client's end: what it is told is told at once, and each reading takes its time and no longer."""

    def __init__(self, emulated: Emulated, baud_rate: int) -> None:
        super().__init__(emulated.program.path, baud_rate)
        self._emulated = emulated
        self._heard = emulated.given

    def write(self, data: bytes) -> None:
        super().write(data)
        self._emulated.sent += len(data)

    def read(self, timeout_s: float) -> bytes:
        self._emulated.hear()
        self._emulated.now += timeout_s
        self._emulated.program.step()
        data = b""
        while self._heard < self._emulated.given:
            piece = super().read(LONG_S)
            assert piece, "what was sent did not come"
            data += piece
            self._heard += len(piece)
        return data

    def close(self) -> None:
        self._emulated.hear()
        super().close()
