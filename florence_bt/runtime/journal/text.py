"""A run of the journal as text for people: its state and the reason, and what its skills did when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from py_trees.common import Status

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import Outcome
from florence_bt.runtime.events import EventKind, seconds_text
from florence_bt.runtime.journal.rows import JournaledEvent, JournaledRun
from florence_bt.runtime.status import status_text, values_text
from florence_bt.trees.drawings.ascii import MARKS, STOPPED

_WORDS = {
    EventKind.QUEUED.value: "queued",
    EventKind.STARTED.value: "started",
    EventKind.PAUSED.value: "paused",
    EventKind.RESUMED.value: "resumed",
    EventKind.RECOVERED.value: "recovered after a crash",
    EventKind.OVERRIDDEN.value: "the base is given up",
    EventKind.STOP_ASKED.value: "stop asked",
    EventKind.BREAKPOINTS.value: "breakpoints",
    EventKind.BROKEN.value: "an error inside",
    EventKind.ENDED.value: "ended",
}


def journal_text(row: JournaledRun, events: Sequence[JournaledEvent]) -> str:
    """Write the head line, tree and reason of a run, like the status of a live one."""
    run = row.as_run()
    times = [event.time for event in with_one_clock(events)]
    if row.started is not None and times and not row.status.final:
        run.started = row.started
        now = row.started + times[-1] - times[0]
    else:
        now = row.ended or row.started or 0.0
    run.input_kinds = _input_kinds(events)
    return status_text(run, row.tree or tree_from_events(events), now, accepted=row.accepted)


def _input_kinds(events: Iterable[JournaledEvent]) -> dict[str, Kind]:
    """Return what the inputs of a run are, as its start says."""
    start = next((event for event in events if event.kind == EventKind.STARTED.value), None)
    written = start.data.get("kinds") if start is not None else None
    known = {kind.value: kind for kind in Kind}
    kinds = written.items() if isinstance(written, Mapping) else ()
    return {name: known[kind] for name, kind in kinds if kind in known}


@dataclass(frozen=True, slots=True)
class TimelineRow:
    """A row of the timeline of a run.

    Attributes:
        at: Seconds since the first event of the run.
        text: What happened, for people.
        duration: How long a skill ran, seconds; None for what is no skill, or has no end.
        code: How a skill ended; empty without an end.
    """

    at: float
    text: str
    duration: float | None = None
    code: str = ""


def timeline(
    events: Sequence[JournaledEvent], skills: Mapping[str, SkillDeclaration] | None = None
) -> list[str]:
    """List what happened in a run as :func:`timeline_rows` has it, a line each."""
    return [f"{f'+{row.at:.1f} s':>10}  {row.text}" for row in timeline_rows(events, skills)]


def timeline_rows(
    events: Sequence[JournaledEvent], skills: Mapping[str, SkillDeclaration] | None = None
) -> list[TimelineRow]:
    """List what happened in a run: when, how long, which skill with which inputs, how it ended.

    Args:
        events: The events of the run, in order.
        skills: The skills that are known; their inputs and outputs are shown with units.

    Returns:
        Rows in order; times are without the time in which no process ran.
    """
    events = list(with_one_clock(events))
    ends = _ends(events)
    rows = []
    for index, event in enumerate(events):
        at = event.time - events[0].time
        if event.kind == EventKind.SKILL_STARTED.value:
            end = ends.get(index) or _without_end(events[index:])
            text = _skill_line(event, end, (skills or {}).get(event.skill))
            ran = (None, "") if isinstance(end, str) else (end.time - event.time, end.code)
            rows.append(TimelineRow(at, text, *ran))
        elif event.kind in _WORDS:
            said = event.reason or (event.new if event.kind == EventKind.ENDED.value else "")
            rows.append(TimelineRow(at, f"{_WORDS[event.kind]}{f': {said}' if said else ''}"))
    return rows


def event_words(event: JournaledEvent) -> str:
    """Say what an event is, in one line."""
    because = f": {event.reason}" if event.reason else ""
    node = " › ".join(event.node.split("/")[-2:])  # many are called sequence
    if event.kind == EventKind.NODE.value:
        return f"{node}: {event.new.lower()}{f' — {event.reason}' if event.reason else ''}"
    if event.kind == EventKind.SKILL_STARTED.value:
        return f"{node}: {event.skill} begins"
    if event.kind == EventKind.SKILL_ENDED.value:
        return f"{node}: {event.skill} ends, {event.code}{because}"
    how = f" {event.new.lower()}" if event.kind == EventKind.ENDED.value else ""
    return f"the run {event.kind.replace('_', ' ')}{how}{because}"


def with_one_clock(events: Iterable[JournaledEvent]) -> Iterator[JournaledEvent]:
    """Yield the events on the first process's clock: each process after a crash has its own."""
    behind = 0.0
    last = 0.0
    for event in events:
        if event.kind == EventKind.RECOVERED.value:
            behind = last - event.time
        last = event.time + behind
        yield replace(event, time=last)


def match_ends(events: Sequence[JournaledEvent]) -> Iterator[tuple[int, int]]:
    """Match the starts and ends of skills that belong together.

    A clean-up and the only skill in it have the same node, but other names. A cancelled end is that of the
    oldest open run of its node, any other end that of the latest: a run that
    was left can still be ending when its node starts the skill again.

    Yields:
        Index of a start and index of its end.
    """
    open_starts: dict[tuple[str, str], list[int]] = {}
    for index, event in enumerate(events):
        if event.kind == EventKind.RECOVERED.value:
            open_starts.clear()  # they died with their process
        elif event.kind == EventKind.SKILL_STARTED.value:
            open_starts.setdefault((event.node, event.skill), []).append(index)
        elif event.kind == EventKind.SKILL_ENDED.value and open_starts.get((event.node, event.skill)):
            was_cancelled = event.data.get("outcome") == Outcome.CANCELLED.value
            yield open_starts[event.node, event.skill].pop(0 if was_cancelled else -1), index


def _ends(events: Sequence[JournaledEvent]) -> dict[int, JournaledEvent]:
    return {start: events[end] for start, end in match_ends(events)}


def _without_end(later: Sequence[JournaledEvent]) -> str:
    """Tell why a skill has no end."""
    kinds = [event.kind for event in later]
    if EventKind.RECOVERED.value in kinds:
        return "cut off when the process died"
    return "no end is known" if EventKind.ENDED.value in kinds else "goes on"


def _skill_line(
    start: JournaledEvent, end: JournaledEvent | str, declaration: SkillDeclaration | None
) -> str:
    inputs, outputs = (declaration.inputs, declaration.outputs) if declaration is not None else ({}, {})
    what = f"{start.skill}{values_text(start.inputs, _kinds(inputs))} at {start.node}"
    if isinstance(end, str):
        return f"{what}: {end}"
    how = end.code if not end.reason else f"{end.code}: {end.reason}"
    gave = f" ->{values_text(end.outputs, _kinds(outputs))}" if end.outputs else ""
    return f"{what}: {how} after {seconds_text(start.time, end.time)}{gave}"


def _kinds(ports: Mapping[str, Port]) -> dict[str, Kind]:
    return {name: port.kind for name, port in ports.items()}


def tree_from_events(events: Iterable[JournaledEvent]) -> str:
    """Draw what the events of a run say about its nodes: when its process died, or is not asked.

    Nodes appear where their first event puts them; nodes that were never reached are not in the journal.

    Args:
        events: The events in order.

    Returns:
        One line per node that was reached: a mark, the name and what it said last; empty without events.
    """
    return "\n".join(
        f"{'    ' * node.path.count('/')}{node.mark} {node.name}{f' -- {node.said}' if node.said else ''}"
        for node in reached_nodes(events)
    )


@dataclass(frozen=True, slots=True)
class ReachedNode:
    """A node that a run has reached.

    Attributes:
        path: Its path.
        parent: The path of the nearest node above that was reached; empty without one.
        mark: How it stands, as the drawing of a tree has it.
        said: What it said last.
    """

    path: str
    parent: str
    mark: str
    said: str

    @property
    def name(self) -> str:
        """Its own name."""
        return self.path.rpartition("/")[2]


def reached_nodes(events: Iterable[JournaledEvent]) -> list[ReachedNode]:
    """Return what the events of a run say about its nodes, a parent before its children.

    Args:
        events: The events in order, of the whole run or of its beginning.
    """
    latest: dict[str, JournaledEvent] = {}
    stopped: set[str] = set()
    order: dict[str, int] = {}
    for event in events:
        if event.kind == EventKind.NODE.value:
            _note(event, latest, stopped)
            order.setdefault(event.node, len(order))
        elif event.kind == EventKind.STOP_ASKED.value:
            stopped.update(path for path, last in latest.items() if last.new == Status.RUNNING.name)
    paths = _parents_first([path for path in order if path in latest], order)
    known = set(paths)
    return [_reached(path, _parent(path, known), latest[path], path in stopped) for path in paths]


def _note(event: JournaledEvent, latest: dict[str, JournaledEvent], stopped: set[str]) -> None:
    """Note the last result of a node, or that it was stopped before its end."""
    if event.new != Status.INVALID.name:
        latest[event.node] = event
        stopped.discard(event.node)
    elif event.old == Status.RUNNING.name:
        stopped.add(event.node)


def _parents_first(paths: list[str], order: dict[str, int]) -> list[str]:
    """Order paths: a parent before its children, siblings in the order in which they were reached."""
    known = set(paths)
    children: dict[str, list[str]] = {}
    for path in sorted(paths, key=order.__getitem__):
        children.setdefault(_parent(path, known), []).append(path)
    found: list[str] = []
    todo = list(reversed(children.get("", [])))
    while todo:
        path = todo.pop()
        found.append(path)
        todo.extend(reversed(children.get(path, [])))
    return found


def _parent(path: str, known: set[str]) -> str:
    """Return the nearest node above that is known; names may contain slashes themselves."""
    while "/" in path:
        path = path.rpartition("/")[0]
        if path in known:
            return path
    return ""


def _reached(path: str, parent: str, last: JournaledEvent, stopped: bool) -> ReachedNode:
    mark = STOPPED if stopped else MARKS[Status[last.new]]
    return ReachedNode(path, parent, mark, " ".join(last.reason.split()))
