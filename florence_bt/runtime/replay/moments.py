"""Divides the journal of a run into moments: what came of one tick, or of one thing done from outside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent

TICKED = frozenset(
    kind.value for kind in (EventKind.NODE, EventKind.SKILL_STARTED, EventKind.SKILL_ENDED, EventKind.HELD)
)
"""Events that a tick brings about."""
COMPARED = frozenset({EventKind.NODE.value, EventKind.SKILL_STARTED.value})
"""Events that a mission causes by itself: a replay must do the same."""
FROM_OUTSIDE = frozenset(
    {
        EventKind.PAUSED.value,
        EventKind.RESUMED.value,
        EventKind.RECOVERED.value,
        EventKind.OVERRIDDEN.value,
        EventKind.STOP_ASKED.value,
        EventKind.ENDED.value,
    }
)
"""Events between two ticks, each of which begins a moment of its own."""
BEGINNING = frozenset({EventKind.QUEUED.value, EventKind.STARTED.value})


@dataclass(frozen=True, slots=True)
class Moment:
    """A part of the journal of a run.

    Attributes:
        number: Its place among the moments, from 0.
        events: Its events in order, at least one; the first one says what kind of a moment it is.
        first: The index of its first event among all.
        decided: How many of its events come before its last change of a node or start of a skill, this one
            included. What comes behind it happened later, before the next moment.
    """

    number: int
    events: Sequence[JournaledEvent]
    first: int
    decided: int

    @property
    def kind(self) -> str:
        """Return what it begins with."""
        return self.events[0].kind

    @property
    def time(self) -> float:
        """Return when it began, seconds."""
        return self.events[0].time

    @property
    def tick(self) -> int:
        """The number of its tick, or of the last one before."""
        return self.events[0].tick

    @property
    def compared(self) -> list[JournaledEvent]:
        """Return what the mission did by itself in it."""
        return [event for event in self.events if event.kind in COMPARED]


def moments(events: Sequence[JournaledEvent]) -> list[Moment]:
    """Divide the events of a run, in order and on one clock, into moments."""
    starts = list(_starts(events))
    ends = [*starts[1:], len(events)]
    return [
        _moment(number, events[start:end], start)
        for number, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]


def _starts(events: Sequence[JournaledEvent]) -> Iterator[int]:
    """Yield the index of the first event of each moment."""
    tick = 0
    for index, event in enumerate(events):
        ticked = event.kind in TICKED and event.tick > tick
        if index == 0 or ticked or event.kind in FROM_OUTSIDE:
            yield index
        # A tick that changed nothing is not in the journal.
        tick = max(tick, event.tick)


def _moment(number: int, events: Sequence[JournaledEvent], first: int) -> Moment:
    decided = max((n + 1 for n, event in enumerate(events) if event.kind in COMPARED), default=0)
    return Moment(number, events, first, decided)
