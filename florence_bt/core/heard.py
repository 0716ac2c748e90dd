"""The value told last, with its age: the one rule by which it is fresh, old, or never came.

Whoever shows what somebody else has told asks here, and shows what is old with its age or not at all. Time
is given.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

T = TypeVar("T")

MISSED_PERIODS = 3.0
"""Periods after which something told again and again is old. Chosen: a busy machine holds one message up, or
two."""
LEAST_S = 1.5
"""Nothing is old before this age, seconds. Chosen: a process that is held up for less counts as one that
answers (``SILENT_S`` of heartbeats, and what its message then takes)."""


def old_after_s(period_s: float) -> float:
    """Return the age, in seconds, at which what is told every so many seconds is old."""
    return max(LEAST_S, MISSED_PERIODS * period_s)


class Freshness(enum.Enum):
    """The worth of the last word."""

    NEVER = "never came"
    FRESH = "fresh"
    OLD = "old"


class PresentTime(Protocol):
    """The clocks by which the age of something is told, seconds."""

    def steady(self) -> float:
        """Return the time of this machine, which never leaps."""

    def of_stamp(self, stamp: float) -> float | None:
        """Return what the clock of a stamp says now; None when that is not known."""


class Heard(Generic[T]):
    """The last word on one thing.

    Args:
        time: The clocks.
        period_s: Seconds between two words; None for what is told only when it changes: it is never old,
            unless the one who vouches for it is.
        on_news: Called when a word has come.
        vouched_by: The word that shows that the teller of what is told only when it changes lives: this one
            is as old as that one.

    Attributes:
        last: The last word, however old; None before the first.
    """

    def __init__(
        self,
        time: PresentTime,
        period_s: float | None,
        on_news: Callable[[], object] = lambda: None,
        vouched_by: Heard[Any] | None = None,
    ) -> None:
        self.last: T | None = None
        self._time = time
        self._on_news = on_news
        self._vouched_by = vouched_by
        self._limit_s = math.inf if period_s is None else old_after_s(period_s)
        self._repeated = True
        self._stamp = 0.0
        self._steady = 0.0

    def take(self, word: T, stamp: float = 0.0, *, repeated: bool = True) -> None:
        """Take a word.

        Args:
            word: What was told.
            stamp: When it was sent, by the clock of its sender, seconds; 0 when it does not say.
            repeated: Whether the word will be repeated; one that is told once is never old.
        """
        self.last, self._stamp, self._repeated = word, stamp, repeated
        self._steady = self._time.steady()
        self._on_news()

    def forget(self) -> None:
        """Take note that nobody is left who has told it."""
        self.last = None
        self._on_news()

    @property
    def stamp(self) -> float:
        """Return the time at which its sender sent the last word; 0 when that is not known."""
        return self._stamp

    @property
    def since_s(self) -> float:
        """Steady seconds since the last word came; infinity before it."""
        return math.inf if self.last is None else self._time.steady() - self._steady

    @property
    def age(self) -> float:
        """Seconds since the last word was sent, or, when it does not say, since it came; infinity before it.

        A word that was kept for who comes later is as old as its stamp when it comes. From then on the time
        of this machine counts, too: a simulation waits for drivers, so its time stands when they hang. A word
        that somebody vouches for is as old as the last sign of that one.
        """
        if self._vouched_by is not None and self._vouched_by.last is not None and self.last is not None:
            return min(self._own_age(), self._vouched_by.age)
        return self._own_age()

    def _own_age(self) -> float:
        now = self._time.of_stamp(self._stamp) if self._stamp else None
        return self.since_s if now is None else max(self.since_s, now - self._stamp)

    @property
    def freshness(self) -> Freshness:
        """Judge what the last word is worth."""
        if self.last is None:
            return Freshness.NEVER
        if self._vouched_by is not None and self._vouched_by.freshness is Freshness.OLD:
            return Freshness.OLD
        return Freshness.OLD if self._repeated and self.age > self._limit_s else Freshness.FRESH

    @property
    def fresh(self) -> T | None:
        """The last word, while it is fresh."""
        return self.last if self.freshness is Freshness.FRESH else None


def age_text(seconds: float) -> str:
    """Write an age for people: ``12 s``, ``5 min``, ``3.2 h``."""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
