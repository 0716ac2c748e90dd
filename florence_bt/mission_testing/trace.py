"""The lines of an expected trace: ``4.2 s  look_for_user: SUCCESS``, with patterns for the nodes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.mission_testing.paths import Place, matching, read_pattern
from florence_bt.mission_testing.record import FAILURE, RUNNING, SUCCESS, Change, seconds_text
from florence_bt.mission_testing.values import read_duration

SHOWN = (RUNNING, SUCCESS, FAILURE)
"""The statuses that a trace shows."""
_LINE = re.compile(r"(?P<time>[+-]?[\d.]+\s*[^\W\d]*)\s+(?P<node>.+):\s*(?P<status>\S*)")
_EXAMPLE = "4.2 s look_for_user: SUCCESS"
_SLACK_S = 0.5e-3 + 1e-9
"""Times are shown to the millisecond."""


@dataclass(frozen=True, slots=True)
class TraceLine:
    """A line of an expected trace.

    Attributes:
        seconds: Since the start of the run.
        node: A pattern of nodes.
        status: The status that one of them takes.
    """

    seconds: float
    node: str
    status: str

    def fits(self, change: Change) -> bool:
        """Whether a change is what the line says."""
        near = abs(change.time - self.seconds) <= _SLACK_S
        return near and change.new == self.status and read_pattern(self.node).matches(change.place)

    def shown(self, places: Iterable[Place]) -> str:
        """The line as a trace would show it, when it means one node; else as it was written."""
        found = matching(self.node, places)
        name = found[0].short if len(found) == 1 else self.node
        return f"{seconds_text(self.seconds)}  {name}: {self.status}"


def read_line(text: str) -> TraceLine:
    """Read a line of an expected trace.

    Raises:
        ConfigError: It is none.
    """
    match = _LINE.fullmatch(text.strip())
    if match is None:
        raise ConfigError(f"{text.strip()!r} is no line of a trace", valid=[_EXAMPLE])
    if match["status"] not in SHOWN:
        valid = closest_first(match["status"].upper(), SHOWN)
        raise ConfigError(f"a trace shows no status {match['status']!r}", valid=valid)
    read_pattern(match["node"])
    return TraceLine(read_duration(match["time"]), match["node"].strip(), match["status"])


def same_trace(wanted: Sequence[TraceLine], actual: Sequence[Change]) -> bool:
    """Whether a run did what the lines say, and nothing else."""
    return len(wanted) == len(actual) and all(map(TraceLine.fits, wanted, actual))


def aligned(wanted: Sequence[TraceLine], actual: Sequence[Change], places: Iterable[Place]) -> list[str]:
    """The expected lines in the words of the actual trace, as far as they agree, so that a difference shows
    only what differs.
    """
    places = list(places)
    lines, rest = [], list(actual)
    for line in wanted:
        found = next((change for change in rest if line.fits(change)), None)
        if found is not None:
            rest = rest[rest.index(found) + 1 :]
        lines.append(str(found) if found is not None else line.shown(places))
    return lines
