"""Stopping one goal for good: asks its server again and again until the goal is known to be over.

No ROS in here. One request is not enough: it is lost when the server is out of sight for a moment, and a
server may refuse it once and obey later. The asking outlives the run that wanted it, so that a run which has
ended with its deadline still leaves no goal behind.
"""

from __future__ import annotations

import enum
from collections.abc import Callable

from florence_bt.core.clock import Clock, Timer

REPEAT_S = 1.0
"""How long to wait for an answer before asking again, in steady time."""
GIVE_UP_S = 60.0
"""How long to go on at most: a server that is gone for so long comes back without its goals."""


class StopAnswer(enum.Enum):
    """What a server may answer to the request to stop a goal (REFERENCE 10, cancel message)."""

    PROMISED = "it will end"
    REFUSED = "it goes on"
    UNKNOWN = "no such goal here"
    OVER = "it has ended already"


class GoalStop:
    """Asks for the end of one goal.

    Args:
        steady: Times the repetitions; the time of this machine, because the other side is a process on it.
        ask: Sends the request.
    """

    def __init__(self, steady: Clock, ask: Callable[[], None]) -> None:
        self._steady = steady
        self._ask = ask
        self._give_up_at = 0.0
        self._timer: Timer | None = None

    @property
    def asking(self) -> bool:
        """Whether a request goes out now and then."""
        return self._timer is not None

    def begin(self) -> None:
        """Ask now, and again until :meth:`end`; harmless while it is asking already."""
        if self._timer is None:
            self.ask_now()

    def ask_now(self) -> None:
        """Ask at once, in the midst of the repetitions too: there is a new reason to."""
        self.end()
        self._give_up_at = self._steady.now() + GIVE_UP_S
        self._once_more()

    def end(self) -> None:
        """Ask no more: the goal is over, or the server has promised to end it."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _once_more(self) -> None:
        now = self._steady.now()
        if now >= self._give_up_at:
            self._timer = None
            return
        self._timer = self._steady.call_at(now + REPEAT_S, self._once_more)
        self._ask()
