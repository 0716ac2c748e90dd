"""Rates of what is published, and sums of what adds up meanwhile: the base measures faster than that."""

from __future__ import annotations

from dataclasses import replace

from florence_bt.drivers.turtlebot.codec.state import SensorState


class RateLimiter:
    """Picks moments at a mean rate out of readings that come more often."""

    def __init__(self, rate: float) -> None:
        """Take the rate.

        Args:
            rate: Per second, above zero.
        """
        self._period = 1.0 / rate
        self._next: float | None = None
        self._last: float | None = None

    def is_due(self, stamp: float) -> bool:
        """Tell whether something is to be published at this moment; True also starts the next period.

        A moment is not published twice, as with readings that arrived together.
        """
        if stamp == self._last:
            return False
        if self._next is None or stamp - self._next > 2.0 * self._period:  # a gap
            self._next = stamp
        if stamp < self._next:
            return False
        self._next += self._period
        self._last = stamp
        return True


class StateReport:
    """Adds up distance and angle between two reports, so that a slow listener misses no motion."""

    def __init__(self) -> None:
        self._distance = 0.0
        self._angle = 0.0

    def add(self, state: SensorState) -> None:
        """Take one state."""
        self._distance += state.distance
        self._angle += state.angle

    def take(self, state: SensorState) -> SensorState:
        """Return the newest state with distance and angle since the last call of this."""
        report = replace(state, distance=self._distance, angle=self._angle)
        self._distance = self._angle = 0.0
        return report
