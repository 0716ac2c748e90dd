"""What the tests of the emulated Create share: a base that is awake; a driver on a line, time by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from florence_bt.core.diagnosis import Diagnosis
from florence_bt.core.errors import DeviceError
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseSensors

STEP = 0.005
LONG_S = 60.0
"""A limit for what takes microseconds."""

RETRY_S = 0.5


def awake(base: Any, mode: int = 132, **how: Any) -> CreateEmulator:
    """An emulated base that was started and told its mode, without a line."""
    create = CreateEmulator(base, BaseSensors(base, 0, PERFECT_BASE), **how)
    create.receive(bytes([128, mode]), 0.0)
    return create


class PtyBench:
    """Base, emulator, pseudo-terminal, serial port and driver; a lost port is opened again after a while.

    Attributes:
        spoil: What the line makes of the bytes that the base sends.
    """

    def __init__(self, base: Any, link: Path, model: str = "create", **parameters: Any) -> None:
        self.base = base
        self.create = CreateEmulator(base, BaseSensors(base, 0, PERFECT_BASE), model=model)
        self.driver = TurtlebotDriver(TurtlebotParameters(**parameters))
        self.line: PseudoTerminal | None = PseudoTerminal(link)
        self.port: SerialPort | None = None
        self.reading: BaseReading | None = None
        self.problem = ""
        self.reasons: list[str] = []
        self.now = 0.0
        self._link = link
        self._retry_at = 0.0
        self._answers = b""
        self.spoil: Callable[[bytes], bytes] = bytes

    def run(self, seconds: float, twist: Twist2 | None = None) -> None:
        """Let time pass, with the same velocity command every 0.1 s."""
        for number in range(round(seconds / STEP)):
            if twist is not None and number % 20 == 0:
                self.driver.command(twist, self.now)
            if self.port is None and self.now >= self._retry_at:
                self._open()
            try:
                self._step()
            except DeviceError as error:
                self._lose(error)

    def unplug(self) -> None:
        assert self.line is not None
        self.line.unplug()
        self.line = None

    def plug(self) -> None:
        self.line = PseudoTerminal(self._link)

    def diagnoses(self) -> dict[str, Diagnosis]:
        return diagnose(self.driver, self.reading, str(self._link), self.problem)

    def close(self) -> None:
        if self.port is not None:
            self.port.close()
        if self.line is not None:
            self.line.close()

    def _open(self) -> None:
        try:
            self.port = SerialPort(str(self._link), self.create.baud_rate)
        except DeviceError as error:
            self._lose(error)
            return
        self.driver.start(self.now)

    def _lose(self, error: DeviceError) -> None:
        self.problem = str(error)
        self.reading = None
        self._retry_at = self.now + RETRY_S
        shutdown_command = self.driver.shutdown()
        if self.port is not None:
            try:
                self._to_base(shutdown_command)
            except DeviceError as unheard:
                self.problem = str(unheard)
            self.port.close()
        self.port = None

    def _step(self) -> None:
        self.base.step(STEP)
        self.now += STEP
        if self.port is not None:
            self._to_base(self.driver.poll(self.now))
        answer, self._answers = self.spoil(self._answers + self.create.poll(self.now)), b""
        if self.line is not None:
            self.line.write(answer)
        if self.port is None:
            return
        if self.line is None:
            self.port.read(LONG_S)  # raises: the plug is out
        received = b""
        while len(received) < len(answer):
            received += self.port.read(LONG_S)
        for reading in self.driver.receive(received, self.now):
            self.reading, self.problem = reading, ""
            if reading.stop_reason is not None and reading.stop_reason.name not in self.reasons:
                self.reasons.append(reading.stop_reason.name)
        self._to_base(self.driver.poll(self.now))

    def _to_base(self, data: bytes) -> None:
        """Send bytes, and have the base take them off the line."""
        if not data or self.port is None:
            return
        self.port.write(data)
        received = b""
        while self.line is not None and len(received) < len(data):
            received += self.line.read()
        self._answers += self.create.receive(received, self.now)
