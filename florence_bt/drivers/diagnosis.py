"""How well a device does, and how often it delivers; the nodes turn these values into diagnostic messages."""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

FREQUENCY_TOLERANCE = 0.05
"""hokuyo_node's window around the expected rate (REFERENCE 4.9)."""


class Severity(enum.IntEnum):
    """The levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One line of diagnostics.

    Attributes:
        level: How bad it is.
        message: What it is, in words.
        values: Details by name.
    """

    level: Severity
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def is_off(rate: float, expected: float, tolerance: float = FREQUENCY_TOLERANCE) -> bool:
    """Whether a rate lies outside of the window around the expected one."""
    return abs(rate - expected) > tolerance * expected


class FrequencyMeter:
    """Measures a rate over the last arrivals.

    Args:
        window_s: Arrivals older than this no longer count, in seconds.
    """

    def __init__(self, window_s: float = 3.0) -> None:
        self._window_s = window_s
        self._arrivals: deque[float] = deque()

    def tick(self, now: float) -> None:
        """Note an arrival."""
        self._arrivals.append(now)
        self._forget(now)

    def rate(self, now: float) -> float:
        """Arrivals a second; 0 when fewer than two lie in the window.

        The mean distance between the arrivals counts, so that a steady 10 Hz reads 10.0 at any moment; a
        gap since the last one longer than that mean pulls the rate down.
        """
        self._forget(now)
        if len(self._arrivals) < 2:
            return 0.0
        gaps = len(self._arrivals) - 1
        span = self._arrivals[-1] - self._arrivals[0]
        if span <= 0.0:
            return 0.0
        silence = now - self._arrivals[-1]
        return gaps / span if silence <= 2.0 * span / gaps else gaps / (span + silence)

    def _forget(self, now: float) -> None:
        while self._arrivals and now - self._arrivals[0] > self._window_s:
            self._arrivals.popleft()
