"""The clock of one run: the clock of the system, which is frozen while the run is paused.

Every time in a tree (time-outs, waits, deadlines) comes from here, so a pause costs a mission no
time. A run that is recovered after a crash is first driven by a clock by hand and then moved to the real one.
"""

from __future__ import annotations

from florence_bt.core.clock import Callback, Clock, Timer


class RunTimer:
    """A timer of :class:`RunClock`."""

    __slots__ = ("_clock", "callback", "inner", "when")

    def __init__(self, clock: RunClock, when: float, callback: Callback) -> None:
        self._clock = clock
        self.when = when
        self.callback: Callback | None = callback
        self.inner: Timer | None = None

    def cancel(self) -> None:
        """Forget the callback."""
        self.callback = None
        self._clock.forget(self)


class RunClock:
    """Follows another clock and can be frozen.

    Args:
        base: The clock that is followed; until the first pause both show the same time.
    """

    def __init__(self, base: Clock) -> None:
        self._base = base
        self._behind = 0.0
        self._frozen: float | None = None
        self._timers: dict[RunTimer, None] = {}

    @property
    def frozen(self) -> bool:
        """Tell whether the time is frozen."""
        return self._frozen is not None

    def now(self) -> float:
        """Return the seconds; the moment of the freeze while the time is frozen."""
        return self._base.now() - self._behind if self._frozen is None else self._frozen

    def call_at(self, when: float, callback: Callback) -> RunTimer:
        """Call back once at ``when`` on this clock; not while the time is frozen."""
        timer = RunTimer(self, when, callback)
        self._timers[timer] = None
        if self._frozen is None:
            self._arm(timer)
        return timer

    def forget(self, timer: RunTimer) -> None:
        """Drop a timer that was cancelled."""
        self._timers.pop(timer, None)
        _disarm(timer)

    def freeze(self) -> None:
        """Stop the time; harmless when it is frozen already."""
        if self._frozen is None:
            self._frozen = self.now()
            for timer in self._timers:
                _disarm(timer)

    def thaw(self) -> None:
        """Let the time go on from where it was frozen; harmless when it runs."""
        if self._frozen is None:
            return
        self._behind = self._base.now() - self._frozen
        self._frozen = None
        # The order of equal moments is the order of the calls, as before.
        for timer in tuple(self._timers):
            self._arm(timer)

    def move_to(self, base: Clock) -> None:
        """Follow another clock from now on. The time is frozen until :meth:`thaw`."""
        self.freeze()
        self._base = base

    def _arm(self, timer: RunTimer) -> None:
        timer.inner = self._base.call_at(timer.when + self._behind, lambda: self._fire(timer))

    def _fire(self, timer: RunTimer) -> None:
        timer.inner = None
        self._timers.pop(timer, None)
        callback, timer.callback = timer.callback, None
        if callback is not None:
            callback()


def _disarm(timer: RunTimer) -> None:
    if timer.inner is not None:
        timer.inner.cancel()
        timer.inner = None
