"""Time-outs of a sensor in trouble: for its check of itself, and for the pause before a new start.

The time is given.
"""

from __future__ import annotations

MOST_DOUBLINGS, LONGEST_PAUSE = 4, 10
"""The longest pause, as a multiple of the first."""


class RetryPolicy:
    """Counts failures, and the time without scans while a stream runs.

    Once a sensor has worked for as long as the last pause was, its failures no longer count; one that fails
    again before that gets a longer pause each time.

    Attributes:
        failures: How often it failed in a row.
        pause_s: The pause after the last of them, in seconds.
        why: What the sensor sent first in the place of a scan; empty while scans come.
    """

    def __init__(self, first_pause_s: float, check_timeout_s: float) -> None:
        """Begin without failures.

        Args:
            first_pause_s: The pause after the first failure, in seconds.
            check_timeout_s: How long it may send other things than scans.
        """
        self._first_pause_s = first_pause_s
        self._check_timeout_s = check_timeout_s
        self._works_since: float | None = None
        self._interrupted_at = 0.0
        self.failures = 0
        self.pause_s = 0.0
        self.why = ""

    def begin(self) -> None:
        """Note that a stream begins: no scan came yet."""
        self._works_since = None
        self.why = ""

    def scan(self, now: float) -> None:
        """Note that a good scan came."""
        self.why = ""
        if self._works_since is None:
            self._works_since = now
        if now - self._works_since >= self.pause_s:
            self.reset_failures()

    def reset_failures(self) -> None:
        """Forget the failures so far."""
        self.failures = 0

    def interrupt(self, why: str, now: float) -> bool:
        """Note that something else came in the place of a scan.

        Returns:
            Whether it is the first since the last scan.
        """
        if self.why:
            return False
        self.why, self._interrupted_at = why, now
        return True

    def limit(self, deadline: float) -> float:
        """Return when a scan must have come: the deadline, or earlier when the sensor's time is used up."""
        return min(deadline, self._interrupted_at + self._check_timeout_s) if self.why else deadline

    def fail(self) -> float:
        """Note that it failed.

        Returns:
            How long to rest, in seconds.
        """
        self.pause_s = self._first_pause_s * min(2 ** min(self.failures, MOST_DOUBLINGS), LONGEST_PAUSE)
        self.failures += 1
        self.begin()
        return self.pause_s
