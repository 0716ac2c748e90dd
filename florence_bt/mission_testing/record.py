"""What the nodes of a run did, tick by tick: the source of traces and of the coverage."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from florence_bt.mission_testing.paths import MissionMap, Place
from florence_bt.runtime.events import EventKind, RunEvent

SUCCESS, FAILURE, RUNNING, INVALID = "SUCCESS", "FAILURE", "RUNNING", "INVALID"
STOPPED = "STOPPED"
"""The outcome of a node that was running and was left."""
SKIPPED = "SKIPPED"
"""The outcome of a node that its guard kept from starting, whatever it counts as."""
STATUSES = (SUCCESS, FAILURE, RUNNING, INVALID)


@dataclass(frozen=True, slots=True)
class Change:
    """The status of a node after a tick that changed it.

    Attributes:
        time: Seconds from the start of the run.
        tick: The number of the tick, beginning with 1.
        place: The node.
        old: Its status before the tick.
        new: Its status after the tick.
    """

    time: float
    tick: int
    place: Place
    old: str
    new: str

    def __str__(self) -> str:
        """Such as ``4.2 s  look_for_user: SUCCESS``."""
        return f"{seconds_text(self.time)}  {self.place.short}: {self.new}"


class Record:
    """Notes the changes of one run.

    Args:
        places: The nodes of the mission.

    Attributes:
        statuses: The last known status of every node that was reached, by path.
        outcomes: Path and outcome (success, failure, stopped, skipped) of every node that had one.
        broken: The tracebacks of exceptions that came out of the tree.
    """

    def __init__(self, places: MissionMap) -> None:
        self.statuses: dict[str, str] = {}
        self.outcomes: set[tuple[str, str]] = set()
        self.broken: list[str] = []
        self._places = places
        self._started: float | None = None
        self._changes: list[Change] = []
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
                # The test is told of those in their own words.
                if "MockError" not in detail:
                    self.broken.append(detail)
            case EventKind.STOP_ASKED | EventKind.ENDED:
                # The tree is stopped as a whole; no event tells it of each node.
                running = [path for path, status in self.statuses.items() if status == RUNNING]
                self.outcomes.update((path, STOPPED) for path in running)

    def changes(self) -> list[Change]:
        """Every change so far, by tick and then in the order of the tree."""
        self._close_tick()
        return self._changes

    def places_with(self, status: str) -> list[Place]:
        """The nodes that have a status now, in the order of the tree."""
        found = (self._places.find(path) for path, now in self.statuses.items() if now == status)
        return sorted(found, key=lambda place: place.index)

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
            Change(since, tick, self._places.find(path), old, new)
            for path, (old, new) in self._open.items()
            if old != new
        ]
        self._changes += sorted(changed, key=lambda change: change.place.index)
        self._open = {}


def trace_text(changes: Iterable[Change]) -> str:
    """One line for each change; equal runs give equal texts."""
    return "\n".join(str(change) for change in changes)


def seconds_text(seconds: float) -> str:
    """Such as ``4.2 s``; to the millisecond, without trailing zeros."""
    return f"{round(seconds, 3) + 0.0:.3f}".rstrip("0").rstrip(".") + " s"
