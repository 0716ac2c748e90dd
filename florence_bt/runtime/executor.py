"""The executor: decides which mission runs, and wakes its tree when something happened. It sleeps otherwise.

It runs on one thread with one injected clock. What can wake it: a skill run that changed, a timer of a node,
a trigger, a stop. At most one mission runs at a time; further ones wait or are refused (``arbiter``).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Protocol

from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.why import Why
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.skill import Skill
from florence_bt.runtime.arbiter import Admission, decide, name_of
from florence_bt.runtime.breakpoints import Breakpoints
from florence_bt.runtime.event_bus import EventBus, EventLog, Listener, NoLog
from florence_bt.runtime.events import EventKind, seconds_text
from florence_bt.runtime.missions import MissionFolders, ReloadReport
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds, RunStatus
from florence_bt.runtime.run_environment import RunEnvironment
from florence_bt.runtime.run_queue import RunQueue
from florence_bt.runtime.tree_run import END_LIMIT_S, TreeRun
from florence_bt.trees.checks.lint import check
from florence_bt.trees.drawings.ascii import TreeRow
from florence_bt.trees.language.compile import CompiledTree
from florence_bt.trees.language.findings import Finding, raise_first_error
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

__all__ = ["END_LIMIT_S", "QUEUE_LIMIT", "Executor", "RequestRefused"]

OVERRIDE = "manual override"
"""The name under which the override blocks."""
QUEUE_LIMIT = 50
"""Runs that may be queued."""


class RequestRefused(FlorenceError):
    """A request was refused because of what runs now; the message says what would have worked."""


class LeftRuns(Protocol):
    """The runs that a dead process left, as long as they have not been taken up."""

    def stop(self, reason: str, run_id: str | None) -> MissionRun | None:
        """Give up the run with this id, else the one that had the robot; None when there is none."""

    def pause(self, reason: str, run_id: str | None) -> MissionRun:
        """Let the run that has the robot next come back paused; raises RequestRefused when none may."""


class Executor:
    """Runs missions one at a time.

    Args:
        library: The missions, or folders of missions that are looked at before each trigger.
        skills: The skills by name; a mission that needs a missing one is refused.
        declarations: What the skills say about themselves.
        clock: Drives everything.
        run_ids: Names the runs.
        call_soon: Runs a callback on the executor's thread after the current one has returned.
        log: Keeps what happens; nothing is acknowledged before it is safe there.
        queue_limit: How many runs may be queued.
        yield_cpu: Called when the skills of a tick were started and only the telling is left.
        on_tick: Called with the run after each tick.

    Attributes:
        current: The run that is not over yet, or None.
        last: The run that ended last, or None.
        left_runs: What a dead process left, as long as it is not decided what becomes of it; else None.
        lost_breakpoints: The breakpoints that a process before had; they died with it.
    """

    def __init__(
        self,
        library: MissionLibrary | MissionFolders,
        skills: Mapping[str, Skill],
        declarations: Mapping[str, SkillDeclaration],
        clock: Clock,
        run_ids: RunIds,
        call_soon: Callable[[Callable[[], None]], object] | None = None,
        *,
        log: EventLog | None = None,
        queue_limit: int = QUEUE_LIMIT,
        yield_cpu: Callable[[], None] = lambda: None,
        on_tick: Callable[[MissionRun], None] = lambda run: None,
    ) -> None:
        self.current: MissionRun | None = None
        self.last: MissionRun | None = None
        self.left_runs: LeftRuns | None = None
        self.lost_breakpoints: tuple[str, ...] = ()
        self._breakpoints = Breakpoints()
        self._queue = RunQueue(queue_limit)
        self._active: TreeRun | None = None
        self._missions = library
        self._skills = skills
        self._declarations = declarations
        self._clock = clock
        self._run_ids = run_ids
        self._call_soon = call_soon or (lambda callback: clock.call_at(clock.now(), callback))
        self._event_bus = EventBus(clock, log or NoLog())
        self._blocks: dict[str, str] = {}
        self._wake_asked = self._woke_itself = False
        self._yield_cpu = yield_cpu
        self._on_tick = on_tick

    def add_listener(self, listener: Listener) -> None:
        """Call back with the run at every event: the topics, the live view, the recorder."""
        self._event_bus.add_listener(listener)

    @property
    def library(self) -> MissionLibrary:
        """The missions in force."""
        missions = self._missions
        return missions.library if isinstance(missions, MissionFolders) else missions

    @property
    def blocked_by(self) -> str | None:
        """Say why no mission may start, or None."""
        return next(iter(self._blocks.values()), None)

    # ---- the runs that are known ------------------------------------------------------------------------

    @property
    def waiting(self) -> tuple[MissionRun, ...]:
        """The queued runs, the next one first."""
        return tuple(self._queue)

    def find(self, run_id: str | None = None) -> MissionRun | None:
        """Find the run with this id among the current, the queued and the last one; without an id the current
        run or else the last one.
        """
        candidates = [self.current, *self._queue, self.last]
        for run in candidates:
            if run is not None and run_id in (None, "", run.run_id):
                return run
        return None

    def nodes_of(self, run: MissionRun) -> tuple[TreeRow, ...]:
        """Return the nodes of a run's tree with its clean-ups; of one that is over as they stood at its end.

        There are none of a run that another process has built.
        """
        active = self._active
        return active.rows() if active is not None and run is active.run else run.rows

    def tip(self) -> str:
        """Return the name of the node that the current run waits for, empty when nothing runs."""
        return self._active.tip() if self._active is not None else ""

    @property
    def tree(self) -> CompiledTree | None:
        """The tree of the current run for those who look at it, None when nothing runs."""
        return self._active.tree if self._active is not None else None

    def keys(self) -> KeyStore | None:
        """Return the keys of the current run's mission, None when nothing runs."""
        return self._active.tree.keys if self._active is not None else None

    # ---- triggers -------------------------------------------------------------------------------------

    def trigger(self, request: MissionRequest) -> MissionRun:
        """Start, queue or refuse a mission.

        Returns:
            The new run, running or queued. Its first tick comes right after this call, not inside it.

        Raises:
            ConfigError: Unknown mission, one with errors, or bad inputs; the message says what would have
                worked.
            RequestRefused: Another mission runs, too many wait, or triggers are blocked.
        """
        self.reload()
        return self.accept(request)

    def accept(self, request: MissionRequest) -> MissionRun:
        """Do what :meth:`trigger` does, with the missions as they were read last."""
        mission = self.library.get(request.mission)
        raise_first_error(mission.findings)
        inputs = parse_inputs(mission, request.inputs)
        decision = decide(request, self.current, self.blocked_by, queue=self._queue)
        if decision.admission is Admission.REJECT:
            raise RequestRefused(decision.reason)
        kinds = {name: port.kind for name, port in mission.inputs.items()}
        run = MissionRun(self._new_id(request.mission), request, inputs, input_kinds=kinds)
        run.note = self.note_about(request.mission)
        run.version = self.version_of(request.mission)
        # A run that has to wait is built again when its turn comes: what is wrong is said to the caller.
        tree = self._build(run)
        if self.current is None:
            self._begin(tree)
            return run
        preempts = decision.admission is Admission.PREEMPT
        self._queue.add(run, first=preempts)
        self._event_bus.publish(run, EventKind.QUEUED, reason=decision.reason)
        if preempts:
            self.stop(f"preempted by {run.run_id} ({request.caller})")
        return run

    def stop(self, reason: str, run_id: str | None = None) -> MissionRun | None:
        """Stop the current run, or the one with this id (queued and paused ones too).

        Returns:
            The run that is being stopped, None when there was nothing to stop.
        """
        queued = self._queue.remove(run_id) if run_id is not None else None
        if queued is not None:
            self._close(queued, RunStatus.STOPPED, Why(queued.mission, "stopped", reason))
            return queued
        if self.left_runs is not None:
            return self.left_runs.stop(reason, run_id)
        if self._active is None or run_id not in (None, self._active.run.run_id):
            return None
        run = self._active.run
        self._active.stop(reason)
        return run

    def stop_all(self, reason: str) -> None:
        """Stop the current run and drop every queued one."""
        waiting = self._queue.take_all()
        if self._active is not None:
            self._active.stop(reason)
        for run in waiting:
            self._close(run, RunStatus.STOPPED, Why("queue", "stopped", reason))

    def abandon(self, reason: str) -> None:
        """Stop everything and do not wait for the ends of the skills: for the end of the process."""
        self.stop_all(reason)
        if self._active is not None:
            self._active.abandon()

    # ---- missions -------------------------------------------------------------------------------------

    def reload(self) -> ReloadReport:
        """Load what was edited in the mission files; a broken edit keeps the previous version.

        Each trigger does this too. Runs that go on keep the version that they were built from.
        """
        missions = self._missions
        return missions.refresh() if isinstance(missions, MissionFolders) else ReloadReport()

    def findings_of(self, mission: Mission) -> list[Finding]:
        """Return what the check says about a mission in force."""
        missions = self._missions
        if isinstance(missions, MissionFolders):
            return missions.findings_of(mission)
        return check(mission, missions, self._declarations)

    def warnings(self) -> list[str]:
        """Return what people should know though missions run: unused edits, a journal in trouble."""
        missions = self._missions
        held = missions.held if isinstance(missions, MissionFolders) else {}
        trouble = self._event_bus.log.trouble
        told = [*(f"{name}: {reason}" for name, reason in held.items()), *([trouble] if trouble else [])]
        if self._breakpoints.names:
            told.append(f"breakpoints are set: {', '.join(self._breakpoints.names)} (florence break --clear)")
        if self.lost_breakpoints:
            lost = " ".join(map(repr, self.lost_breakpoints))
            told.append(
                f"breakpoints were lost with the process before: florence break {lost} sets them again"
            )
        return told

    def note_about(self, mission: str) -> str:
        """Return what callers of a mission should know, e.g. that an edit is not used; mostly empty."""
        missions = self._missions
        return missions.note_about(mission) if isinstance(missions, MissionFolders) else ""

    def version_of(self, mission: str) -> str:
        """Compute the fingerprint of a mission with what it calls; empty if missions come from no folders."""
        missions = self._missions
        return missions.version_of(mission) if isinstance(missions, MissionFolders) else ""

    # ---- pause ----------------------------------------------------------------------------------------

    def pause(self, reason: str, run_id: str | None = None) -> MissionRun:
        """Pause the current run: its skills are cancelled, its tree is not ticked, its time stands still.

        Returns:
            The run, with the reason that counts: of a run that is paused already it is the first one, unless
            somebody has asked for its resume meanwhile, which is taken back.

        Raises:
            RequestRefused: There is no run that could be paused; says why.
        """
        if self.left_runs is not None:
            return self.left_runs.pause(reason or "asked", run_id)
        active = self._pausable(run_id, "paused")
        active.pause(reason or "asked")
        return active.run

    def resume(self, run_id: str | None = None) -> MissionRun:
        """Go on with a paused run: its skills are started again with the same inputs.

        Returns:
            The run; still PAUSED while skills that were cancelled for the pause have not reported their ends.

        Raises:
            RequestRefused: There is no paused run; says why.
        """
        active = self._pausable(run_id, "resumed")
        if active.run.status is not RunStatus.PAUSED:
            raise RequestRefused(f"{name_of(active.run)} is not paused; it goes on already")
        active.resume()
        return active.run

    # ---- breakpoints ----------------------------------------------------------------------------------

    @property
    def breakpoints(self) -> tuple[str, ...]:
        """The breakpoints, in the order in which they were set."""
        return tuple(self._breakpoints.names)

    def break_before(self, names: Iterable[str]) -> None:
        """Pause every run before a node of these names starts (:class:`Breakpoints`), until :meth:`clear`."""
        self._breakpoints.add(names)
        self._tell_breakpoints()

    def clear(self, names: Collection[str] = ()) -> None:
        """Take breakpoints away, all when none is named. A run that stands at one stays paused.

        Raises:
            ConfigError: There is no such breakpoint.
        """
        unknown = self._breakpoints.remove(names or self.breakpoints)
        self._tell_breakpoints()
        if unknown:
            raise ConfigError(
                f"there is no breakpoint {unknown[0]!r}",
                valid=self._breakpoints.names or ["florence break NODE"],
            )

    def step(self, run_id: str | None = None) -> MissionRun:
        """Let the current run go on to the start of the next leaf, and pause it before that.

        Raises:
            RequestRefused: There is no run that could be paused; says why.
        """
        active = self._pausable(run_id, "stepped")
        self._breakpoints.stepping = True
        if active.run.status is RunStatus.PAUSED:
            active.resume()
        return active.run

    def _tell_breakpoints(self) -> None:
        """Keep in the journal which breakpoints a run has: a process that follows cannot know them."""
        self.lost_breakpoints = ()
        if self.current is not None:
            self._event_bus.publish(
                self.current,
                EventKind.BREAKPOINTS,
                nodes=list(self.breakpoints),
                reason=", ".join(self.breakpoints) or "none",
            )

    # ---- override -------------------------------------------------------------------------------------

    def override(self, reason: str) -> None:
        """Stop the current run, drop every queued one and let nothing start until :meth:`release`."""
        self.block(
            OVERRIDE,
            f"the manual override is on ({reason}); release it first: florence release, or false on "
            "florenceLocator/manualOverride",
        )
        self.give_up_robot(reason)

    def give_up_robot(self, reason: str) -> None:
        """Stop the current run and drop every queued one: a person has, or had, the robot by hand.

        Clean-ups go on without what drives: the base belongs to somebody else now.
        """
        if self._active is not None:
            self._active.keep_off(f"manual override: {reason}")
        self.stop_all(f"manual override: {reason}")

    def release(self) -> bool:
        """Let missions start again after :meth:`override`; what was stopped stays stopped.

        Returns:
            Whether the override was on.
        """
        was_on = OVERRIDE in self._blocks
        self.block(OVERRIDE, None)
        return was_on

    def block(self, who: str, reason: str | None) -> None:
        """Let no mission start for a reason, or no longer block (None); each ``who`` has one reason."""
        if reason is None:
            self._blocks.pop(who, None)
        else:
            self._blocks[who] = reason

    # ---- after a crash --------------------------------------------------------------------------------

    def resume_recovered(self, tree: TreeRun) -> None:
        """Go on with a paused run of the process before; nothing else may be running."""
        tree.on_tick, tree.on_over = self._after_tick, self._on_over
        tree.move_to(self.environment())
        if tree.run.started is not None:
            tree.run.started = self._clock.now() - (tree.clock.now() - tree.run.started)
        self.current, self._active = tree.run, tree
        if tree.run.paused:
            self._event_bus.publish(tree.run, EventKind.RECOVERED, paused=True, reason=tree.run.paused)
        else:
            tree.resume(EventKind.RECOVERED)

    def queue_again(self, runs: Iterable[MissionRun]) -> None:
        """Let runs wait that the process before had in its queue."""
        for run in runs:
            self._queue.add(run)
            self._event_bus.publish(run, EventKind.QUEUED, reason="queued again after a crash")
        self._start_next()

    def close_past(
        self, run: MissionRun, status: RunStatus, why: Why | None, *, taken_up: bool = False
    ) -> None:
        """End a run of the process before; it is the last one that people are shown.

        Args:
            run: The run.
            status: How it ends.
            why: The cause when it was no success.
            taken_up: Whether it was taken up, and found to have nothing more to do.
        """
        self.last = run
        if taken_up:
            self._event_bus.publish(run, EventKind.RECOVERED)
        self._close(run, status, why)

    def environment(self) -> RunEnvironment:
        """Return what runs work with here."""
        return RunEnvironment(
            self.library,
            self._skills,
            self._declarations,
            self._clock,
            self.wake,
            self._event_bus,
            self._breakpoints,
            self._yield_cpu,
        )

    # ---- waking ---------------------------------------------------------------------------------------

    def wake(self) -> None:
        """Ask for a tick; any number of calls before the tick count as one."""
        if not self._wake_asked:
            self._wake_asked = True
            self._call_soon(self._on_wake)

    # ---- inside ---------------------------------------------------------------------------------------

    def _on_wake(self) -> None:
        self._wake_asked = False
        if self._active is not None:
            self._active.step(by_itself=self._woke_itself)
            self._woke_itself = self._wake_asked
            self._event_bus.log.commit()

    def _build(self, run: MissionRun) -> TreeRun:
        """Build what a run works with; starts nothing."""
        run.texts = self.library.texts_of(run.mission)
        return TreeRun(run, self.environment(), self._after_tick, self._on_over)

    def _begin(self, tree: TreeRun) -> None:
        run = tree.run
        self.current, self._active = run, tree
        self._woke_itself = False
        run.status = RunStatus.RUNNING
        run.started = self._clock.now()
        kinds = {name: kind.value for name, kind in run.input_kinds.items()}
        self._event_bus.publish(
            run, EventKind.STARTED, inputs=dict(run.inputs), kinds=kinds, caller=run.request.caller
        )
        if self.breakpoints:
            self._tell_breakpoints()
        self.wake()

    def _after_tick(self, run: MissionRun) -> None:
        self._event_bus.call(run, self._on_tick)

    def _on_over(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        self.current = self._active = None
        self._breakpoints.stepping = False
        self.last = run
        self._close(run, status, why)
        self._start_next()

    def _start_next(self) -> None:
        while self._queue and self.current is None:
            self._begin_waiting(self._queue.take())

    def _begin_waiting(self, run: MissionRun) -> None:
        """Start a run whose turn has come; its mission may have changed since it was accepted."""
        try:
            tree = self._build(run)
        except ConfigError as error:
            self._close(run, RunStatus.FAILED, Why(run.mission, "bad_mission", str(error)))
            return
        self._begin(tree)

    def _close(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        run.status = status
        run.why = why
        run.ended = self._clock.now()
        self._event_bus.publish(
            run,
            EventKind.ENDED,
            status=status.value,
            code=run.code,
            reason=run.reason,
            cause=why.path if why else "",
            duration=seconds_text(run.started, run.ended),
        )

    def _new_id(self, mission: str) -> str:
        run_id = self._run_ids.next(mission)
        while self._event_bus.log.knows(run_id):
            run_id = self._run_ids.next(mission)
        return run_id

    def _pausable(self, run_id: str | None, word: str) -> TreeRun:
        """Return the run that may be paused or resumed."""
        active = self._active
        if run_id is not None and any(run.run_id == run_id for run in self._queue):
            raise RequestRefused(
                f"the run {run_id} waits for its turn and cannot be {word}; it can be stopped"
            )
        if active is None:
            raise RequestRefused(f"no mission is running, so none can be {word}")
        if run_id not in (None, active.run.run_id):
            raise RequestRefused(f"no run {run_id!r} is running; {name_of(active.run)} is")
        if active.run.status is RunStatus.ENDING:
            raise RequestRefused(f"{name_of(active.run)} is ending already and cannot be {word}")
        return active
