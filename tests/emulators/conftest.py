"""What the emulators' tests share."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.emulators.program_bench import EmulatorProcess


class KinematicBase:
    """A base that does at once what it is told; ``step`` moves it."""

    separation = 0.26

    def __init__(self) -> None:
        self.wheels = (0.0, 0.0)
        self.rolled = (0.0, 0.0)
        self.pressed = (False, False)

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        self.wheels = (left_mps, right_mps)

    def travel(self) -> tuple[float, float]:
        return self.rolled

    def yaw_rate(self) -> float:
        return (self.wheels[1] - self.wheels[0]) / self.separation

    def bumpers(self) -> tuple[bool, bool]:
        return self.pressed

    def step(self, seconds: float) -> None:
        self.rolled = (
            self.rolled[0] + self.wheels[0] * seconds,
            self.rolled[1] + self.wheels[1] * seconds,
        )

    @property
    def advanced(self) -> float:
        return (self.rolled[0] + self.rolled[1]) / 2.0

    @property
    def turned(self) -> float:
        return (self.rolled[1] - self.rolled[0]) / self.separation


@pytest.fixture
def base() -> KinematicBase:
    return KinematicBase()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., EmulatorProcess]]:
    """Starts an emulator as a process: the device, then options."""
    started: list[EmulatorProcess] = []

    def start_one(device: str, *options: str) -> EmulatorProcess:
        started.append(EmulatorProcess(tmp_path, device, *options))
        return started[-1]

    yield start_one
    for one in started:
        one.end()
