"""How long ticks take and how far apart they are: the last one, and mean and variance of the last ten."""

from __future__ import annotations

import statistics
from collections import deque
from dataclasses import dataclass

WINDOW = 10
"""Ticks in the averages, as the ecosystem's watchers expect it."""


@dataclass(frozen=True, slots=True)
class TickStatistics:
    """The statistics as of one tick; seconds and squared seconds.

    Attributes:
        count: Number of the tick in its run, from 1.
        stamp: When it began, ROS time.
        duration: How long it took.
        duration_average: Mean of the last ticks.
        duration_variance: Sample variance of the last ticks, 0 for a single one.
        interval: Time since the tick before, 0 for the first one.
        interval_average: Mean of the last ticks.
        interval_variance: Sample variance of the last ticks, 0 for a single one.
    """

    count: int = 0
    stamp: float = 0.0
    duration: float = 0.0
    duration_average: float = 0.0
    duration_variance: float = 0.0
    interval: float = 0.0
    interval_average: float = 0.0
    interval_variance: float = 0.0


class TickStatisticsWindow:
    """Collects the ticks of one run."""

    def __init__(self) -> None:
        self._durations: deque[float] = deque(maxlen=WINDOW)
        self._intervals: deque[float] = deque(maxlen=WINDOW)
        self._last: float | None = None

    def add(self, stamp: float, duration: float) -> None:
        """Note a tick.

        Args:
            stamp: When it began, in seconds of any clock that is the same for all ticks.
            duration: How long it took, in seconds.
        """
        self._durations.append(duration)
        self._intervals.append(0.0 if self._last is None else stamp - self._last)
        self._last = stamp

    def as_of(self, count: int) -> TickStatistics:
        """The statistics of the tick that was noted last.

        Args:
            count: Its number in the run.
        """
        if self._last is None:
            return TickStatistics(count)
        return TickStatistics(
            count,
            self._last,
            self._durations[-1],
            statistics.fmean(self._durations),
            _variance(self._durations),
            self._intervals[-1],
            statistics.fmean(self._intervals),
            _variance(self._intervals),
        )


def _variance(values: deque[float]) -> float:
    return statistics.variance(values) if len(values) > 1 else 0.0
