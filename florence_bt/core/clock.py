"""The one clock of the system: whoever needs the time or a timer is given one of these.

``ManualClock`` is driven by hand: tests and the in-process rig use it. On ROS the clock is
``florence_bt.ros.clock.RosClock``, which goes on when the machine's clock is set. Code outside ``ros``
never asks the operating system for the time.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from typing import Protocol

Callback = Callable[[], None]


class Timer(Protocol):
    """A callback that waits for its moment."""

    def cancel(self) -> None:
        """Forget the callback; harmless when it has run already."""


class Clock(Protocol):
    """Time in seconds that never runs backwards, and callbacks at given moments."""

    def now(self) -> float:
        """Return the seconds since an arbitrary but fixed moment."""

    def call_at(self, when: float, callback: Callback) -> Timer:
        """Call back once at ``when`` (at once, but never inside this call, when that has passed)."""


def call_every(clock: Clock, period: float, callback: Callback, *, start: float | None = None) -> Timer:
    """Call back again and again without drift.

    Args:
        clock: The clock that drives the callbacks.
        period: Seconds between two calls, above zero.
        callback: What to call.
        start: The first moment, one period from now when not given.

    Returns:
        A timer; cancelling it ends the series.

    Raises:
        ValueError: The period is not above zero.
    """
    if not period > 0.0:
        raise ValueError(f"a period must be above zero, not {period}")
    return _Periodic(clock, period, callback, clock.now() + period if start is None else start)


class _Periodic:
    def __init__(self, clock: Clock, period: float, callback: Callback, first: float) -> None:
        self._clock = clock
        self._period = period
        self._callback = callback
        self._next = first
        self._cancelled = False
        self._timer = clock.call_at(first, self._fire)

    def cancel(self) -> None:
        self._cancelled = True
        self._timer.cancel()

    def _fire(self) -> None:
        if self._cancelled:
            return
        behind = self._clock.now() - self._next
        # A late clock skips what it missed instead of calling in a burst.
        self._next += self._period * (1 + max(0, int(behind / self._period)))
        self._timer = self._clock.call_at(self._next, self._fire)
        self._callback()


class ManualTimer:
    """A timer of :class:`ManualClock`."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callback) -> None:
        self.callback: Callback | None = callback

    def cancel(self) -> None:
        """Forget the callback."""
        self.callback = None


class ManualClock:
    """A clock that stands still until it is advanced. Same calls, same order, every time."""

    def __init__(self, now: float = 0.0) -> None:
        self._now = now
        self._order = itertools.count()
        self._queue: list[tuple[float, int, ManualTimer]] = []

    def now(self) -> float:
        """Return the time that was set by hand, in seconds."""
        return self._now

    def call_at(self, when: float, callback: Callback) -> ManualTimer:
        """Queue a callback; equal moments are served in the order of the calls."""
        timer = ManualTimer(callback)
        heapq.heappush(self._queue, (max(when, self._now), next(self._order), timer))
        return timer

    def waiting(self) -> list[tuple[float, int, ManualTimer]]:
        """Return the timers that wait, each with its moment and its place in the order of the calls."""
        return [each for each in self._queue if each[2].callback is not None]

    def next_time(self) -> float | None:
        """Return the moment of the next waiting callback, or None."""
        while self._queue and self._queue[0][2].callback is None:
            heapq.heappop(self._queue)
        return self._queue[0][0] if self._queue else None

    def advance_to(self, when: float) -> None:
        """Move the time forward and run every callback that is due on the way, each at its own moment."""
        while (due := self.next_time()) is not None and due <= when:
            self.run_next()
        self._now = max(self._now, when)

    def advance(self, seconds: float) -> None:
        """Move the time forward by some seconds."""
        self.advance_to(self._now + seconds)

    def run_next(self) -> bool:
        """Jump to the next waiting callback and run it; False when none waits."""
        due = self.next_time()
        if due is None:
            return False
        self._now = due
        callback = heapq.heappop(self._queue)[2].callback
        if callback is not None:
            callback()
        return True
