"""How often a device delivers."""

from __future__ import annotations

from collections import deque

FREQUENCY_TOLERANCE = 0.05
"""hokuyo_node's window around the expected rate (REFERENCE 4.9)."""


def is_off(rate: float, expected: float) -> bool:
    """Tell whether a rate lies outside of the window around the expected one."""
    return abs(rate - expected) > FREQUENCY_TOLERANCE * expected


WINDOW_S = 3.0
"""Arrivals older than this no longer count."""


class FrequencyMeter:
    """Measures a rate over the last arrivals."""

    def __init__(self) -> None:
        self._arrivals: deque[float] = deque()

    def tick(self, now: float) -> None:
        """Note an arrival."""
        self._arrivals.append(now)
        self._forget(now)

    def rate(self, now: float) -> float:
        """Return the arrivals per second; 0 when fewer than two lie in the window.

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
        while self._arrivals and now - self._arrivals[0] > WINDOW_S:
            self._arrivals.popleft()
