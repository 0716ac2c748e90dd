"""A finding of the doctor: one line of its table."""

from __future__ import annotations

import enum
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from rich.console import Console
from rich.table import Table
from rich.text import Text


class HealthLevel(enum.Enum):
    """The severity of a finding."""

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
    level: HealthLevel
    found: str
    advice: str = ""


def good(group: str, item: str, found: str) -> HealthFinding:
    """Report that all is well."""
    return HealthFinding(group, item, HealthLevel.OK, found)


def note(group: str, item: str, found: str, advice: str = "") -> HealthFinding:
    """Report what is worth knowing."""
    return HealthFinding(group, item, HealthLevel.NOTE, found, advice)


def warning(group: str, item: str, found: str, advice: str) -> HealthFinding:
    """Report what is not as it should be."""
    return HealthFinding(group, item, HealthLevel.WARNING, found, advice)


def problem(group: str, item: str, found: str, advice: str) -> HealthFinding:
    """Report what will not work."""
    return HealthFinding(group, item, HealthLevel.PROBLEM, found, advice)


BATTERY_LOW, BATTERY_EMPTY = 0.3, 0.15
"""Share of the charge below which a warning or a problem is reported (our choice)."""


def charge_of_battery(share: float, found: str) -> HealthFinding:
    """Judge whether a charge, as a share of the capacity, is enough."""
    if share < BATTERY_EMPTY:
        return problem("battery", "base", found, "charge the robot before the next mission")
    if share < BATTERY_LOW:
        return warning("battery", "base", found, "charge the robot soon")
    return good("battery", "base", found)


_STYLES = {
    HealthLevel.OK: "green",
    HealthLevel.NOTE: "cyan",
    HealthLevel.WARNING: "yellow",
    HealthLevel.PROBLEM: "bold red",
}


def print_table(findings: Sequence[HealthFinding], console: Console) -> None:
    """Print what was found, with what to do about it."""
    table = Table(box=None, show_header=False, padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    group = ""
    for finding in findings:
        if finding.group != group:
            group = finding.group
            table.add_row(Text(group, style="bold"), "", "")
        text = Text(finding.found)
        if finding.advice:
            text.append(f"\n-> {finding.advice}", style="dim")
        level = Text(finding.level.value, style=_STYLES[finding.level])
        table.add_row(Text(f"  {finding.item}"), level, text)
    console.print(table)
    console.print(summary(findings))


def summary(findings: Sequence[HealthFinding]) -> str:
    """Count the findings by level, on one line."""
    counts = Counter(finding.level for finding in findings)
    problems, warnings = counts[HealthLevel.PROBLEM], counts[HealthLevel.WARNING]
    if not problems and not warnings:
        return f"{len(findings)} checks: all is well"
    return (
        f"{len(findings)} checks: {problems} problem{'s' * (problems != 1)}, "
        f"{warnings} warning{'s' * (warnings != 1)}"
    )


def as_json(findings: Sequence[HealthFinding]) -> str:
    """Write a list of objects with group, item, level, found and advice."""
    return json.dumps([{**asdict(f), "level": f.level.value} for f in findings], indent=1)


def healthy(findings: Sequence[HealthFinding]) -> bool:
    """Tell whether nothing is a problem."""
    return all(finding.level is not HealthLevel.PROBLEM for finding in findings)
