"""A clock by hand on which long timers may be due at any moment: for missions that have too many moments."""

from __future__ import annotations

import math

from florence_bt.core.clock import Callback, ManualClock, ManualTimer

UNLIMITED_S = 1e8
"""A timer that takes longer than this never fires."""
_FAR_S = 1e9


class OpenClock(ManualClock):
    """A clock by hand.

    Args:
        coarse_s: Timers that take longer are open: nobody knows when they fire. None: no timer is.

    Attributes:
        opened: The timers that are open, each with how long it takes, in the order of the calls.
    """

    def __init__(self, coarse_s: float | None = None) -> None:
        super().__init__()
        self._coarse_s = math.inf if coarse_s is None else coarse_s
        self.opened: dict[ManualTimer, float] = {}

    def call_at(self, when: float, callback: Callback) -> ManualTimer:
        """Queue a callback; of an open timer only how long it takes is kept."""
        seconds = when - self.now()
        if seconds <= self._coarse_s:
            return super().call_at(when, callback)
        timer = super().call_at(when + _FAR_S, callback)
        self.opened[timer] = round(seconds, 3)
        return timer

    def next_due(self) -> float | None:
        """Return the moment of the next timer that is not open and fires at all; None: none does."""
        due = self.next_time()
        return due if due is not None and due - self.now() <= UNLIMITED_S else None

    def still_open(self) -> dict[ManualTimer, float]:
        """Return the open timers that were not cancelled."""
        return {timer: seconds for timer, seconds in self.opened.items() if timer.callback is not None}

    def fire(self, timer: ManualTimer) -> None:
        """Let an open timer be due now."""
        callback, timer.callback = timer.callback, None
        if callback is not None:
            callback()

    def tidy(self) -> None:
        """Forget the open timers that were cancelled."""
        for timer in [timer for timer in self.opened if timer.callback is None]:
            del self.opened[timer]
