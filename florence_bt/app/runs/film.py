"""A recorded run as it stood after each of its moments: it is run again, from the start to go back."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from py_trees.common import Status

from florence_bt.app.runs.recorded_mission import RecordedMission
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.text import event_words
from florence_bt.runtime.replay.moments import FROM_OUTSIDE, Moment
from florence_bt.runtime.replay.replay import EARLY_S, Replay, ReplayDiverged
from florence_bt.runtime.viewers.variables import variables_of
from florence_bt.trees.drawings.ascii import TreeRow

MOST_KEPT = 200
"""Frames that are kept: to go back by some steps shall not run everything again."""
SAY = "say"
"""The skill that speaks."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A run after one of its moments.

    Attributes:
        number: The number of the moment, from 0.
        tick: The tick.
        at: Seconds since the start of the run, pauses counted.
        happened: What happened in the moment, a sentence each, the most telling first.
        rows: All nodes of the tree as they stood.
        keys: The keys with their values, those of called missions behind their paths.
        changed: The names of those that the moment has changed.
        said: What the robot has said by then, the latest last.
    """

    number: int
    tick: int
    at: float
    happened: Sequence[str]
    rows: Sequence[TreeRow]
    keys: Mapping[str, str]
    changed: frozenset[str]
    said: Sequence[str]


class Film:
    """The frames of a run.

    Args:
        recorded: The run with its missions.

    Attributes:
        recorded: The run.
        moments: Its moments, one for each frame.
        failures: The numbers of the moments in which a node failed by itself, in order.
        ends_early: Why there are no frames of the whole run; empty when there are.

    Raises:
        ConfigError: The run cannot be run again from its first moment on.
    """

    def __init__(self, recorded: RecordedMission) -> None:
        self.recorded = recorded
        self.ends_early = ""
        self._early = EARLY_S[0]
        self._count = self._farthest()
        if not self._count:
            raise ConfigError(
                f"the run {recorded.row.run_id} cannot be run again: {self.ends_early}",
                valid=["florence status --events, which shows what was recorded"],
            )
        self._kept: OrderedDict[int, Frame] = OrderedDict()
        self._frames = self._play()
        self._next = 0
        self.moments = self._replay().moments[: self._count]
        self.failures = [moment.number for moment in self.moments if any(map(fails_itself, moment.events))]

    def __len__(self) -> int:
        """Count the frames."""
        return self._count

    def frame(self, number: int) -> Frame:
        """Return a frame; the first or the last one when there is none of that number."""
        number = min(max(number, 0), self._count - 1)
        if number not in self._kept and number < self._next:
            self._frames, self._next = self._play(), 0
        while number not in self._kept:
            frame = next(self._frames)
            self._kept[frame.number] = frame
            self._next = frame.number + 1
            if len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
        return self._kept[number]

    def _replay(self) -> Replay:
        recorded = self.recorded
        return Replay(recorded.run(), recorded.events, recorded.library, recorded.declarations, *self._early)

    def _farthest(self) -> int:
        """Find the way of replaying that comes farthest; return how many moments it comes through."""
        best = -1
        for early in EARLY_S:
            self._early, done = early, 0
            try:
                for moment in (replay := self._replay()).steps():
                    done = moment.number + 1
                self.ends_early = ""
                return len(replay.moments)
            except ReplayDiverged as error:
                if done > best:
                    best, farthest, self.ends_early = done, early, str(error)
        self._early = farthest
        return best

    def _play(self) -> Iterator[Frame]:
        replay = self._replay()
        said: list[str] = []
        keys: dict[str, str] = {}
        for moment in replay.steps():
            said += [str(event.inputs.get("text", "")) for event in moment.events if speaks(event)]
            before, keys = keys, _keys(replay)
            changed = frozenset(name for name, value in keys.items() if before.get(name) != value)
            rows = replay.run.rows or replay.tree.rows()
            at = moment.time - (replay.run.started or 0.0)
            happened = list(sentences(moment))
            yield Frame(moment.number, moment.tick, at, happened, rows, keys, changed, tuple(said))


def sentences(moment: Moment) -> Iterator[str]:
    """Yield what happened in a moment: what came from outside, skills, failures, else the last change."""
    told = [event for event in moment.events if _is_telling(event)]
    for event in told or moment.events[-1:]:
        yield event_words(event)


def _is_telling(event: JournaledEvent) -> bool:
    skills = (EventKind.SKILL_STARTED.value, EventKind.SKILL_ENDED.value)
    return event.kind in FROM_OUTSIDE or event.kind in skills or fails_itself(event)


def fails_itself(event: JournaledEvent) -> bool:
    """Tell whether a node fails that is the cause itself, and not one above it."""
    return event.new == Status.FAILURE.name and event.data.get("cause") == event.node


def speaks(event: JournaledEvent) -> bool:
    """Tell whether the robot begins to say something."""
    return event.kind == EventKind.SKILL_STARTED.value and event.skill == SAY


def _keys(replay: Replay) -> dict[str, str]:
    stores = variables_of(replay.tree.tree).stores
    return {
        f"{prefix}{key}": store.shown(key, value)
        for prefix, store in stores.items()
        for key, value in store.as_dict().items()
    }
