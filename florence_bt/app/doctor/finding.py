"""What the doctor found: one line of its table."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Level(enum.Enum):
    """How bad it is."""

    OK = "ok"
    NOTE = "note"
    """Worth knowing; nothing is wrong."""
    WARNING = "warning"
    """Something will not work as well as it could."""
    PROBLEM = "problem"
    """Something will not work."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        group: Such as ``ports``.
        item: What was looked at.
        level: How bad it is.
        found: What was seen.
        advice: What to do about it; empty when nothing is to be done.
    """

    group: str
    item: str
    level: Level
    found: str
    advice: str = ""


def good(group: str, item: str, found: str) -> Finding:
    """All is well."""
    return Finding(group, item, Level.OK, found)


def note(group: str, item: str, found: str, advice: str = "") -> Finding:
    """Worth knowing."""
    return Finding(group, item, Level.NOTE, found, advice)


def warning(group: str, item: str, found: str, advice: str) -> Finding:
    """Not as it should be."""
    return Finding(group, item, Level.WARNING, found, advice)


def problem(group: str, item: str, found: str, advice: str) -> Finding:
    """Will not work."""
    return Finding(group, item, Level.PROBLEM, found, advice)
