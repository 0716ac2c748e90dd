"""Streams of snapshots and keys for watchers: names, parameters, when one is due, how keys read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from florence_bt.core.errors import ConfigError
from florence_bt.runtime.requests import checked_text
from florence_bt.runtime.viewers.variables import Activity, lookup

MAX_STREAMS = 32
"""Streams of one kind that may be open at once."""
MAX_VARIABLES = 1000
"""Keys that one stream may name."""
CLOSE_ENOUGH = 0.98
"""A snapshot is due a little before its period has passed: ticks of the same period must not miss it."""


@dataclass(frozen=True, slots=True)
class StreamParameters:
    """What a stream of snapshots shows.

    Attributes:
        period: Seconds after which a tick is shown although nothing changed: 0 shows every tick, infinity
            only changes.
        data: Whether the keys on the visited path come along.
        activity: Whether the changes of the keys come along.
    """

    period: float = math.inf
    data: bool = True
    activity: bool = False

    def __post_init__(self) -> None:
        """Refuse a period that is negative or not a number."""
        if math.isnan(self.period) or self.period < 0.0:
            raise ConfigError(
                f"a snapshot period of {self.period} s",
                valid=["0 for every tick", "2.0", "inf for changes only"],
            )

    def due(self, *, changed: bool, since_last: float) -> bool:
        """Whether a tick is shown.

        Args:
            changed: Whether the tree reads differently than in the last snapshot of the stream.
            since_last: Seconds since that snapshot.
        """
        return changed or since_last >= CLOSE_ENOUGH * self.period


def topic_of(wanted: str, number: int, *, folder: str, automatic: str) -> str:
    """The topic of a new stream, relative to the node's own name or absolute.

    Args:
        wanted: What the caller asks for: nothing, a name in the folder, ``~/name`` or ``/name``.
        number: For the automatic name.
        folder: Where streams live below the node.
        automatic: Begin of the automatic name.

    Raises:
        ConfigError: The name is too long or cannot be printed.
    """
    checked_text("the topic", wanted)
    if not wanted:
        return f"~/{folder}/{automatic}{number}"
    if wanted.startswith(("~", "/")):
        return wanted
    return f"~/{folder}/{wanted}"


def checked_variables(names: Sequence[str]) -> tuple[str, ...]:
    """The keys that a caller wants to watch, each once and with its leading slash.

    Raises:
        ConfigError: There are too many, or a name is too long.
    """
    if len(names) > MAX_VARIABLES:
        raise ConfigError(f"{len(names)} variables are too many", valid=[f"at most {MAX_VARIABLES}"])
    full = (name if name.startswith("/") else f"/{name}" for name in names)
    return tuple(dict.fromkeys(checked_text("the name of a variable", name) for name in full))


def keys_text(values: Mapping[str, Any], names: Sequence[str], activity: Sequence[Activity] | None) -> str:
    """Some keys with their values, one a line, for people.

    Args:
        values: Every key that has a value.
        names: The keys to show.
        activity: What happened to them, or None to leave that out.
    """
    width = max((len(name) for name in names), default=0)
    lines = [f"    {name:<{width}} : {lookup(values, name)}" for name in names] or ["    - : -"]
    if activity is None:
        return "\n".join(lines)
    shown = [
        f"    {item.key:<{width}} : {item.kind} {item.before} -> {item.now}"
        + (f" by {item.client}" if item.client else "")
        for item in activity
    ]
    return "\n".join(["Blackboard Data", *lines, "Blackboard Activity Stream", *(shown or ["    - : -"])])
