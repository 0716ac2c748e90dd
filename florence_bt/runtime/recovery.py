"""What follows when the process died on its runs: the robot is made safe, then each mission's policy counts.

``abort`` gives the run up, ``restart`` begins the mission anew, ``resume`` goes on where the journal ends.
Nothing is started while it is not certain that the robot stands still.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from florence_bt.behaviours.why import Why
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.core.skill import SkillRun
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import OVERRIDE, Executor
from florence_bt.runtime.journal import (
    Journal,
    JournalBroken,
    JournaledEvent,
    JournaledRun,
    JournalReader,
    JournalTooNew,
)
from florence_bt.runtime.journal.schema import OWN_FILE
from florence_bt.runtime.journal.text import with_one_clock
from florence_bt.runtime.journal.tree_text import tree_from_events
from florence_bt.runtime.replay import ReplayDiverged, replay, typed
from florence_bt.runtime.run import MissionRun, Policy, Request, RunStatus

MakeSafe = Callable[[], SkillRun]
"""Brings the robot to a stand and cancels what older processes asked of it; succeeds when it stands."""
SAFE_LIMIT_S = 20.0
"""How long making the robot safe may take."""
MAX_IN_A_ROW = 3
"""A run that was taken up so often is given up: perhaps it is what kills the process."""
CRASHED = "crashed"
RECOVERY = "recovery"
RESTART_OF = "restart of "


@dataclass(frozen=True, slots=True)
class LeftRun:
    """A run that the process before left without an end."""

    row: JournaledRun
    events: tuple[JournaledEvent, ...]

    def has(self, kind: EventKind) -> bool:
        """Whether something of a kind happened in it."""
        return any(event.kind == kind.value for event in self.events)


class Recovery:
    """Takes up what the process before left.

    Args:
        executor: Where missions run now.
        journal: The journal that both processes write.
        declarations: What the skills say about themselves.
        clock: For the limit of making safe.
        tell: Told what became of each run, in one sentence.
    """

    def __init__(
        self,
        executor: Executor,
        journal: Journal,
        declarations: Mapping[str, SkillDeclaration],
        clock: Clock,
        tell: Callable[[str], None] = lambda text: None,
    ) -> None:
        self._executor = executor
        self._journal = journal
        self._declarations = declarations
        self._clock = clock
        self._tell = tell
        self._past: list[LeftRun] = []
        self._safe_run: SkillRun | None = None

    def begin(self, make_safe: MakeSafe | None = None) -> bool:
        """Look for runs without an end; when there are some, make the robot safe and take them up.

        Triggers are refused until that is over. Call it once, before anything else is triggered.

        Args:
            make_safe: Makes the robot safe; None when nothing can move.

        Returns:
            Whether there was something to take up.
        """
        if not self._something_left():
            return False
        self._executor.block(RECOVERY, "the robot is being made safe after a crash; ask again in a moment")
        if make_safe is None:
            self._take_up("")
            return True
        self._safe_run = make_safe()
        self._safe_run.on_change(self._look)
        self._clock.call_at(self._clock.now() + SAFE_LIMIT_S, self._too_late)
        self._look()
        return True

    @property
    def making_safe(self) -> bool:
        """Whether the robot is being made safe, so that triggers are refused."""
        return self._safe_run is not None

    def _something_left(self) -> bool:
        """Read the journal. One that cannot be read may hide anything: then the robot is made safe too."""
        try:
            return self._read()
        except JournalTooNew as error:
            self._tell(f"{error}; it is left alone, and runs are kept in {OWN_FILE} beside it")
        except JournalBroken as error:
            self._tell(f"runs that went on when the process before died are not taken up: {error}")
            self._journal.set_aside(str(error))
        except FlorenceError as error:
            self._tell(f"it is not known what the process before left: {error}")
        return True

    def _read(self) -> bool:
        if not self._journal.exists():
            return False
        with JournalReader(self._journal.folder) as reader:
            self._past = [LeftRun(row, tuple(reader.events(row.run_id))) for row in reader.unfinished()]
            overridden = reader.note(OVERRIDE)
            latest = reader.runs(1)
        if latest and latest[0].status.final:
            # Who asks for the last run after a restart means this one.
            self._executor.last = latest[0].as_run()
        if overridden:
            self._executor.override(overridden)
            self._tell(f"the manual override is still on: {overridden}")
        return bool(self._past)

    def _look(self) -> None:
        result = self._safe_run.poll() if self._safe_run is not None else None
        if result is not None:
            self._safe_run = None
            self._take_up("" if result.succeeded else result.reason)

    def _too_late(self) -> None:
        run, self._safe_run = self._safe_run, None
        if run is not None:
            run.cancel()
            self._take_up(f"that was not done within {SAFE_LIMIT_S:g} s")

    def _take_up(self, unsafe: str) -> None:
        """Decide about each run, the one that had the robot first."""
        self._executor.block(RECOVERY, None)
        past, self._past = self._past, []
        waiting: list[MissionRun] = []
        for each in sorted(past, key=lambda each: each.row.started is None):
            self._journal.continue_run(each.row.run_id, each.events[-1].seq if each.events else 0)
            if unsafe:
                self._abort(each, f"the robot could not be made safe: {unsafe}")
            elif self._executor.blocked_by is not None:
                self._abort(each, self._executor.blocked_by)
            elif each.has(EventKind.STOP_ASKED):
                self._abort(each, "it was being stopped")
            elif each.row.started is None:
                waiting.append(self._run_of(each))
                self._tell(f"{each.row.run_id} waits for its turn again after a crash")
            else:
                self._by_policy(each)
        self._executor.queue_again(waiting)

    def _by_policy(self, past: LeftRun) -> None:
        mission = self._executor.library.find(past.row.mission)
        if mission is None:
            self._abort(past, f"there is no mission {past.row.mission!r} any more")
        elif mission.on_restart == "restart":
            self._restart(past)
        elif mission.on_restart == "resume":
            self._resume(past)
        else:
            self._abort(past, "its on_restart says abort")

    def _abort(self, past: LeftRun, reason: str) -> None:
        run = self._run_of(past)
        run.tree = tree_from_events(past.events)
        text = f"the process died on it; {reason}"
        self._executor.close_past(run, RunStatus.ABORTED, Why(run.mission, CRASHED, text))
        self._tell(f"{run.run_id} aborted: {text}")

    def _restart(self, past: LeftRun) -> None:
        if self._times_restarted(past.row) >= MAX_IN_A_ROW:
            self._abort(past, f"it was restarted {MAX_IN_A_ROW} times in a row already")
            return
        run = self._run_of(past)
        request = Request(
            run.mission, run.inputs, f"{RESTART_OF}{run.run_id}", Policy.QUEUE, run.request.priority
        )
        # One transaction: after another crash the mission is neither forgotten nor restarted twice.
        with self._journal.together():
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
        run = self._run_of(past)
        times = sum(event.kind == EventKind.RECOVERED.value for event in past.events)
        reason = ""
        if times >= MAX_IN_A_ROW:
            reason = f"it was resumed {times} times already"
        elif past.row.version != self._executor.version_of(run.mission):
            reason = "its mission file was changed since, so it cannot be resumed"
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
            self._executor.close_past(done.tree.run, *done.over)
            return
        self._executor.take_up(done.tree)
        tip = self._executor.tip()
        self._tell(f"{run.run_id} goes on after a crash, {f'at {tip!r}' if tip else 'with its clean-up'}")

    def _run_of(self, past: LeftRun) -> MissionRun:
        """The run as it began, with inputs of the types that its mission declares."""
        row = past.row
        mission = self._executor.library.find(row.mission)
        ports = mission.inputs if mission is not None else {}
        inputs = {name: typed(value, ports.get(name)) for name, value in row.inputs.items()}
        request = Request(row.mission, inputs, row.caller, Policy(row.policy), row.priority)
        run = MissionRun(row.run_id, request, inputs, version=row.version, note=row.note)
        run.ticks = row.ticks
        times = [event.time for event in with_one_clock(past.events)]
        if row.started is not None and times:
            # On the clock of this process, without the time in which no process ran.
            run.started = self._clock.now() - (times[-1] - times[0])
        return run
