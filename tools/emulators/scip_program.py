"""The emulated scanner alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it.

The clock is given.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.emulators.scip import ScipEmulator
from florence_bt.simulation.emulators.scip_models import MODELS, ScannerModel, ScipFaults
from tools.emulators.standalone import (
    COUNT,
    GARBAGE,
    ControlCommand,
    StandaloneEmulator,
    StandaloneOptions,
    number,
    switch,
)

LONGEST_WAIT_S = 0.1
_STATUS = re.compile(r"[0-9][0-9A-Z]")


@dataclass(frozen=True, slots=True)
class ScipOptions(StandaloneOptions):
    """The options of the program; with ``strict_baud`` the scanner wakes up with 19200, as on RS-232.

    Attributes:
        model: A name in ``MODELS``.
        scip1: Wake up in SCIP 1.1.
        short_status: In SCIP 1.1, answer ``SCIP2.0`` with ``0`` and no sum.
    """

    model: str = "urg-04lx"
    scip1: bool = False
    short_status: bool = False


class ScipProgram(StandaloneEmulator):
    """Line, scanner and control channel.

    Attributes:
        scanner: The scanner.
    """

    def __init__(self, options: ScipOptions, clock: Callable[[], float], console: int | None = None) -> None:
        """Open the line and the control channel.

        Args:
            options: How to run it.
            clock: Seconds, never running backwards.
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The link, the TCP port or the socket cannot be made.
        """
        super().__init__(options)
        self._start = clock()
        self._clock = clock
        model = MODELS[options.model]
        self.scanner = ScipEmulator(
            ScipRoom(model, options.seed),
            model=model,
            speaks_scip1=options.scip1,
            short_status=options.short_status,
        )
        self.faults: ScipFaults = self.scanner.faults
        self._listen(console)

    def now(self) -> float:
        """Return the seconds since the start."""
        return self._clock() - self._start

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now, line = self.now(), self._line
        baud_rate = self.scanner.bit_rate  # SS is answered at the old one
        received = self._received_at_other_end(line.read(), baud_rate) if line is not None else b""
        received = received.replace(bytes([GARBAGE]), b"")  # no letters: the scanner passes over them
        answer = (self.scanner.receive(received, now) if received else b"") + self.scanner.poll(now)
        if answer and line is not None:
            line.write(self._received_at_other_end(answer, baud_rate))

    def _longest_wait(self) -> float:
        due = self.scanner.next_deadline()
        return LONGEST_WAIT_S if due is None else max(0.0, min(LONGEST_WAIT_S, due - self.now()))

    # -- the control channel -------------------------------------------------------------------------------

    def control_commands(self) -> Sequence[ControlCommand]:
        """Return the commands for everything that goes wrong with a scanner."""
        return (
            self.fault("bad_replies NUMBER", "the next answers to commands have a wrong checksum", COUNT),
            self.fault(
                "partial NUMBER", "the next scan ends after so many bytes", COUNT, field="cut_scan_at"
            ),
            self.fault(
                "scan_status STATUS",
                "the next scan is replaced by this status (50: hardware trouble) and measuring ends",
                _status,
            ),
            self.fault(
                "every_scan_status STATUS|none",
                "every scan is replaced by this status and measuring goes on",
                lambda words: None if words == ["none"] else _status(words),
            ),
            ControlCommand(
                "status_of COMMAND STATUS|none",
                "every COMMAND (PP, TM1, ...) is answered with this status",
                self._status_of,
            ),
            self.fault("laser_broken on|off", "BM is refused, measuring ends with 50", switch),
            self.fault(
                "stat TEXT",
                "the text of STAT; without one the healthy one",
                lambda words: " ".join(words) or None,
            ),
            self.fault(
                "freeze_timer on|off",
                "every time stamp is the same",
                lambda words: self.scanner.timer(self.now()) if switch(words) else None,
                field="frozen_timer_ms",
            ),
            self.fault(
                "delay SECONDS", "everything leaves so much later", number(0.0, 60.0), field="delay_s"
            ),
            self.fault(
                "speed BYTES",
                "bytes per second that leave; 0 for at once",
                lambda words: number(0.0, 1e7)(words) or None,
                field="bytes_per_second",
            ),
        )

    def set_power(self, on: bool) -> None:
        """Switch the scanner on or off."""
        self.scanner.set_power(on, self.now())

    def _status_of(self, words: list[str]) -> None:
        if len(words) != 2:
            raise ConfigError("a command and a status are needed", valid=["PP 0A", "PP none"])
        if words[1] == "none":
            self.faults.statuses.pop(words[0], None)
        else:
            self.faults.statuses[words[0]] = _status(words[1:])

    def status(self) -> str:
        """Describe the scanner as one line of JSON."""
        scanner = self.scanner
        return json.dumps(
            {
                "model": scanner.model.name,
                "plugged": self.plugged,
                "powered": scanner.powered,
                "laser": scanner.laser_on,
                "measuring": scanner.measuring,
                "scip": "1.1" if scanner.speaks_scip1 else "2.0",
                "timer_ms": scanner.timer(self.now()),
            }
        )


def _status(words: list[str]) -> str:
    if len(words) != 1 or not _STATUS.fullmatch(words[0]):
        raise ConfigError(
            f"{' '.join(words)!r} is not a status", valid=["a digit and a digit or letter: 50, 0A"]
        )
    return words[0]


AHEAD_M, BEHIND_M, LEFT_M, RIGHT_M = 3.0, 1.0, 2.0, 1.5
PILLAR_X_M, PILLAR_Y_M, PILLAR_RADIUS_M = 1.5, 0.5, 0.15
NOISE_MM = 10.0
"""Standard deviation of a distance."""


class ScipRoom:
    """Distances from a scanner that stands still in a room, the same in every turn unless there is noise."""

    def __init__(self, model: ScannerModel, seed: int | None = None) -> None:
        """Work the distances out.

        Args:
            model: The scanner.
            seed: Start of the noise; None for none.
        """
        steps = np.arange(model.outermost_step + 1, dtype=np.float64)
        angles: NDArray[np.float64] = (steps - model.number("AFRT")) * (2.0 * math.pi / model.number("ARES"))
        metres = np.minimum(_walls(angles), _pillar(angles))
        self._distances = np.minimum(1000.0 * metres, model.number("DMAX"))
        self._minimum = model.number("DMIN")
        self._random = None if seed is None else np.random.default_rng(seed)

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        """Return the distances of the steps first..last, shape (last - first + 1,), millimetres."""
        wanted = self._distances[first_step : last_step + 1]
        if self._random is not None:
            wanted = wanted + self._random.normal(0.0, NOISE_MM, len(wanted))
        return np.maximum(np.rint(wanted), self._minimum).astype(np.int32)


def _walls(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        along = np.where(x > 0.0, AHEAD_M / np.abs(x), BEHIND_M / np.abs(x))
        across = np.where(y > 0.0, LEFT_M / np.abs(y), RIGHT_M / np.abs(y))
    return np.minimum(along, across)


def _pillar(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    along = PILLAR_X_M * np.cos(angles) + PILLAR_Y_M * np.sin(angles)
    aside = -PILLAR_X_M * np.sin(angles) + PILLAR_Y_M * np.cos(angles)
    depth = PILLAR_RADIUS_M**2 - aside**2
    hit = (depth >= 0.0) & (along > 0.0)
    return np.where(hit, along - np.sqrt(np.maximum(depth, 0.0)), np.inf)
