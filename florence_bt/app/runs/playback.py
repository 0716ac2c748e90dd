"""A recorded run as it ran: its tree, its way and what happened, step by step."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from florence_bt.app.runs.journal_view import journal_folder
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal import JournaledEvent, JournaledRun, JournalReader
from florence_bt.runtime.journal.text import ReachedNode, event_words, reached_nodes, with_one_clock

MOST_EVENTS = 20_000
"""Events of one run that can be looked at, its first ones: chosen for the memory of a small computer."""
MOST_WAY_POINTS = 2_000
"""Points of its way that are shown."""
LARGEST_RESULT = 20_000_000
"""Bytes of a ``result.json`` that is read: those of the longest path take 2 MB."""

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Moment:
    """A run at one of its steps.

    Attributes:
        at: Seconds since its first event.
        text: What has happened last, for people.
        nodes: Every node that was reached by then.
        points: How many points of the way were driven by then.
    """

    at: float
    text: str
    nodes: Sequence[ReachedNode]
    points: int


class Playback:
    """A run that can be looked at step by step: a step is one of its events, or a point of its way.

    Args:
        run: The run.
        events: Its events, in order.
        result: What stands in its ``result.json``; empty for a run without one.

    Attributes:
        run: The run.
        cut: Whether later events are left out.
        nodes: Every node that is reached in the run, a parent before its children.
        path: The way, poses in the map frame: metres and radians.
        person: Where the last look found a person; None when none did.
    """

    def __init__(
        self, run: JournaledRun, events: Sequence[JournaledEvent], result: Mapping[str, Any]
    ) -> None:
        self.run = run
        self.cut = len(events) >= MOST_EVENTS
        self._events = list(with_one_clock(events))
        self.nodes = reached_nodes(self._events)
        # A process that died has taken its part of the way along: the rest is on the clock of the last one.
        behind = self._events[-1].time - events[-1].time if events else 0.0
        way = list(_points(result.get("path", ())))
        way = way[:: -(-len(way) // MOST_WAY_POINTS) or 1]
        self.path = [pose for _, pose in way]
        self._steps = list(_steps([each.time for each in self._events], [time + behind for time, _ in way]))
        person = result.get("person")
        self.person = (float(person["x"]), float(person["y"])) if person else None

    def __len__(self) -> int:
        """Count the steps."""
        return len(self._steps)

    def moment(self, number: int) -> Moment:
        """Return how the run stood after one of its steps, the first one being 0."""
        time, events, points = self._steps[min(max(number, 0), len(self._steps) - 1)]
        begun = self._events[:events]
        return Moment(time - begun[0].time, event_words(begun[-1]), reached_nodes(begun), points)


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
    try:
        return Playback(run, events, _read_result(file))
    except (TypeError, ValueError, KeyError) as error:
        raise ConfigError(f"the result of the run is damaged: {error!r}", file=file) from error


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
