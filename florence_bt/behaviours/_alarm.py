"""A moment on the clock of the context, for the nodes that wait."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from florence_bt.behaviours.context import TreeContext
from florence_bt.core.clock import Timer
from florence_bt.core.outcome import Result, failure


class Alarm:
    """A moment on the clock that stays passed once it has come, and wakes the executor when it comes.

    The callback counts, not a second look at the clock: a timer that fires a hair early must not be lost.

    Args:
        context: The clock, and who is woken.
        touch: Called before that, so that a ticker looks at the node again.
    """

    def __init__(self, context: TreeContext, touch: Callable[[], None] | None = None) -> None:
        self.passed = False
        self._context = context
        self._touch = touch
        self._timer: Timer | None = None

    def set(self, seconds: float) -> None:
        """Ring in so many seconds."""
        self.clear()
        self.passed = False
        clock = self._context.clock
        self._timer = clock.call_at(clock.now() + seconds, self._ring)

    def clear(self) -> None:
        """Do not ring."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _ring(self) -> None:
        self.passed = True
        if self._touch is not None:
            self._touch()
        self._context.wake()


def bad_duration(duration: Any) -> Result | None:
    """The failure of a node whose duration is no number of seconds from zero up, or None."""
    number = isinstance(duration, (int, float)) and not isinstance(duration, bool)
    if number and 0.0 <= duration < float("inf"):
        return None
    return failure("bad_input", f"a duration of zero or more seconds is needed, not {duration!r}")
