"""Habits of the user: usual places by time of day, counted, and kept in a small file."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import decode, read_bytes, replace_text

HOURS = 24
"""Of a day."""


class RoomHabits:
    """Counts on how many days the user was seen in a room, for each hour of the day.

    An hour counts once, however often the user is seen in it: a sensor that reports every second says no more
    than one that reports once.

    Args:
        counts: Label of a room -> 24 counts, from midnight on.
    """

    def __init__(self, counts: Mapping[str, Sequence[int]] | None = None) -> None:
        self._counts = {room: list(hours) for room, hours in (counts or {}).items()}
        self._hour: tuple[int, ...] = ()
        self._seen_this_hour: set[str] = set()
        self.unsaved = False
        """Something was counted since the last :meth:`save`."""

    def saw(self, room: str, at: float) -> None:
        """Note that the user was seen in a room.

        Args:
            room: The label of the room.
            at: When, seconds since 1970; the hour is that of the local time.
        """
        moment = time.localtime(at)
        hour = (moment.tm_year, moment.tm_yday, moment.tm_hour)
        if hour != self._hour:
            self._hour, self._seen_this_hour = hour, set()
        if room not in self._seen_this_hour:
            self._seen_this_hour.add(room)
            self._counts.setdefault(room, [0] * HOURS)[moment.tm_hour] += 1
            self.unsaved = True

    def count(self, room: str, at: float) -> int:
        """Count the days when the user was seen in a room at a moment's hour, as given to :meth:`saw`."""
        return self._counts[room][time.localtime(at).tm_hour] if room in self._counts else 0

    def save(self, file: Path) -> None:
        """Write the counts in one step.

        Raises:
            ConfigError: The file cannot be written; the old one is untouched.
        """
        try:
            replace_text(file, json.dumps(self._counts))
        except OSError as error:
            raise ConfigError(f"cannot write the habits of the user: {error}", file=file) from error
        self.unsaved = False


def load_habits(file: Path) -> RoomHabits:
    """Load the counts that a file keeps; none when there is no file yet.

    Raises:
        ConfigError: The file cannot be read, or is damaged.
    """
    if not os.path.lexists(file):
        return RoomHabits()
    try:
        counts = json.loads(decode(read_bytes(file), file))
    except (ConfigError, ValueError) as error:
        raise ConfigError(f"cannot read the habits of the user: {error}", file=file) from error
    if not isinstance(counts, dict) or not all(_are_counts(hours) for hours in counts.values()):
        raise ConfigError(
            "these are not the habits of the user", file=file, valid=[f"a room with {HOURS} counts for each"]
        )
    return RoomHabits(counts)


def _are_counts(hours: Any) -> bool:
    return isinstance(hours, list) and len(hours) == HOURS and all(type(count) is int for count in hours)
