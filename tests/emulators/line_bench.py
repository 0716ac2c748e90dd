"""What the tests of the driver against the emulated Create share: both on one line, time by hand."""

from __future__ import annotations

from typing import Any

from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors

STEP = 0.005


class Bench:
    """Driver and base on one line; bytes may arrive in pieces."""

    def __init__(
        self,
        base: Any,
        noise: BaseNoiseParameters | None = PERFECT_BASE,
        *,
        seed: int = 0,
        piece: int = 4096,
        header_in_checksum: bool = False,
        **parameters: Any,
    ) -> None:
        self.base = base
        self.create = CreateEmulator(
            base, BaseSensors(base, seed, noise), header_in_checksum=header_in_checksum
        )
        self.driver = TurtlebotDriver(TurtlebotParameters(**parameters))
        self.readings: list[BaseReading] = []
        self.sent: list[tuple[float, bytes]] = []
        self.now = 0.0
        self._piece = piece
        self.driver.start(0.0)

    def run(self, seconds: float, twist: Twist2 | None = None) -> list[BaseReading]:
        """Let time pass, with the same velocity command every 0.1 s; returns the readings of that time."""
        before = len(self.readings)
        for number in range(round(seconds / STEP)):
            if twist is not None and number % 20 == 0:
                self.driver.command(twist, self.now)
            self._send(self.driver.poll(self.now))
            self.base.step(STEP)
            self.now += STEP
            self._deliver(self.create.poll(self.now))
        return self.readings[before:]

    def _send(self, data: bytes) -> None:
        if data:
            self.sent.append((self.now, data))
            self._deliver(self.create.receive(data, self.now))

    def _deliver(self, data: bytes) -> None:
        for start in range(0, len(data), self._piece):
            self.readings += self.driver.receive(data[start : start + self._piece], self.now)

    @property
    def latest(self) -> BaseReading:
        return self.readings[-1]


def ready(base: Any, noise: BaseNoiseParameters | None = PERFECT_BASE, **how: Any) -> Bench:
    """A bench whose base is awake and whose gyro has its rest offset."""
    bench = Bench(base, noise, **how)
    bench.run(3.0)
    assert bench.latest.gyro is not None or not how.get("has_gyro", True)
    return bench
