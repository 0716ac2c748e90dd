"""Finds in a journal the ends of skills that no node saw, because their node had left them before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from py_trees.common import Status

from florence_bt.core.outcome import Outcome
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.text import match_ends


def ends_after_leaving(events: Sequence[JournaledEvent], last_change: Mapping[int, int]) -> frozenset[int]:
    """The ends of skills that came only after their nodes had left them.

    Args:
        events: Everything that the journal has of a run.
        last_change: Tick -> index of the last change of a node in it. What a tick does is told before that.

    Returns:
        Indices of events.
    """
    answered, left = _answered(events), _left_before(events)
    found = set()
    for start, end in match_ends(events):
        event = events[end]
        was_cancelled = event.data.get("outcome") == Outcome.CANCELLED.value
        # Any other end between two ticks may also be that of a skill that answers at once after a pause.
        told_late = end > last_change.get(event.tick, -1) and left[end] > start
        if (was_cancelled or told_late) and (event.tick, event.node) not in answered:
            found.add(end)
    return frozenset(end for end in found if not events[end].data.get("paused"))


def _answered(events: Sequence[JournaledEvent]) -> set[tuple[int, str]]:
    """Every tick and node in which the node ended by itself."""
    ends = (Status.SUCCESS.value, Status.FAILURE.value)
    return {
        (event.tick, event.node)
        for event in events
        if event.kind == EventKind.NODE.value and event.new in ends
    }


def _left_before(events: Sequence[JournaledEvent]) -> dict[int, int]:
    """The end of a skill -> when its node was left the last time before; indices of events, or -1."""
    left: dict[str, int] = {}
    found = {}
    for index, event in enumerate(events):
        if event.kind == EventKind.NODE.value and event.new == Status.INVALID.value:
            left[event.node] = index
        elif event.kind == EventKind.SKILL_ENDED.value:
            found[index] = left.get(event.node, -1)
    return found
