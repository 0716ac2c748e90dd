"""Recovery after the process died on its runs: the robot is made safe, then each mission's policy counts.

``abort`` gives the run up, ``restart`` starts the mission again, ``resume`` goes on where the journal ends.
Nothing is started while it is not certain that the robot stands still, nor before everything has booted, nor
when the last entry of the journal is old: then nobody expects the robot to drive off. What a person has
stopped stays so: the run that had the robot comes back paused when it was paused, and no run comes back that
was there when the manual override was switched on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import inf
from typing import Protocol

from florence_bt.behaviours.why import Why
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import success
from florence_bt.core.skill import FinishedRun, SkillRun
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import Executor, RequestRefused
from florence_bt.runtime.journal import (
    Journal,
    JournalBroken,
    JournaledEvent,
    JournaledRun,
    JournalReader,
)
from florence_bt.runtime.journal.text import tree_from_events, with_one_clock
from florence_bt.runtime.replay.replay import ReplayDiverged, replay
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus, TriggerPolicy

MakeSafe = Callable[[], SkillRun]
"""Brings the robot to a stand and cancels what older processes asked of it; succeeds when it stands."""
SAFE_LIMIT_S = 20.0
"""Limit for making the robot safe."""
BOOT_LIMIT_S = 60.0
"""Limit of the wait for what is still booting before the runs are aborted, from the start on."""
BOOT_PERIOD_S = 0.25
"""Period of looking for it."""
MAX_REPLAYED = 30_000
"""The most events of a run that is replayed: 2 s on two ordinary cores, without an answer to anybody."""
FRESH_S = 60.0
"""Largest age of the last entry of the journal with which its runs are recovered."""
MAX_IN_A_ROW = 3
"""A run that was recovered this often is given up: perhaps it is what kills the process."""
CRASHED = "crashed"
RECOVERY = "recovery"
RESTART_OF = "restart of "


class Safety(Protocol):
    """Stops what drives the robot, whoever asked for it."""

    def make_safe(self) -> SkillRun:
        """Stop everything that moves the robot.

        Returns:
            A run that succeeds when the robot is known to stand still. It ends within a bounded time in any
            case; a failure says what is not known.
        """


def _nothing_moves() -> SkillRun:
    return FinishedRun(success())


def _never() -> None:
    """Return None: nobody has taken the robot over."""


@dataclass(frozen=True, slots=True)
class LeftRun:
    """A run that the process before left without an end."""

    row: JournaledRun
    events: tuple[JournaledEvent, ...]

    def has(self, kind: EventKind) -> bool:
        """Tell whether something of a kind happened in it."""
        return any(event.kind == kind.value for event in self.events)

    @property
    def paused(self) -> str:
        """Say why it was paused; empty when it was not."""
        return self.row.reason if self.row.state == RunStatus.PAUSED.value else ""

    @property
    def breakpoints(self) -> tuple[str, ...]:
        """The breakpoints that there were last."""
        told = [event.data for event in self.events if event.kind == EventKind.BREAKPOINTS.value]
        return tuple(map(str, told[-1].get("nodes", ()))) if told else ()

    def accepted_after(self, date: datetime) -> bool:
        """Tell whether it was triggered after a date; not when its own date is damaged."""
        try:
            return datetime.fromisoformat(self.row.accepted) > date
        except (ValueError, TypeError):
            return False


class Recovery:
    """Takes up what the process before left.

    Args:
        executor: Where missions run now.
        journal: The journal that both processes write.
        declarations: What the skills say about themselves.
        clock: The clock of the executor.
        notify: Called with what happened to each run, in one sentence.
        steady: For the limits of waiting; ``clock`` when not given.
        fresh_s: How old the last entry of the journal may be for its runs to be recovered; infinite when this
            process is known to follow the one that died.
        date: The date of now.
    """

    def __init__(
        self,
        executor: Executor,
        journal: Journal,
        declarations: Mapping[str, SkillDeclaration],
        clock: Clock,
        notify: Callable[[str], None] = lambda text: None,
        *,
        steady: Clock | None = None,
        fresh_s: float = FRESH_S,
        date: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._executor = executor
        self._journal = journal
        self._declarations = declarations
        self._clock = clock
        self._notify = notify
        self._steady = steady or clock
        self._fresh_s = fresh_s
        self._date = date
        self._past: list[LeftRun] = []
        self._too_old = ""
        self._safe_run: SkillRun | None = None
        self._make_safe: MakeSafe = _nothing_moves
        self._missing: Callable[[], Sequence[str]] = tuple
        self._overridden: Callable[[], datetime | None] = _never
        self._pause_asked = ""
        self._booting = False
        self._boot_until = 0.0

    def begin(
        self,
        make_safe: MakeSafe = _nothing_moves,
        missing: Callable[[], Sequence[str]] = tuple,
        overridden: Callable[[], datetime | None] = _never,
    ) -> bool:
        """Look for runs without an end; when there are some, make the robot safe and take them up.

        Triggers are refused until that is over. Call it once, before anything else is triggered.

        Args:
            make_safe: Makes the robot safe; not given when nothing can move.
            missing: What the missions need and is still booting, for people; empty when all is there.
            overridden: When the manual override was switched on last, perhaps while no mission server ran;
                None when it never was.

        Returns:
            Whether there was something to recover.
        """
        if not self._something_left():
            return False
        self._executor.block(RECOVERY, "the robot is being made safe after a crash; ask again in a moment")
        self._make_safe, self._missing, self._overridden = make_safe, missing, overridden
        self._boot_until = self._steady.now() + BOOT_LIMIT_S
        self._executor.left_runs = self
        self._stop_robot()
        return True

    @property
    def going_on(self) -> bool:
        """Tell whether the robot is being made safe or something still boots: triggers are refused."""
        return self._executor.left_runs is self

    @property
    def missions(self) -> set[str]:
        """The missions of the runs that it is not decided of yet what becomes of them."""
        return {past.row.mission for past in self._past}

    def stop(self, reason: str, run_id: str | None) -> MissionRun | None:
        """Give up the run with this id, else the one that had the robot; None when there is none."""
        for past in self._past:
            if past.row.run_id == run_id or (run_id is None and past.row.started is not None):
                self._past.remove(past)
                return self._abort(past, f"it was stopped before it was taken up again: {reason}")
        return None

    def pause(self, reason: str, run_id: str | None) -> MissionRun:
        """Let the run that has the robot next come back paused.

        Raises:
            RequestRefused: Nothing was left that could come back, or not under this id.
        """
        for past in self._past:
            if run_id in (None, past.row.run_id):
                self._pause_asked = self._paused() or reason
                return replace(self._run_of(past), paused=self._pause_asked)
        raise RequestRefused("after a crash there is no such run that could be paused; florence runs has all")

    def _paused(self) -> str:
        """Tell why the run that had the robot was paused, or shall be when it comes back; empty when not."""
        return next((each.paused for each in self._past if each.paused), self._pause_asked)

    def _something_left(self) -> bool:
        """Read the journal. One that cannot be read may hide anything: then the robot is made safe too."""
        try:
            return self._read()
        except JournalBroken as error:
            self._notify(f"runs that were active when the previous process died are not recovered: {error}")
            self._journal.set_aside(str(error))
        except FlorenceError as error:
            self._notify(f"it is not known what the previous process left: {error}")
        return True

    def _read(self) -> bool:
        if not self._journal.exists():
            return False
        with JournalReader(self._journal.folder) as reader:
            self._past = [LeftRun(row, tuple(reader.events(row.run_id))) for row in reader.unfinished()]
            latest = reader.runs(1)
            self._too_old = self._age_problem(reader.last_entry())
        if latest and latest[0].status.final:
            # A query for the last run after a restart means this one.
            self._executor.last = latest[0].as_run()
        return bool(self._past)

    def _age_problem(self, written: str) -> str:
        """Tell why runs are not recovered because of the date of the last entry; empty when it is fresh."""
        if self._fresh_s == inf:
            return ""
        try:
            age = (self._date() - datetime.fromisoformat(written)).total_seconds()
        except (ValueError, TypeError):
            return "the date of its last entry in the journal is not known"
        if 0.0 <= age <= self._fresh_s:
            return ""
        when = f"{age:.0f} s ago" if age >= 0.0 else "in the future: the clock was set back"
        return f"its last entry in the journal is {when}, and the limit is {self._fresh_s:g} s"

    def _stop_robot(self) -> None:
        self._booting = bool(self._missing())
        run = self._safe_run = self._make_safe()
        run.on_change(lambda: self._look(run))
        self._safe_limit = self._steady.call_at(
            self._steady.now() + SAFE_LIMIT_S, lambda: self._too_late(run)
        )
        self._look(run)

    def _look(self, run: SkillRun) -> None:
        result = run.poll()
        if result is not None and self._safe_run is run:
            self._safe_run = None
            self._safe_limit.cancel()
            self._stopped("" if result.succeeded else f"the robot could not be made safe: {result.reason}")

    def _too_late(self, run: SkillRun) -> None:
        if self._safe_run is run:
            self._safe_run = None
            run.cancel()
            self._stopped(f"the robot could not be made safe: that was not done within {SAFE_LIMIT_S:g} s")

    def _stopped(self, unsafe: str) -> None:
        """Take the runs up, unless something still boots: the base too may have been silent."""
        missing = self._missing()
        if missing and not all(map(self._given_up, self._past)):
            if self._steady.now() < self._boot_until:
                self._steady.call_at(self._steady.now() + BOOT_PERIOD_S, lambda: self._stopped(unsafe))
                return
            unsafe = f"{', '.join(missing)}: not there after {BOOT_LIMIT_S:g} s"
        elif unsafe and self._booting and self._steady.now() < self._boot_until:
            self._stop_robot()
            return
        self._recover_runs(unsafe)

    def _given_up(self, past: LeftRun) -> str:
        """Tell why a run does not go on, whatever becomes of the robot; empty when it may."""
        if self._too_old:
            return f"{self._too_old}; {_again(past)}"
        if past.has(EventKind.STOP_ASKED):
            return "it was being stopped"
        overridden = self._overridden()
        if overridden is not None and not past.accepted_after(overridden):
            return "the manual override was switched on meanwhile"
        if past.row.started is None:
            return ""
        mission = self._executor.library.find(past.row.mission)
        if mission is None:
            return f"there is no mission {past.row.mission!r} any more"
        return "" if mission.on_restart in ("restart", "resume") else "its on_restart says abort"

    def _recover_runs(self, unsafe: str) -> None:
        """Decide about each run, the one that had the robot first."""
        self._executor.left_runs = None
        self._executor.block(RECOVERY, None)
        self._pause_asked = self._paused()
        past, self._past = self._past, []
        for each in past:
            self._tell_lost_breakpoints(each)
        # One transaction: after another crash nothing is forgotten, restarted twice, or drives off.
        with self._journal.together():
            self._executor.queue_again(self._take_up(past, unsafe))
            self._stay_paused()

    def _tell_lost_breakpoints(self, past: LeftRun) -> None:
        if past.breakpoints:
            self._executor.lost_breakpoints = past.breakpoints
            names = ", ".join(past.breakpoints)
            self._notify(
                f"breakpoints are lost with the process that died: {names}; florence break sets them"
            )

    def _take_up(self, past: Sequence[LeftRun], unsafe: str) -> list[MissionRun]:
        """Abort, restart or resume each run; gives those that go on waiting for their turn."""
        waiting: list[MissionRun] = []
        for each in past:
            reason = self._given_up(each) or unsafe or self._executor.blocked_by
            if reason:
                self._abort(each, reason)
            elif each.row.started is None:
                waiting.append(self._continued(each))
                self._notify(f"{each.row.run_id} waits for its turn again after a crash")
            else:
                self._by_policy(each)
        return waiting

    def _stay_paused(self) -> None:
        """Pause the run that has the robot now when the one before was paused: nobody has resumed it."""
        current = self._executor.current
        if self._pause_asked and current is not None and current.status is RunStatus.RUNNING:
            self._executor.pause(self._pause_asked)
            self._notify(
                f"{current.run_id} waits for a resume, as the run before the crash: {current.paused}"
            )

    def _by_policy(self, past: LeftRun) -> None:
        if self._executor.library.get(past.row.mission).on_restart == "restart":
            self._restart(past)
        else:
            self._resume(past)

    def _abort(self, past: LeftRun, reason: str) -> MissionRun:
        run = self._continued(past)
        run.tree = tree_from_events(past.events)
        text = f"the process died during it; {reason}"
        self._executor.close_past(run, RunStatus.ABORTED, Why(run.mission, CRASHED, text))
        self._notify(f"{run.run_id} aborted: {text}")
        return run

    def _restart(self, past: LeftRun) -> None:
        if self._times_restarted(past.row) >= MAX_IN_A_ROW:
            self._abort(past, f"it was restarted {MAX_IN_A_ROW} times in a row already")
            return
        run = self._run_of(past)
        request = MissionRequest(
            run.mission, run.inputs, f"{RESTART_OF}{run.run_id}", TriggerPolicy.QUEUE, run.request.priority
        )
        try:
            new = self._executor.trigger(request)
        except FlorenceError as error:
            self._abort(past, f"it could not be restarted: {error}")
            return
        self._abort(past, f"restarted as {new.run_id}")

    def _times_restarted(self, row: JournaledRun) -> int:
        times = 0
        with JournalReader(self._journal.folder) as reader:
            found: JournaledRun | None = row
            while found is not None and found.caller.startswith(RESTART_OF):
                times += 1
                found = reader.run(found.caller.removeprefix(RESTART_OF))
        return times

    def _resume(self, past: LeftRun) -> None:
        run = self._continued(past)
        times = sum(event.kind == EventKind.RECOVERED.value for event in past.events)
        reason = ""
        if times >= MAX_IN_A_ROW:
            reason = f"it was resumed {times} times already"
        elif past.row.version != self._executor.version_of(run.mission):
            reason = "its mission file was changed since, so it cannot be resumed"
        elif len(past.events) > MAX_REPLAYED:
            reason = f"its journal has {len(past.events)} events, more than {MAX_REPLAYED}; " + _again(past)
        elif past.row.lost:
            reason = f"its journal lacks {past.row.lost} events, so it cannot be resumed"
        if reason:
            self._abort(past, reason)
            return
        try:
            done = replay(run, past.events, self._executor.library, self._declarations)
        except ReplayDiverged as error:
            self._abort(past, f"it cannot be resumed: {error}")
            return
        except FlorenceError as error:
            self._abort(past, f"its mission cannot be built: {error}")
            return
        except Exception as error:
            # The server must come up, whatever an older version or somebody's node left in the journal.
            self._abort(past, f"it cannot be resumed: {type(error).__name__}: {error}")
            return
        if done.over is not None:
            self._executor.close_past(done.tree.run, *done.over, taken_up=True)
            return
        done.tree.run.paused = self._pause_asked
        self._executor.resume_recovered(done.tree)
        tip = self._executor.tip()
        word = "is still paused" if self._pause_asked else "goes on"
        self._notify(f"{run.run_id} {word} after a crash, {f'at {tip!r}' if tip else 'with its clean-up'}")

    def _continued(self, past: LeftRun) -> MissionRun:
        """Return the run as it began; what happens in it from now on comes behind what the journal has."""
        self._journal.continue_run(past.row.run_id, past.events[-1].seq if past.events else 0)
        return self._run_of(past)

    def _run_of(self, past: LeftRun) -> MissionRun:
        """Return the run as it began, with inputs of the types that its mission declares."""
        row = past.row
        mission = self._executor.library.find(row.mission)
        inputs = row.typed_inputs(mission)
        ports = mission.inputs if mission is not None else {}
        request = MissionRequest(row.mission, inputs, row.caller, TriggerPolicy(row.policy), row.priority)
        run = MissionRun(row.run_id, request, inputs, version=row.version, note=row.note)
        run.input_kinds = {name: port.kind for name, port in ports.items()}
        run.ticks = row.ticks
        times = [event.time for event in with_one_clock(past.events)]
        if row.started is not None and times:
            # On the clock of this process, without the time in which no process ran.
            run.started = self._clock.now() - (times[-1] - times[0])
        return run


def _again(past: LeftRun) -> str:
    return f"start it again with: florence run {past.row.run_id}"
