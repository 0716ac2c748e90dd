"""Keeps the simulated time from running away from whoever reads the simulated hardware.

On a machine that is busy with other things a driver falls behind the hardware that it reads; missions would
then fail for want of computing time, which says nothing about the robot. The simulated time waits instead.
"""

from __future__ import annotations

import math
import threading


class SlowestReader:
    """The progress of the slowest reader; updated on one thread and queried on another.

    A reader that has nothing more to say at the lag where it is waited for is always behind by so much, or is
    gone. That lag is then taken for granted until it has been smaller, so that time never crawls.

    Args:
        most_lag_s: Simulated seconds that it may be behind.
        timeout_s: Wall seconds without a word from it for which it is waited.
    """

    def __init__(self, most_lag_s: float, timeout_s: float) -> None:
        self._most_lag_s = most_lag_s
        self._timeout_s = timeout_s
        self._lock = threading.Lock()
        self._reached = math.inf
        self._received_at = -math.inf
        self._granted = 0.0

    def received(self, stamp: float, wall: float) -> None:
        """Note that it has used the hardware's data of a moment; the same moment again is not progress.

        Args:
            stamp: Simulated seconds of that moment.
            wall: Wall seconds now, monotonic.
        """
        with self._lock:
            if stamp != self._reached:
                self._reached, self._received_at = stamp, wall

    def is_behind(self, time: float, wall: float) -> bool:
        """Tell whether the simulated time has to wait.

        Args:
            time: Simulated seconds when the hardware spoke last; what was not said is not waited for.
            wall: Wall seconds now, monotonic.
        """
        with self._lock:
            lag = time - self._reached
            self._granted = min(self._granted, max(lag, 0.0))
            if lag <= self._granted + self._most_lag_s:
                return False
            if wall - self._received_at < self._timeout_s:
                return True
            self._granted = lag
            return False
