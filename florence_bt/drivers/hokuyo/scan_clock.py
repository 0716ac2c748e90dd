"""Times at which scans would have arrived without delay: the sensor's timer against our clock.

Source: REFERENCE 4.4 (24-bit timer).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

TIMER_MS = 1 << 24
"""The sensor's timer begins again after this many milliseconds (REFERENCE 4.4)."""


def timer_difference_ms(later: int, earlier: int) -> int:
    """Return the milliseconds between two timer readings less than two hours apart; it may have wrapped.

    Returns:
        -8388608 to 8388607.
    """
    half = TIMER_MS // 2
    return (later - earlier + half) % TIMER_MS - half


@dataclass(slots=True)
class _Shift:
    """Scans in a row that are all late by about as much.

    Attributes:
        since: When the first of them arrived.
        least: The smallest difference between arrival and time stamp among them, in seconds.
        most: The largest one.
        scans: How many they are.
    """

    since: float
    least: float
    most: float
    scans: int = 1


class ScanClock:
    """A clock for scans: when each would have arrived without delay, by the sensor's own timer.

    A scan that waited somewhere comes late, never early. So over some seconds the smallest difference
    between arrival and time stamp is the true one; with it the time stamps, which are evenly spaced, give
    the moments. The timer may wrap.

    One of the clocks may jump. What distinguishes that from scans that wait while this machine is busy:

    - The timer advances by less than a turn takes: it jumped back. Everything starts again with that scan.
    - A scan comes earlier than the others allow: from now on it is the one without delay.
    - Scans come late, all by the same. Those of a machine that stood still come together, so that each of
      them is less late than the one before.

    Attributes:
        late_s: How late the last scan was.
    """

    WINDOW_S = 10.0
    """Long enough to meet a scan without delay, short enough for the drift of two quartzes (1 ms)."""

    LEAST_TURN = 0.8
    """A motor is not faster than its nominal speed by more than the rest of this."""

    SHIFT_S = 0.02
    """Scans that are less late than this are left to the window."""

    BAND_S = 0.02
    """Scans are late by the same when they differ by no more; simulated time goes in steps of 10 ms."""

    SHIFT_SCANS = 5
    """This many scans that are late by the same make a jump ..."""

    SHIFT_AFTER_S = 2.0
    """... when they go on for this long: a line may be slower for a while ..."""

    FAR_S = 1.0
    """... but not by so much."""

    def __init__(self) -> None:
        self._last_ms: int | None = None
        self._elapsed_s = 0.0
        # Arrivals and differences. Both rise: a difference before a smaller one cannot be the smallest.
        self._differences: deque[tuple[float, float]] = deque()
        self._shift: _Shift | None = None
        self.late_s = 0.0

    def reset(self) -> None:
        """Forget everything, as after the sensor's timer was set to zero."""
        self._last_ms = None
        self._elapsed_s = 0.0
        self._differences.clear()
        self._shift = None
        self.late_s = 0.0

    def arrival(self, timer_ms: int, arrived: float, turn_s: float) -> float:
        """Tell when a scan would have come without delay.

        Args:
            timer_ms: Its time stamp.
            arrived: When it came, in seconds.
            turn_s: Shortest time between two scans, in seconds.

        Returns:
            The moment, never after ``arrived``.
        """
        if self._last_ms is not None:
            passed_s = timer_difference_ms(timer_ms, self._last_ms) / 1000.0
            if passed_s < self.LEAST_TURN * turn_s:
                self.reset()
            else:
                self._elapsed_s += passed_s
        self._last_ms = timer_ms
        difference = arrived - self._elapsed_s
        self._add(arrived, difference)
        if (jumped_to := self._jumped_to(arrived, difference)) is not None:
            self._differences.clear()
            self._add(arrived, jumped_to)
            self._shift = None
        self.late_s = difference - self._differences[0][1]
        return arrived - self.late_s

    def _add(self, arrived: float, difference: float) -> None:
        while self._differences and self._differences[-1][1] >= difference:
            self._differences.pop()
        self._differences.append((arrived, difference))
        while self._differences[0][0] < arrived - self.WINDOW_S:
            self._differences.popleft()

    def _jumped_to(self, arrived: float, difference: float) -> float | None:
        """Return the smallest difference of the latest scans, if all have long been late by the same."""
        late_s, shift = difference - self._differences[0][1], self._shift
        if late_s < self.SHIFT_S:
            self._shift = None
            return None
        if shift is None or max(shift.most, difference) - min(shift.least, difference) > self.BAND_S:
            self._shift = _Shift(arrived, difference, difference)
            return None
        shift.least, shift.most = min(shift.least, difference), max(shift.most, difference)
        shift.scans += 1
        lasted = late_s >= self.FAR_S or arrived - shift.since >= self.SHIFT_AFTER_S
        return shift.least if lasted and shift.scans >= self.SHIFT_SCANS else None
