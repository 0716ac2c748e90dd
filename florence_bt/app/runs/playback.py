"""A recorded run as it ran: its tree, its way and what happened, step by step."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from py_trees.common import Status

from florence_bt.app.runs.film import Film, fails_itself, speaks
from florence_bt.app.runs.film_screen import MOST_SENTENCES
from florence_bt.app.runs.journal_view import journal_folder
from florence_bt.app.runs.recorded_mission import read_recorded_mission
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent, JournaledRun, JournalReader
from florence_bt.runtime.journal.text import event_words, reached_nodes, with_one_clock
from florence_bt.runtime.recorder import LOOK_SKILL
from florence_bt.trees.drawings.ascii import MARKS, STOPPED, TreeRow
from florence_bt.trees.drawings.folding import parents_of

MOST_EVENTS = 20_000
"""Events of one run that can be looked at, its first ones: chosen for the memory of a small computer."""
MOST_REPLAYED = 5_000
"""Events of a run that is run again for its keys: to go back runs it from its start."""
MOST_WAY_POINTS = 2_000
"""Points of its way that are shown."""
LARGEST_RESULT = 20_000_000
"""Bytes of a ``result.json`` that is read: those of the longest path take 2 MB."""

ASKS = "wait_for_answer"
"""The skill that waits for an answer to what was said."""
STOPS = frozenset(
    kind.value for kind in (EventKind.STOP_ASKED, EventKind.OVERRIDDEN, EventKind.PAUSED, EventKind.RECOVERED)
)
BETWEEN = " · "
"""Stands between two sentences of one moment."""
_STOOD = {mark: status for status, mark in MARKS.items()}

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Moment:
    """A run at one of its steps.

    Attributes:
        at: Seconds since its first event.
        text: What has happened last, for people.
        rows: The nodes of its tree as they stood then.
        points: How many points of the way were driven by then.
        person: Where the last look by then found a person, metres in the map frame; None when none did.
        said: What the robot had said last; empty before it spoke.
        keys: The keys with their values; empty where the run could not be run again.
        changed: The names of those that changed then.
    """

    at: float
    text: str
    rows: Sequence[TreeRow]
    points: int
    person: tuple[float, float] | None
    said: str
    keys: Mapping[str, str]
    changed: frozenset[str]


@dataclass(frozen=True, slots=True)
class Mark:
    """A step that people look for.

    Attributes:
        step: Its number.
        kind: ``failure`` (a node fails by itself), ``stop`` (a person's stop, pause or override, or a crash)
            or ``question``.
        text: What happened, for people.
    """

    step: int
    kind: str
    text: str


class Playback:
    """A run that can be looked at step by step: a step is a moment of the run, or a point of its way.

    Args:
        run: The run.
        events: Its events, in order.
        result: What stands in its ``result.json``; empty for a run without one.
        film: The run as it is run again; without one a step is an event, the tree has the nodes that were
            reached in the end, and the keys are not known.
        without: Why there is no film; empty when there is one.

    Attributes:
        run: The run.
        cut: Whether later events are left out.
        without: Why the keys are not known; empty when they are.
        path: The way, poses in the map frame: metres and radians.
        marks: The failures, stops and questions, in order.
    """

    def __init__(
        self,
        run: JournaledRun,
        events: Sequence[JournaledEvent],
        result: Mapping[str, Any],
        film: Film | None = None,
        without: str = "",
    ) -> None:
        self.run = run
        self.cut = len(events) >= MOST_EVENTS
        self.without = without
        self._film = film
        self._events = list(with_one_clock(events))
        self._nodes = reached_nodes(self._events)
        # A process that died has taken its part of the way along: the rest is on the clock of the last one.
        behind = self._events[-1].time - events[-1].time if events else 0.0
        way = list(_points(result.get("path", ())))
        way = way[:: -(-len(way) // MOST_WAY_POINTS) or 1]
        self.path = [pose for _, pose in way]
        scenes = [moment.events for moment in film.moments] if film else [[each] for each in self._events]
        self._ends = list(accumulate(map(len, scenes)))
        self._steps = list(_steps([each[0].time for each in scenes], [time + behind for time, _ in way]))
        self.marks = list(self._find_marks(scenes))

    def __len__(self) -> int:
        """Count the steps."""
        return len(self._steps)

    @property
    def cause(self) -> int | None:
        """The place of the row that caused the end of the run; None when there is none."""
        rows = self.moment(0).rows
        parents = parents_of(rows)
        paths: list[str] = []
        for row, parent in zip(rows, parents, strict=True):
            paths.append(row.name if parent is None else f"{paths[parent]}/{row.name}")
        return paths.index(self.run.cause) if self.run.cause in paths else None

    def moment(self, number: int) -> Moment:
        """Return how the run stood after one of its steps, the first one being 0."""
        time, scenes, points = self._steps[min(max(number, 0), len(self._steps) - 1)]
        begun = self._events[: self._ends[scenes - 1]]
        at, person = time - begun[0].time, _person_of(begun)
        said = next((str(each.inputs.get("text", "")) for each in reversed(begun) if speaks(each)), "")
        if self._film is None:
            rows = self._rows_after(begun)
            return Moment(at, event_words(begun[-1]), rows, points, person, said, {}, frozenset())
        frame = self._film.frame(scenes - 1)
        text = BETWEEN.join(frame.happened[:MOST_SENTENCES])
        return Moment(at, text, frame.rows, points, person, said, frame.keys, frame.changed)

    def _rows_after(self, begun: Sequence[JournaledEvent]) -> list[TreeRow]:
        """Return the nodes that are ever reached, as some events leave them, a parent before its children."""
        stood = {node.path: node for node in reached_nodes(begun)}
        depths: dict[str, int] = {}
        rows = []
        for node in self._nodes:
            depth = depths[node.path] = depths[node.parent] + 1 if node.parent else 0
            then = stood.get(node.path)
            mark, said = (MARKS[Status.INVALID], "") if then is None else (then.mark, then.said)
            left = mark == STOPPED
            rows.append(TreeRow(depth, Status.RUNNING if left else _STOOD[mark], node.name, said, left=left))
        return rows

    def _find_marks(self, scenes: Sequence[Sequence[JournaledEvent]]) -> Iterator[Mark]:
        first: dict[int, int] = {}
        for step, (_, done, _) in enumerate(self._steps):
            first.setdefault(done - 1, step)
        for number, events in enumerate(scenes):
            for event in events:
                kind = _mark_of(event)
                if kind:
                    yield Mark(first[number], kind, event_words(event))


def _mark_of(event: JournaledEvent) -> str:
    """Return what kind of a mark an event is; empty for none."""
    if fails_itself(event):
        return "failure"
    if event.kind in STOPS:
        return "stop"
    asks = event.kind == EventKind.SKILL_STARTED.value and event.skill == ASKS
    return "question" if asks else ""


def _person_of(begun: Sequence[JournaledEvent]) -> tuple[float, float] | None:
    """Return where the last look found somebody."""
    for event in reversed(begun):
        if (
            event.kind == EventKind.SKILL_ENDED.value
            and event.skill == LOOK_SKILL
            and "user" in event.outputs
        ):
            user = event.outputs["user"]
            return float(user["x"]), float(user["y"])
    return None


def _steps(events: Sequence[float], points: Sequence[float]) -> Iterator[tuple[float, int, int]]:
    """Yield the time of each step, with how many events and points of the way there are by then."""
    driven = 0
    for number, time in enumerate(events):
        while number and driven < len(points) and points[driven] < time:
            driven += 1
            yield points[driven - 1], number, driven
        yield time, number + 1, len(points) if number == len(events) - 1 else driven


def _points(path: Any) -> Iterator[tuple[float, Point]]:
    for time, x, y, yaw in path:
        yield float(time), (float(x), float(y), float(yaw))


def read_playback(folder: Path | None, run_id: str) -> Playback:
    """Read a run that is to be looked at.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        run_id: The run.

    Raises:
        ConfigError: There is no journal, no such run, it has no events, or its files cannot be read.
    """
    place = journal_folder(folder)
    with JournalReader(place) as reader:
        run = reader.run(run_id)
        if run is None:
            raise ConfigError(
                f"no run {run_id!r} is recorded in {reader.path}",
                valid=[each.run_id for each in reader.runs(5)],
            )
        events = reader.events(run_id, MOST_EVENTS)
    if not events:
        raise ConfigError(f"the run {run_id} has no events", valid=["a run that has begun"])
    # Only a name that the journal has becomes the name of a folder.
    file = place / run.run_id / "result.json"
    film, without = _film_of(place, run_id, len(events))
    try:
        return Playback(run, events, _read_result(file), film, without)
    except (TypeError, ValueError, KeyError) as error:
        raise ConfigError(f"the result of the run is damaged: {error!r}", file=file) from error


def _film_of(place: Path, run_id: str, events: int) -> tuple[Film | None, str]:
    """Run a run again; return it, or why that cannot be done for the whole of it."""
    if events > MOST_REPLAYED:
        return None, f"it has more than {MOST_REPLAYED} events"
    try:
        film = Film(read_recorded_mission(place, run_id))
    except FlorenceError as error:
        return None, str(error)
    return (None, film.ends_early) if film.ends_early else (film, "")


def _read_result(file: Path) -> dict[str, Any]:
    """Read the result of a run; empty when it has left none."""
    try:
        if file.stat().st_size > LARGEST_RESULT:
            raise ConfigError("the result of the run is too large", file=file)
        found = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ConfigError(f"the result of the run cannot be read: {error}", file=file) from error
    return found if isinstance(found, dict) else {}


@dataclass(frozen=True, slots=True)
class RunsPage:
    """A part of the list of runs.

    Attributes:
        runs: The runs, the latest first.
        more: Whether there are earlier ones.
    """

    runs: Sequence[JournaledRun]
    more: bool


def read_runs(folder: Path | None, *, skip: int, limit: int, mission: str = "", state: str = "") -> RunsPage:
    """Read a part of the list of runs, the latest first.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        skip: Not the latest so many.
        limit: At most so many.
        mission: Only runs of this mission, of all when empty.
        state: Only runs in this state, in all when empty.

    Raises:
        ConfigError: There is no journal, or it cannot be read.
    """
    with JournalReader(journal_folder(folder)) as reader:
        found = reader.runs(limit + 1, mission, state, skip=skip)
    return RunsPage(found[:limit], len(found) > limit)
