"""Diagnosis of a device's data: how often it delivers, and how much of it arrives damaged."""

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


DIAGNOSTICS_PERIOD_S = 1.0
"""Seconds between two messages on ``diagnostics`` of a device. Chosen."""
TOLERATED_DAMAGE = 0.05
"""Chosen: what a start in the middle of a frame costs is gone in a second; a loose plug costs more."""
DAMAGE_WINDOW_S = 10.0
"""Chosen: a plug that is loose now and then is told for so long each time."""
_SLICE_S = 0.1
"""Seconds in which all that came is counted together. Chosen: the window has a hundred of them."""


class LineQuality:
    """Tells how much of what a device sent lately was damaged."""

    def __init__(self) -> None:
        self._slices: deque[list[float]] = deque()

    def note(self, now: float, good: float, damaged: float) -> None:
        """Note what came, in bytes or in messages, the same for both.

        Args:
            now: Seconds.
            good: How much was whole.
            damaged: How much was not.
        """
        if good == damaged == 0:
            return
        if self._slices and 0.0 <= now - self._slices[-1][0] < _SLICE_S:
            self._slices[-1][1] += good
            self._slices[-1][2] += damaged
        else:
            self._slices.append([now, good, damaged])
        self._forget(now)

    def damage(self, now: float) -> float:
        """Return the damaged part of what came lately, 0 to 1; 0 when nothing came."""
        self._forget(now)
        damaged = sum(part[2] for part in self._slices)
        return damaged / (damaged + sum(part[1] for part in self._slices)) if damaged else 0.0

    def complaint(self, now: float) -> str:
        """Return what people are told when more is damaged than a good line loses; empty otherwise."""
        damage = self.damage(now)
        if damage <= TOLERATED_DAMAGE:
            return ""
        return (
            f"{damage:.0%} of what came in the last {DAMAGE_WINDOW_S:g} s was damaged: check the cable and "
            "its plugs, and that nobody else uses the port"
        )

    def _forget(self, now: float) -> None:
        while self._slices and not 0.0 <= now - self._slices[0][0] <= DAMAGE_WINDOW_S:
            self._slices.popleft()
