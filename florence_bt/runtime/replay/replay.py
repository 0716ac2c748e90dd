"""Runs a mission once more with its recorded skills, moment by moment as the journal has them.

The tree ticks at the recorded moments on a clock driven by hand, and every skill answers what it answered
then; stops, pauses, overrides and crashes come when they came. Each moment must do what the journal says it
did. Timers of a live clock fire a little late, so a replay that differs is tried again with timers that fire
a little early.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from florence_bt.behaviours.watched_skill import WatchedSkill
from florence_bt.behaviours.why import Why, path_of
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.breakpoints import Breakpoints
from florence_bt.runtime.event_bus import EventBus, NoLog
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.text import with_one_clock
from florence_bt.runtime.replay.comparison import Difference, ending_difference, first_difference
from florence_bt.runtime.replay.moments import BEGINNING, COMPARED, TICKED, Moment, moments
from florence_bt.runtime.replay.recorded_skills import Now, recorded_skills
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.runtime.run_environment import RunEnvironment
from florence_bt.runtime.tree_run import END_LIMIT_S, TreeRun
from florence_bt.trees.language.loader import MissionLibrary

T = TypeVar("T")

ROUNDING_S = 1e-9
"""Advance of timers for each moment: a sum of durations may lie behind the moment that it is."""
EARLY_S = ((0.0, 0.0), (0.0, ROUNDING_S), (0.002, ROUNDING_S), (0.02, ROUNDING_S))
"""Advances of the timers of a replay, at first and more after each moment; tried in this order."""


class ReplayDiverged(FlorenceError):
    """The mission does not do what the journal says it did.

    Attributes:
        difference: What is different; None when the journal has no run that could be replayed.
    """

    def __init__(self, problem: str, difference: Difference | None = None) -> None:
        super().__init__(problem)
        self.difference = difference
        self.moment = difference.moment if difference is not None else 0


@dataclass
class Replayed:
    """The end of a replay that is to go on.

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
    """Run a mission once more up to the end of a journal that its process has left without an end.

    Args:
        run: The run as it began, with typed inputs; another object is made of it for each try.
        events: Everything that the journal has of it.
        library: The missions, in the version that the run was started with.
        declarations: What the skills say about themselves.

    Raises:
        ReplayDiverged: A moment does something else than the journal says.
        ConfigError: The mission has an error.
    """
    return _first_that_agrees(run, events, library, declarations, Replay.to_go_on)


def check(
    run: MissionRun,
    events: Sequence[JournaledEvent],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
) -> Difference | None:
    """Run a mission once more and return the first thing that it does otherwise than the journal says.

    Args:
        run: As for :func:`replay`.
        events: Everything that the journal has of it.
        library: The missions that are tried.
        declarations: What the skills say about themselves.

    Raises:
        ReplayDiverged: The journal has no run that could be replayed.
        ConfigError: The mission has an error.
    """
    try:
        _first_that_agrees(run, events, library, declarations, Replay.to_the_end)
    except ReplayDiverged as error:
        if error.difference is None:
            raise
        return error.difference
    return None


def _first_that_agrees(
    run: MissionRun,
    events: Sequence[JournaledEvent],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
    go: Callable[[Replay], T],
) -> T:
    """Try with timers that fire at their moments and early; the error is of the try that came farthest."""
    farthest: ReplayDiverged | None = None
    for early, more in EARLY_S:
        try:
            return go(Replay(run, events, library, declarations, early, more))
        except ReplayDiverged as error:
            if error.difference is None:
                raise
            if farthest is None or farthest.moment < error.moment:
                farthest = error
    assert farthest is not None
    raise farthest


class Replay:
    """A run that is run once more, a moment at a time.

    Args:
        run: The run as it began, with typed inputs; it is copied.
        events: What the journal has of it.
        library: The missions.
        declarations: What the skills say about themselves.
        early_s: How much early timers fire, seconds.
        more_s: How much earlier after each moment.

    Attributes:
        run: The run as it stands in the replay.
        tree: Its tree.
        moments: The moments of its journal.
        over: How the run ended, once its end was reached.

    Raises:
        ReplayDiverged: The journal has no beginning of the run.
        ConfigError: The mission has an error.
    """

    def __init__(
        self,
        run: MissionRun,
        events: Sequence[JournaledEvent],
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
        early_s: float = 0.0,
        more_s: float = 0.0,
    ) -> None:
        self.run = replace(run, ticks=0)
        self.moments = moments(list(with_one_clock(events)))
        if not self.moments or self.moments[0].kind not in BEGINNING:
            raise ReplayDiverged("the journal of the run has no beginning")
        self.over: tuple[RunStatus, Why | None] | None = None
        self._early_s, self._more_s = early_s, more_s
        self._clock = ManualClock(self.moments[0].time)
        self._now = Now()
        self._skills = recorded_skills(self.moments, declarations, self._now)
        self._done: list[RunEvent] = []
        self._woken = self._woke_itself = False
        self._moment_at, self._before = self._clock.now(), 0.0
        event_bus = EventBus(self._clock, NoLog())
        event_bus.add_listener(lambda run, event: self._done.append(event))
        self._breakpoints = Breakpoints()
        environment = RunEnvironment(
            library, self._skills, declarations, self._clock, self._wake, event_bus, self._breakpoints
        )
        self.tree = TreeRun(self.run, environment, lambda run: None, self._on_over)
        self.run.status = RunStatus.RUNNING
        beginning = self.moments[0].events
        self.run.started = next(
            (event.time for event in beginning if event.kind == EventKind.STARTED.value), self._clock.now()
        )
        self._last_ticked = max(
            (moment.number for moment in self.moments if any(e.kind in TICKED for e in moment.events)),
            default=0,
        )
        ends = [
            event.new
            for moment in self.moments
            for event in moment.events
            if event.kind == EventKind.ENDED.value
        ]
        self._ended = bool(ends) and ends != [RunStatus.ABORTED.value]

    # ---- ways through the journal ---------------------------------------------------------------------

    def to_go_on(self) -> Replayed:
        """Replay all moments and let the run stand paused, as a process left it that died.

        Raises:
            ReplayDiverged: A moment does something else than the journal says.
        """
        for moment in self.moments:
            self.step(moment)
            if self.over is not None:
                return Replayed(self.tree, self.over)
        self._advance(self.moments[-1].events[-1].time, 0.0)
        self._die(self.run.paused)
        return Replayed(self.tree, self.over)

    def to_the_end(self) -> None:
        """Replay all moments, and compare the end.

        Raises:
            ReplayDiverged: A moment, or the end, is another one than the journal says.
        """
        for _ in self.steps():
            pass

    def steps(self) -> Iterator[Moment]:
        """Replay all moments, and yield each when it is done; the end of a run that was given up is none.

        Raises:
            ReplayDiverged: As :meth:`to_the_end`.
        """
        for moment in self.moments:
            if moment.events[0].new != RunStatus.ABORTED.value:
                self.step(moment)
            yield moment

    def step(self, moment: Moment) -> None:
        """Replay the next moment.

        Raises:
            ReplayDiverged: It does something else than the journal says.
        """
        self._done.clear()
        self._do_quiet_ticks(moment.tick - 1 if moment.kind in TICKED else moment.tick)
        self._now.moment = moment.number
        if self.over is None or moment.kind == EventKind.ENDED.value:
            self._do(moment)
        self._compare(moment)

    # ---- moments --------------------------------------------------------------------------------------

    def _do(self, moment: Moment) -> None:
        event = moment.events[0]
        if moment.kind in TICKED:
            self._tick(moment)
            return
        if moment.kind in BEGINNING:
            return
        self._advance(moment.time, 0.0)
        # A tick that changed nothing is not in the journal.
        self.run.ticks = max(self.run.ticks, moment.tick)
        self._release()
        match EventKind(moment.kind):
            case EventKind.PAUSED:
                self.tree.pause(event.reason)
                # Told once more when a resume was taken back: then this reason counts.
                self.run.paused = event.reason
            case EventKind.RESUMED:
                self.tree.resume()
            case EventKind.RECOVERED:
                self._die(event.reason)
                if self.over is None and not event.data.get("paused"):
                    self.tree.resume()
            case EventKind.OVERRIDDEN:
                self.tree.keep_off(event.reason)
            case EventKind.STOP_ASKED:
                self.tree.stop(event.reason)
            case EventKind.ENDED:
                self._end(event)

    def _tick(self, moment: Moment) -> None:
        self._advance(moment.time, self._early_s)
        self._release()
        self.run.ticks = moment.tick - 1
        held = [event.data.get("nodes", ()) for event in moment.events if event.kind == EventKind.HELD.value]
        self._breakpoints.paths = [path for paths in held for path in paths]
        for node in self._asked_again(moment):
            node.ask_again()
        self._step_tree()

    def _do_quiet_ticks(self, last: int) -> None:
        """Do the ticks that the tree has asked for and that changed nothing: they are not in the journal."""
        while self._woke_itself and self.run.ticks < last and self.over is None:
            self._step_tree()

    def _step_tree(self) -> None:
        """Step as the executor does: it knows whether the step before has asked for this one."""
        by_itself, self._woken = self._woke_itself, False
        self.tree.step(by_itself=by_itself)
        self._woke_itself = self._woken

    def _die(self, paused: str) -> None:
        """Come to where a process has died: the ends of what ran are not awaited, and the run is paused."""
        self._let_go()
        self.tree.finish_if_drained()
        if self.over is None:
            self.tree.pause(paused)
            self._let_go()

    def _end(self, event: JournaledEvent) -> None:
        """Come to the end as the run did: by itself, or because somebody did not wait for it any longer."""
        self._now.moment = len(self.moments)
        self._release()
        if self.over is None and self.run.status is RunStatus.PAUSED:
            # That somebody asked to go on is not in the journal before the run goes on. It had this time.
            self._resume_at(event.time - END_LIMIT_S)
        self._advance(event.time, self._early_s)
        if self.over is None:
            self._step_tree()
        if self.run.status is RunStatus.ENDING:
            self.tree.abandon()

    def _resume_at(self, when: float) -> None:
        self._advance(when, 0.0)
        self.tree.resume()

    def _let_go(self) -> None:
        for skill in self._skills.values():
            skill.let_go()

    def _release(self) -> None:
        for skill in self._skills.values():
            skill.release()

    def _asked_again(self, moment: Moment) -> Iterator[WatchedSkill]:
        """Yield the watched skills that were asked again in the background in a tick."""
        asked = {event.node for event in moment.compared if event.data.get("again")}
        for node in self.tree.root.iterate() if asked else ():
            if isinstance(node, WatchedSkill) and path_of(node) in asked:
                yield node

    def _advance(self, when: float, early_s: float) -> None:
        # A skill's deadline or a timer may only mark what the next tick sees: nothing ticks in between.
        if when > self._moment_at:
            self._moment_at = when
            self._before += self._more_s
        self._clock.advance_to(max(when + self._before, self._clock.now()) + early_s)

    def _wake(self) -> None:
        self._woken = True

    def _on_over(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        self.over = status, why

    # ---- comparison -----------------------------------------------------------------------------------

    def _compare(self, moment: Moment) -> None:
        """Compare what a moment has done with the journal; a process that died may not have written all."""
        done = [event for event in self._done if event.kind.value in COMPARED]
        difference = first_difference(
            moment, done, self.run.started or 0.0, complete=self._ended or moment.number < self._last_ticked
        )
        if difference is None and moment.kind == EventKind.ENDED.value:
            difference = ending_difference(moment, self.over, self.tree.tip(), self.run.started or 0.0)
        if difference is not None:
            raise ReplayDiverged(str(difference), difference)
