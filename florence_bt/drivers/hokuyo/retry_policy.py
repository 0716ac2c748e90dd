"""How long a sensor in trouble may check itself, and how long the pause before a new start is.

The time is given.
"""

from __future__ import annotations

MOST_DOUBLINGS, LONGEST_PAUSE = 4, 10
"""The longest pause, as a multiple of the first."""


class RetryPolicy:
    """Counts failures, and the time without scans while a stream runs.

    A sensor that works again for as long as it rested last is forgiven; one that fails again before that
    rests longer each time.

    Attributes:
        failures: How often it failed in a row.
        pause_s: How long it rested, or rests, after the last of them.
        why: What the sensor sent first in the place of a scan; empty while scans come.
    """

    def __init__(self, first_pause_s: float, check_timeout_s: float) -> None:
        """Begin without failures.

        Args:
            first_pause_s: The rest after the first failure.
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
        """A stream begins: no scan came yet."""
        self._works_since = None
        self.why = ""

    def scan(self, now: float) -> None:
        """A good scan came."""
        self.why = ""
        if self._works_since is None:
            self._works_since = now
        if now - self._works_since >= self.pause_s:
            self.reset_failures()

    def reset_failures(self) -> None:
        """The failures so far do not count any more."""
        self.failures = 0

    def interrupt(self, why: str, now: float) -> bool:
        """Something else came in the place of a scan.

        Returns:
            Whether it is the first since the last scan.
        """
        if self.why:
            return False
        self.why, self._interrupted_at = why, now
        return True

    def limit(self, deadline: float) -> float:
        """When a scan must have come: at the deadline, or earlier when the sensor has used up its time."""
        return min(deadline, self._interrupted_at + self._check_timeout_s) if self.why else deadline

    def fail(self) -> float:
        """It failed.

        Returns:
            How long to rest, in seconds.
        """
        self.pause_s = self._first_pause_s * min(2 ** min(self.failures, MOST_DOUBLINGS), LONGEST_PAUSE)
        self.failures += 1
        self.begin()
        return self.pause_s
