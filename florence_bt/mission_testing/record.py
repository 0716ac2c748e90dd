"""Records of a run, tick by tick, and the traces that tests expect: ``4.2 s look_for_user: SUCCESS``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.mission_testing.paths import MissionMap, NodeRef, matching, read_pattern
from florence_bt.mission_testing.values import read_duration
from florence_bt.runtime.events import EventKind, RunEvent

SUCCESS, FAILURE, RUNNING, INVALID = "SUCCESS", "FAILURE", "RUNNING", "INVALID"
STOPPED = "STOPPED"
"""The outcome of a node that was running and was left."""
SKIPPED = "SKIPPED"
"""The outcome of a node that its guard kept from starting, whatever it counts as."""
STATUSES = (SUCCESS, FAILURE, RUNNING, INVALID)
SHOWN = (RUNNING, SUCCESS, FAILURE)
"""The statuses that a trace shows."""
_LINE = re.compile(r"(?P<time>[+-]?[\d.]+\s*[^\W\d]*)\s+(?P<node>.+):\s*(?P<status>\S*)")
_EXAMPLE = "4.2 s look_for_user: SUCCESS"
_SLACK_S = 0.5e-3 + 1e-9
"""Times are shown to the millisecond."""


@dataclass(frozen=True, slots=True)
class StatusChange:
    """The status of a node after a tick that changed it.

    Attributes:
        time: Seconds from the start of the run.
        tick: The number of the tick, beginning with 1.
        node: The node.
        old: Its status before the tick.
        new: Its status after the tick.
    """

    time: float
    tick: int
    node: NodeRef
    old: str
    new: str

    def __str__(self) -> str:
        """Write the change, such as ``4.2 s  look_for_user: SUCCESS``."""
        return f"{seconds_text(self.time)}  {self.node.short}: {self.new}"


class NodeRecord:
    """Notes the changes of one run.

    Args:
        mission_map: The nodes of the mission.

    Attributes:
        statuses: The last known status of every node that was reached, by path.
        outcomes: Path and outcome (success, failure, stopped, skipped) of every node that had one.
        broken: The tracebacks of exceptions that came out of the tree.
    """

    def __init__(self, mission_map: MissionMap) -> None:
        self.statuses: dict[str, str] = {}
        self.outcomes: set[tuple[str, str]] = set()
        self.broken: list[str] = []
        self._mission_map = mission_map
        self._started: float | None = None
        self._changes: list[StatusChange] = []
        self._tick = (0, 0.0)
        self._open: dict[str, tuple[str, str]] = {}

    def note(self, event: RunEvent, tick: int) -> None:
        """Take an event of the run.

        Args:
            event: What happened.
            tick: The number of the run's tick in which it happened.
        """
        match event.kind:
            case EventKind.STARTED:
                self._started = event.time
            case EventKind.NODE:
                self._note_node(event, tick)
            case EventKind.BROKEN:
                detail = str(event.data.get("detail", ""))
                # The test reports those itself.
                if "MockError" not in detail:
                    self.broken.append(detail)
            case EventKind.STOP_ASKED | EventKind.ENDED:
                # The tree is stopped as a whole; there is no event for each node.
                running = [path for path, status in self.statuses.items() if status == RUNNING]
                self.outcomes.update((path, STOPPED) for path in running)

    def changes(self) -> list[StatusChange]:
        """Return every change so far, by tick and then in the order of the tree."""
        self._close_tick()
        return self._changes

    def _note_node(self, event: RunEvent, tick: int) -> None:
        path, old, new = (str(event.data[name]) for name in ("node", "old", "new"))
        if self._tick[0] != tick:
            self._close_tick()
            self._tick = (tick, event.time)
        before = self._open.get(path, (old, ""))[0]
        self._open[path] = (before, new)
        self.statuses[path] = new
        if new in (SUCCESS, FAILURE):
            skipped = str(event.data.get("reason", "")).startswith("skipped: ")
            self.outcomes.add((path, SKIPPED if skipped else new))
        elif new == INVALID and old == RUNNING:
            self.outcomes.add((path, STOPPED))

    def _close_tick(self) -> None:
        tick, time = self._tick
        since = time - (self._started if self._started is not None else time)
        changed = [
            StatusChange(since, tick, self._mission_map.find(path), old, new)
            for path, (old, new) in self._open.items()
            if old != new
        ]
        self._changes += sorted(changed, key=lambda change: change.node.index)
        self._open = {}


def trace_text(changes: Iterable[StatusChange]) -> str:
    """Write one line for each change; equal runs give equal texts."""
    return "\n".join(str(change) for change in changes)


def seconds_text(seconds: float) -> str:
    """Write seconds, such as ``4.2 s``; to the millisecond, without trailing zeros."""
    return f"{round(seconds, 3) + 0.0:.3f}".rstrip("0").rstrip(".") + " s"


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

    def fits(self, change: StatusChange) -> bool:
        """Tell whether a change is what the line says."""
        near = abs(change.time - self.seconds) <= _SLACK_S
        return near and change.new == self.status and read_pattern(self.node).matches(change.node)

    def shown(self, nodes: Iterable[NodeRef]) -> str:
        """Return the line as a trace would show it, when it means one node; else as it was written."""
        found = matching(self.node, nodes)
        name = found[0].short if len(found) == 1 else self.node
        return f"{seconds_text(self.seconds)}  {name}: {self.status}"


def read_line(text: str) -> TraceLine:
    """Read a line of an expected trace.

    Raises:
        ConfigError: It is not one.
    """
    match = _LINE.fullmatch(text.strip())
    if match is None:
        raise ConfigError(f"{text.strip()!r} is not a line of a trace", valid=[_EXAMPLE])
    if match["status"] not in SHOWN:
        valid = closest_first(match["status"].upper(), SHOWN)
        raise ConfigError(f"a trace shows no status {match['status']!r}", valid=valid)
    read_pattern(match["node"])
    return TraceLine(read_duration(match["time"]), match["node"].strip(), match["status"])


def same_trace(wanted: Sequence[TraceLine], actual: Sequence[StatusChange]) -> bool:
    """Tell whether a run did what the lines say, and nothing else."""
    return len(wanted) == len(actual) and all(map(TraceLine.fits, wanted, actual))


def aligned(
    wanted: Sequence[TraceLine], actual: Sequence[StatusChange], nodes: Iterable[NodeRef]
) -> list[str]:
    """Return the expected lines, written as in the actual trace where they agree, so that a difference shows
    only what differs.
    """
    nodes = list(nodes)
    lines, rest = [], list(actual)
    for line in wanted:
        found = next((change for change in rest if line.fits(change)), None)
        if found is not None:
            rest = rest[rest.index(found) + 1 :]
        lines.append(str(found) if found is not None else line.shown(nodes))
    return lines
