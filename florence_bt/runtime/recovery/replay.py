"""Brings the tree of a run to where its journal ends: the mission is run once more with recorded skills.

The tree ticks at the recorded moments on a clock driven by hand, and every skill answers what it answered
then. Each tick must do what the journal says it did; if one does not, the run cannot be resumed. Timers of a
live clock fire a little late, so a replay that differs is tried again with timers that fire a little early.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from math import inf

from py_trees.common import Status

from florence_bt.behaviours.cleaning_up import CLEANUP
from florence_bt.behaviours.watched_skill import WatchedSkill
from florence_bt.behaviours.why import Why, path_of
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Outcome, Result, cancelled
from florence_bt.core.skill import Inputs
from florence_bt.runtime.event_bus import EventBus, NoLog
from florence_bt.runtime.events import EventKind, RunEvent, plain
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.rows import typed
from florence_bt.runtime.journal.text import match_ends, with_one_clock
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.runtime.run_environment import RunEnvironment
from florence_bt.runtime.tree_run import TreeRun
from florence_bt.trees.language.loader import MissionLibrary

EARLY_S = (0.0, 0.002, 0.02)
"""How much early the timers of a replay fire, tried one after the other."""
_TICKED = (EventKind.NODE.value, EventKind.SKILL_STARTED.value, EventKind.SKILL_ENDED.value)
_COMPARED = (EventKind.NODE.value, EventKind.SKILL_STARTED.value)
_BETWEEN = (EventKind.PAUSED.value, EventKind.RESUMED.value, EventKind.RECOVERED.value)
"""What happens between two ticks and starts or ends skills."""


class ReplayDiverged(FlorenceError):
    """The mission does not do what the journal says it did."""


@dataclass
class Replayed:
    """The end of a replay.

    Attributes:
        tree: The run's tree, paused at the last recorded moment; or over. When all that was left of the run
            are clean-ups beside the tree, these go on when it is resumed, and nothing else.
        over: How the run ended, when its end was reached in the replay.
    """

    tree: TreeRun
    over: tuple[RunStatus, Why | None] | None


def replay(
    run: MissionRun,
    events: Sequence[JournaledEvent],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
) -> Replayed:
    """Run a mission once more up to the end of its journal.

    Args:
        run: The run as it began, with typed inputs; another object is made of it for each try.
        events: Everything that the journal has of it.
        library: The missions, in the version that the run was started with.
        declarations: What the skills say about themselves.

    Raises:
        ReplayDiverged: A tick does something else than the journal says.
        ConfigError: The mission has an error.
    """
    problem: ReplayDiverged | None = None
    for early in EARLY_S:
        try:
            return _Replay(replace(run), events, library, declarations, early).go()
        except ReplayDiverged as error:
            problem = problem or error
    assert problem is not None
    raise problem


class _Replay:
    def __init__(
        self,
        run: MissionRun,
        events: Sequence[JournaledEvent],
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
        early_s: float,
    ) -> None:
        self._run = run
        run.ticks = 0
        self._early_s = early_s
        self._events = list(with_one_clock(events))
        if not self._events or self._events[0].kind not in (
            EventKind.STARTED.value,
            EventKind.QUEUED.value,
        ):
            raise ReplayDiverged("the journal of the run has no beginning")
        self._clock = ManualClock(self._events[0].time)
        self._done: list[RunEvent] = []
        self._started_between: list[tuple[str, ...]] = []
        self._last_change = {
            event.tick: index
            for index, event in enumerate(self._events)
            if event.kind == EventKind.NODE.value
        }
        self._between = _between_ticks(self._events, self._last_change)
        self._records: dict[int, _Recorded] = {}
        self._over: tuple[RunStatus, Why | None] | None = None
        self._skills = {name: _RecordedSkill(declaration, run) for name, declaration in declarations.items()}
        self._give_ends()
        event_bus = EventBus(self._clock, NoLog())
        event_bus.add_listener(lambda run, event: self._done.append(event))
        environment = RunEnvironment(
            library, self._skills, declarations, self._clock, lambda: None, event_bus
        )
        self._tree = TreeRun(run, environment, lambda run: None, self._on_over)

    def go(self) -> Replayed:
        self._run.status = RunStatus.RUNNING
        self._run.started = next(
            (e.time for e in self._events if e.kind == EventKind.STARTED.value), self._clock.now()
        )
        ticks = [event for event in self._events if event.kind in _TICKED]
        last = max((event.tick for event in ticks), default=0)
        for index, event in enumerate(self._events):
            if index in self._between.ends or index in self._between.starts:
                self._go_on_between(index)
            elif event.kind in _TICKED and event.tick > self._run.ticks:
                self._tick(index, complete=event.tick < last)
            elif event.kind == EventKind.PAUSED.value:
                self._advance(event.time, 0.0)
                # A tick that changed nothing is not in the journal.
                self._run.ticks = max(self._run.ticks, event.tick)
                self._tree.pause(event.reason)
                # Told once more when a resume was taken back: then this reason counts.
                self._run.paused = event.reason
            elif event.kind in (EventKind.RESUMED.value, EventKind.RECOVERED.value):
                self._advance(event.time, 0.0)
                self._run.ticks = max(self._run.ticks, event.tick)
                if event.kind == EventKind.RECOVERED.value:
                    self._let_go()
                self._tree.pause(event.reason)
                if not event.data.get("paused"):
                    self._tree.resume()
            if self._over is not None:
                break
        if self._over is None:
            self._advance(self._events[-1].time, 0.0)
            self._let_go()
        if self._over is None:
            self._tree.pause(self._run.paused)
        return Replayed(self._tree, self._over)

    def _let_go(self) -> None:
        """Let go of what ran: its process has died, so nobody need wait for the end of a run."""
        for skill in self._skills.values():
            skill.let_go()
        if self._run.status is RunStatus.ENDING:
            self._tree.step()

    def _go_on_between(self, index: int) -> None:
        """Let a clean-up beside the tree do what it did between two ticks: a skill ends or starts."""
        event = self._events[index]
        self._advance(event.time, self._early_s)
        # A tick that changed nothing is not in the journal.
        self._run.ticks = max(self._run.ticks, event.tick)
        start = self._between.ends.get(index)
        if start in self._records:
            self._records[start].held = False
        for skill in self._skills.values():
            skill.release(event.tick)
        self._clock.advance_to(self._clock.now())  # a clean-up ticks right after it was woken
        self._note_starts()
        if start is None:
            if _recorded(event) not in self._started_between:
                raise ReplayDiverged(_difference(event.tick, [_recorded(event)], self._started_between))
            self._started_between.remove(_recorded(event))

    def _note_starts(self) -> None:
        """Note what clean-ups have started since the last tick."""
        started = (event for event in self._done if event.kind is EventKind.SKILL_STARTED)
        self._started_between += [_did(event) for event in started]
        self._done.clear()

    def _tick(self, index: int, *, complete: bool) -> None:
        """Do the tick whose first event has this index, and compare."""
        first = self._events[index]
        self._advance(first.time, self._early_s)
        for skill in self._skills.values():
            skill.release(first.tick)
        self._note_starts()
        self._run.ticks = first.tick - 1
        later = ((at, self._events[at]) for at in range(index, len(self._events)))
        of_tick = takewhile(lambda each: each[1].tick == first.tick and each[1].kind not in _BETWEEN, later)
        compared = [
            event for at, event in of_tick if event.kind in _COMPARED and at not in self._between.starts
        ]
        for node in self._asked_in_background(compared):
            node.ask_again()
        self._tree.step()
        wanted = [_recorded(event) for event in compared]
        done = [_did(event) for event in self._done if event.kind.value in _COMPARED]
        self._done.clear()
        if (done[: len(wanted)] if not complete else done) != wanted:
            raise ReplayDiverged(_difference(first.tick, wanted, done))

    def _asked_in_background(self, compared: Sequence[JournaledEvent]) -> Iterator[WatchedSkill]:
        """Yield the watched skills that were asked again in a tick before the tree came to them.

        These questions come first, in the order of the tree. A node that began to run after other starts has
        started its skill itself, in its turn.
        """
        starts = [event for event in compared if event.kind == EventKind.SKILL_STARTED.value]
        nodes = self._tree.root.iterate() if starts else ()
        watched = {path_of(node): node for node in nodes if isinstance(node, WatchedSkill)}
        places = {path: place for place, path in enumerate(watched)}
        began = {event.node for event in compared if event.new == Status.RUNNING.name}
        last: float = -1
        for event in starts:
            place = places.get(event.node)
            if place is not None and (place > last or event.node not in began):
                yield watched[event.node]
            last = inf if place is None or place <= last else place

    def _advance(self, when: float, early_s: float) -> None:
        # A skill's deadline or a timer may only mark what the next tick sees: nothing ticks in between.
        self._clock.advance_to(max(when, self._clock.now()) + early_s)

    def _on_over(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        self._over = status, why

    def _give_ends(self) -> None:
        """Give each recorded start the end that belongs to it."""
        records, unseen = self._records, _ends_after_leaving(self._events, self._last_change)
        for index, event in enumerate(self._events):
            if event.kind == EventKind.SKILL_STARTED.value and event.skill in self._skills:
                records[index] = _Recorded()
                self._skills[event.skill].records.append(records[index])
        for start, end in match_ends(self._events):
            event = self._events[end]
            # One that was cancelled for a pause is started again and has its end there.
            if start in records and not (event.data.get("paused") and event.code != "ok"):
                records[start].tick = event.tick
                records[start].late = end > self._last_change.get(event.tick, -1)
                records[start].in_pause = bool(event.data.get("paused"))
                records[start].held = end in self._between.ends
                records[start].after_leaving = end in unseen and not records[start].held
                records[start].result = _result(event, self._skills[event.skill].declaration)


@dataclass
class _Recorded:
    """The end of a recorded run of a skill; without a result it went on when the process died.

    Attributes:
        tick: The tick in which the end was published, or after which.
        late: Whether it is the last event of that tick. A run that was left ended after it.
        held: Whether the end is that of a skill of a clean-up, not published yet: it comes between two ticks.
        in_pause: Whether it ended well in a pause, although it was cancelled for that or left before.
        after_leaving: Whether it ended only after its node had left it: the node never saw the end.
        result: How it ended.
    """

    tick: int = 0
    late: bool = False
    held: bool = False
    in_pause: bool = False
    after_leaving: bool = False
    result: Result | None = None


class _RecordedSkill:
    """A skill that answers what it answered then, run by run in the order of the starts."""

    def __init__(self, declaration: SkillDeclaration, mission: MissionRun) -> None:
        self.declaration = declaration
        self.records: list[_Recorded] = []
        self._mission = mission
        self._starts = 0
        self._open: list[_RecordedRun] = []

    def start(self, inputs: Inputs) -> _RecordedRun:
        """Start the next recorded run; one that never ends when the journal has no more."""
        record = self.records[self._starts] if self._starts < len(self.records) else _Recorded()
        self._starts += 1
        run = _RecordedRun(record, self._mission)
        self._open.append(run)
        return run

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Do nothing: the journal reports changes, and no timer asks again."""
        return lambda: None

    def release(self, tick: int) -> None:
        """Tell the runs that ended by this tick."""
        for run in tuple(self._open):
            run.release(tick)
        # A long journal has thousands of runs: those that have ended are not asked again.
        self._open = [run for run in self._open if run.result is None]

    def let_go(self) -> None:
        """End the runs that were left and had not ended when the process died."""
        for run in tuple(self._open):
            run.let_go()


@dataclass
class _RecordedRun:
    """One recorded run of a skill."""

    record: _Recorded
    mission: MissionRun
    callbacks: list[Callable[[], None]] = field(default_factory=list)
    result: Result | None = None
    feedback: str = ""
    left: bool = False

    def poll(self) -> Result | None:
        """Return the recorded result, from the recorded tick on."""
        if self._has_ended_by(self.mission.ticks):
            self.result = self.record.result
        return self.result

    def cancel(self) -> None:
        """End at once for a pause; a run that is left takes its time: others may have waited for its end."""
        if self.mission.status is RunStatus.PAUSED:
            done = self.record.result if self.record.in_pause else None
            self.result = self.result or done or cancelled()
        else:
            self.left = True

    def on_change(self, callback: Callable[[], None]) -> None:
        """Remember whom to wake."""
        self.callbacks.append(callback)

    def release(self, tick: int) -> None:
        """Take the recorded result if the run ended by this tick, and wake who waits."""
        if self._has_ended_by(tick):
            self._end(self.record.result)

    def let_go(self) -> None:
        """End if it was left: the process that would have published its end has died."""
        if self.left and self.result is None:
            self._end(self.record.result or cancelled())

    def _has_ended_by(self, tick: int) -> bool:
        if self.record.held or ((self.record.after_leaving or self.record.in_pause) and not self.left):
            return False
        last = self.record.tick + (self.left and self.record.late)
        return self.result is None and self.record.result is not None and tick >= last

    def _end(self, result: Result | None) -> None:
        self.result = result
        for callback in self.callbacks:
            callback()


def _recorded(event: JournaledEvent) -> tuple[str, ...]:
    if event.kind == EventKind.NODE.value:
        return (event.kind, event.node, event.new)
    return (event.kind, event.node, event.skill, repr(sorted(event.inputs.items())))


def _did(event: RunEvent) -> tuple[str, ...]:
    data = event.data
    if event.kind is EventKind.NODE:
        return (event.kind.value, data["node"], data["new"])
    inputs = repr(sorted(plain(data["inputs"]).items()))
    return (event.kind.value, data["node"], data["skill"], inputs)


def _difference(tick: int, wanted: list[tuple[str, ...]], done: list[tuple[str, ...]]) -> str:
    index = next((i for i, (w, d) in enumerate(zip(wanted, done, strict=False)) if w != d), None)
    if index is None:
        index = min(len(wanted), len(done))
    recorded = " ".join(wanted[index]) if index < len(wanted) else "nothing more"
    did = " ".join(done[index]) if index < len(done) else "nothing more"
    return f"in tick {tick} the journal has: {recorded}; the mission now does: {did}"


def _result(event: JournaledEvent, declaration: SkillDeclaration) -> Result:
    outputs = {name: typed(value, declaration.outputs.get(name)) for name, value in event.outputs.items()}
    outcome = Outcome(event.data.get("outcome", Outcome.FAILED.value))
    return Result(outcome, event.code or "ok", event.reason, outputs)


@dataclass(frozen=True, slots=True)
class _BetweenTicks:
    """The starts and ends of clean-ups between two ticks of the tree; indices of events.

    Attributes:
        starts: Starts of skills.
        ends: The end of a skill -> its start.
    """

    starts: frozenset[int]
    ends: dict[int, int]


def _between_ticks(events: Sequence[JournaledEvent], last_change: dict[int, int]) -> _BetweenTicks:
    """Find what clean-ups beside the tree did by themselves.

    Args:
        events: Everything that the journal has of a run.
        last_change: Tick -> index of the last change of a node in it. The events of a tick come before that.
    """
    beside = _starts_beside(events)
    return _BetweenTicks(
        frozenset(index for index in beside if index > last_change.get(events[index].tick, -1)),
        {
            end: start
            for start, end in match_ends(events)
            if start in beside and end > last_change.get(events[end].tick, -1)
        },
    )


def _starts_beside(events: Sequence[JournaledEvent]) -> set[int]:
    """Return the starts of skills below the node of a clean-up, from its beginning to its end."""
    going: list[str] = []
    found = set()
    for index, event in enumerate(events):
        if event.kind == EventKind.SKILL_STARTED.value and event.skill == CLEANUP:
            going.append(event.node)
        elif event.kind == EventKind.SKILL_ENDED.value and event.skill == CLEANUP and event.node in going:
            going.remove(event.node)
        elif event.kind == EventKind.SKILL_STARTED.value and any(
            f"{event.node}/".startswith(f"{node}/") for node in going
        ):
            found.add(index)
    return found


def _ends_after_leaving(events: Sequence[JournaledEvent], last_change: Mapping[int, int]) -> frozenset[int]:
    """Return the ends of skills that came only after their nodes had left them.

    Args:
        events: Everything that the journal has of a run.
        last_change: Tick -> index of the last change of a node in it. The events of a tick come before that.

    Returns:
        Indices of events.
    """
    answered, left = _answered(events), _left_before(events)
    found = set()
    for start, end in match_ends(events):
        event = events[end]
        was_cancelled = event.data.get("outcome") == Outcome.CANCELLED.value
        # Any other end between two ticks may also be that of a skill that answers at once after a pause.
        late = end > last_change.get(event.tick, -1) and left[end] > start
        if (was_cancelled or late) and (event.tick, event.node) not in answered:
            found.add(end)
    return frozenset(end for end in found if not events[end].data.get("paused"))


def _answered(events: Sequence[JournaledEvent]) -> set[tuple[int, str]]:
    """Return every tick and node in which the node ended by itself."""
    ends = (Status.SUCCESS.value, Status.FAILURE.value)
    return {
        (event.tick, event.node)
        for event in events
        if event.kind == EventKind.NODE.value and event.new in ends
    }


def _left_before(events: Sequence[JournaledEvent]) -> dict[int, int]:
    """Map each end of a skill to the last time before that its node was left; indices of events, or -1."""
    left: dict[str, int] = {}
    found = {}
    for index, event in enumerate(events):
        if event.kind == EventKind.NODE.value and event.new == Status.INVALID.value:
            left[event.node] = index
        elif event.kind == EventKind.SKILL_ENDED.value:
            found[index] = left.get(event.node, -1)
    return found
