"""Finds in a journal what clean-ups beside the tree did: they go on between the ticks of the tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.behaviours.composites import CLEANUP
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.text import match_ends


@dataclass(frozen=True, slots=True)
class BetweenTicks:
    """What clean-ups did between two ticks of the tree; indices of events.

    Attributes:
        starts: Starts of skills.
        ends: The end of a skill -> its start.
    """

    starts: frozenset[int]
    ends: dict[int, int]


def between_ticks(events: Sequence[JournaledEvent], last_change: dict[int, int]) -> BetweenTicks:
    """Find what clean-ups beside the tree did by themselves.

    Args:
        events: Everything that the journal has of a run.
        last_change: Tick -> index of the last change of a node in it. What a tick does is told before that.
    """
    beside = _starts_beside(events)
    return BetweenTicks(
        frozenset(index for index in beside if index > last_change.get(events[index].tick, -1)),
        {
            end: start
            for start, end in match_ends(events)
            if start in beside and end > last_change.get(events[end].tick, -1)
        },
    )


def _starts_beside(events: Sequence[JournaledEvent]) -> set[int]:
    """The starts of skills below the node of a clean-up, from its beginning to its end."""
    going: list[str] = []
    found = set()
    for index, event in enumerate(events):
        if event.kind == EventKind.SKILL_STARTED.value and event.skill == CLEANUP:
            going.append(event.node)
        elif event.kind == EventKind.SKILL_ENDED.value and event.skill == CLEANUP and event.node in going:
            going.remove(event.node)
        elif event.kind == EventKind.SKILL_STARTED.value and any(
            f"{event.node}/".startswith(f"{node}/") for node in going
        ):
            found.add(index)
    return found
