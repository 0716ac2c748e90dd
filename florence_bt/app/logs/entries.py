"""Lines of logs as entries: pure text, no file in here.

A node's line is ``[LEVEL] [SECONDS] [NODE]: TEXT``, rcutils' default format. What stands without it, such as
a traceback or the output of a library, belongs to the entry before.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

LEVELS = ("debug", "info", "warn", "error", "fatal")
"""From the least to the worst."""
_LINE = re.compile(r"\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[(\d{1,11}\.\d+)\] \[([^\]]*)\]: (.*)", re.DOTALL)
"""With a time up to the year 5138: what has more digits is none."""
_BAD = re.compile(r"Traceback \(most recent call last\)|Fatal Python error|terminate called")


@dataclass(frozen=True, slots=True)
class LogEntry:
    """A line with those that belong to it.

    Attributes:
        when: Seconds since the epoch.
        process: The process that wrote it.
        level: One of :data:`LEVELS`.
        node: The node; empty where the process itself wrote.
        lines: The text.
    """

    when: float
    process: str
    level: str
    node: str
    lines: tuple[str, ...]


def entries_in(lines: Iterable[str], process: str, begin: float) -> Iterator[LogEntry]:
    """Read the entries of the log of one process.

    Args:
        lines: Its lines, without line ends.
        process: The process.
        begin: The time of lines before the first that has one.
    """
    entry = LogEntry(begin, process, "info", "", ())
    for line in lines:
        found = _LINE.match(line)
        if found is None:
            level = "error" if _BAD.search(line) else entry.level
            entry = replace(
                entry, level=max(level, entry.level, key=LEVELS.index), lines=(*entry.lines, line)
            )
            continue
        if entry.lines:
            yield entry
        entry = LogEntry(float(found[2]), process, found[1].lower(), found[3], (found[4],))
    if entry.lines:
        yield entry


def at_least(level: str) -> frozenset[str]:
    """Return a level and the worse ones."""
    return frozenset(LEVELS[LEVELS.index(level) :])
