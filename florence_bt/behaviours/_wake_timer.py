"""A timer on the clock of the context, for the nodes that wait."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from florence_bt.behaviours.context import TreeContext
from florence_bt.core.clock import Timer
from florence_bt.core.outcome import Result, failure


class WakeTimer:
    """A one-shot timer that wakes the executor when it fires, and remembers that it has fired.

    The callback counts, not a second look at the clock: a timer that fires a little early must not be lost.

    Args:
        context: The clock, and who is woken.
        on_fire: Called when it fires, before the tick is asked for.
    """

    def __init__(self, context: TreeContext, on_fire: Callable[[], None] | None = None) -> None:
        self.fired = False
        self._context = context
        self._on_fire = on_fire
        self._timer: Timer | None = None

    def start(self, seconds: float) -> None:
        """Fire in this many seconds."""
        self.cancel()
        self.fired = False
        clock = self._context.clock
        self._timer = clock.call_at(clock.now() + seconds, self._fire)

    def cancel(self) -> None:
        """Do not fire."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _fire(self) -> None:
        self.fired = True
        if self._on_fire is not None:
            self._on_fire()
        self._context.wake()


def bad_duration(duration: Any) -> Result | None:
    """Return the failure of a node whose duration is not a number of seconds >= 0, or None."""
    number = isinstance(duration, (int, float)) and not isinstance(duration, bool)
    if number and 0.0 <= duration < float("inf"):
        return None
    return failure("bad_input", f"a duration of zero or more seconds is needed, not {duration!r}")
