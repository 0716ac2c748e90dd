"""The real Hokuyo driver and the emulated scanner on one line; the time is driven by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import LaserScan
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.simulation.emulators.scip import ScipEmulator
from florence_bt.simulation.emulators.scip_models import URG_04LX, ScannerModel


class Clockwork:
    """A world whose every distance tells the moment of its measurement: 1000 mm + milliseconds."""

    def __init__(self) -> None:
        self.now = 0.0

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        return np.full(last_step - first_step + 1, 1000 + round(self.now * 1000.0) % 4000, np.int32)


class Bench:
    """Driver and scanner on one line; bytes may arrive in pieces, and late."""

    def __init__(
        self,
        parameters: HokuyoParameters | None = None,
        *,
        piece: int = 4096,
        scip1: bool = False,
        short_status: bool = False,
        model: ScannerModel = URG_04LX,
    ) -> None:
        self.world = Clockwork()
        self.scanner = ScipEmulator(self.world, model=model, speaks_scip1=scip1, short_status=short_status)
        self.problems: list[str] = []
        self.driver = HokuyoDriver(parameters or HokuyoParameters(calibrate_time=False), self.problems.append)
        self.scans: list[LaserScan] = []
        self.now = 0.0
        self._piece = piece

    def run(self, seconds: float, step: float = 0.005) -> list[LaserScan]:
        """Let time pass; returns the scans of that time."""
        before = len(self.scans)
        for _ in range(round(seconds / step)):
            self.now += step
            self.world.now = self.now
            self._deliver(self.scanner.poll(self.now))
            while data := self.driver.poll(self.now):
                self._deliver(self.scanner.receive(data, self.now))
        return self.scans[before:]

    def _deliver(self, data: bytes) -> None:
        for start in range(0, len(data), self._piece):
            self.scans += self.driver.receive(data[start : start + self._piece], self.now)


def started(seconds: float = 1.0, **how: object) -> Bench:
    bench = Bench(**how)  # type: ignore[arg-type]
    bench.driver.start(0.0)
    bench.run(seconds)
    assert bench.driver.phase is DriverPhase.MEASURING
    return bench
