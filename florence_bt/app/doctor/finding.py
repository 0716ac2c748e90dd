"""What the doctor found: one line of its table."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Severity(enum.Enum):
    """How bad it is."""

    OK = "ok"
    NOTE = "note"
    """Worth knowing; nothing is wrong."""
    WARNING = "warning"
    """Something will not work as well as it could."""
    PROBLEM = "problem"
    """Something will not work."""


@dataclass(frozen=True, slots=True)
class HealthFinding:
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
    level: Severity
    found: str
    advice: str = ""


def good(group: str, item: str, found: str) -> HealthFinding:
    """All is well."""
    return HealthFinding(group, item, Severity.OK, found)


def note(group: str, item: str, found: str, advice: str = "") -> HealthFinding:
    """Worth knowing."""
    return HealthFinding(group, item, Severity.NOTE, found, advice)


def warning(group: str, item: str, found: str, advice: str) -> HealthFinding:
    """Not as it should be."""
    return HealthFinding(group, item, Severity.WARNING, found, advice)


def problem(group: str, item: str, found: str, advice: str) -> HealthFinding:
    """Will not work."""
    return HealthFinding(group, item, Severity.PROBLEM, found, advice)
