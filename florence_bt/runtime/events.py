"""Events of a run, as records: the source of the journal, the live view and the topics."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any


class EventKind(enum.Enum):
    """The kinds of events."""

    QUEUED = "queued"
    STARTED = "started"
    NODE = "node"
    """A node's status changed."""
    SKILL_STARTED = "skill_started"
    SKILL_ENDED = "skill_ended"
    PAUSED = "paused"
    RESUMED = "resumed"
    RECOVERED = "recovered"
    """The process died on the run, and a new one goes on with it."""
    OVERRIDDEN = "overridden"
    """A person has the base: nothing of the run drives any more."""
    STOP_ASKED = "stop_asked"
    BREAKPOINTS = "breakpoints"
    """The breakpoints are other ones now."""
    HELD = "held"
    """A tick came to nodes that it has not started, because of a breakpoint."""
    BROKEN = "broken"
    """An exception came out of a tick; the traceback is in the details."""
    ENDED = "ended"

    # Asked for in sets at every event; that of Enum is computed in Python.
    __hash__ = object.__hash__


@dataclass(frozen=True, slots=True)
class RunEvent:
    """One record.

    Attributes:
        time: Seconds on the executor's clock.
        run_id: The run it belongs to.
        kind: What happened.
        data: Details, by name; plain values and small dataclasses.
        tick: The number of the run's tick in which it happened, or of the last one before.
    """

    time: float
    run_id: str
    kind: EventKind
    data: Mapping[str, Any]
    tick: int = 0


def plain(value: Any) -> Any:
    """Turn a value into what JSON can hold; what it cannot hold becomes text."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {part.name: plain(getattr(value, part.name)) for part in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return str(value)


def seconds_text(start: float | None, end: float | None) -> str:
    """Write a duration for people; empty when one end is missing."""
    if start is None or end is None:
        return ""
    seconds = end - start
    minutes, rest = divmod(round(seconds), 60)
    return f"{seconds:.1f} s" if seconds < 120 else f"{minutes} min {rest} s"
