"""The executor: ticks the tree of the current mission when something happened, and sleeps otherwise.

It runs on one thread with one injected clock. What can wake it: a skill run that changed, a timer of a node,
a trigger, a stop. At most one mission runs at a time; further ones wait or are refused (``arbiter``).
"""

from __future__ import annotations

import traceback
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import py_trees
from py_trees.common import Status

from florence_bt.behaviours.composites import CLEANUP
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.clock import Clock, Timer
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Skill
from florence_bt.runtime.arbiter import Verdict, decide
from florence_bt.runtime.events import Event, EventKind, node_changes, seconds_text
from florence_bt.runtime.run import MissionRun, Request, RunIds, RunStatus
from florence_bt.trees.ascii import ascii_tree
from florence_bt.trees.compile import CompiledTree, compile_mission
from florence_bt.trees.inputs import parse_inputs
from florence_bt.trees.loader import MissionLibrary

MAX_TICKS_AT_ONE_MOMENT = 1000
"""A tree that wakes itself more often without time passing is broken and is failed."""
END_LIMIT_S = 15.0
"""How long skills may take to report their end after their run has ended; longer than a skill's own limit for
the answer to a cancel. A clean-up has all the time that its own skills have."""


class RequestRefused(FlorenceError):
    """A trigger was refused because of what runs now; the message says what would have worked."""


class Executor:
    """Runs missions one at a time.

    Args:
        library: The missions.
        skills: The skills by name; a mission that needs a missing one is refused.
        declarations: What the skills say about themselves.
        clock: Drives everything.
        run_ids: Names the runs.
        call_soon: Runs a callback on the executor's thread after the current one has returned.

    Attributes:
        current: The run that is not over yet, or None.
        last: The run that ended last, or None.
        blocked_by: Why no mission may start, or None.
        on_tick: Called with the run after each tick.
    """

    def __init__(
        self,
        library: MissionLibrary,
        skills: Mapping[str, Skill],
        declarations: Mapping[str, SkillDeclaration],
        clock: Clock,
        run_ids: RunIds,
        call_soon: Callable[[Callable[[], None]], object] | None = None,
    ) -> None:
        self.library = library
        self.current: MissionRun | None = None
        self.last: MissionRun | None = None
        self.blocked_by: str | None = None
        self.on_tick: Callable[[MissionRun], None] = lambda run: None
        self._skills = skills
        self._declarations = declarations
        self._clock = clock
        self._run_ids = run_ids
        self._call_soon = call_soon or (lambda callback: clock.call_at(clock.now(), callback))
        self._listeners: list[Callable[[MissionRun, Event], None]] = []
        self._waiting: deque[MissionRun] = deque()
        self._context: TreeContext | None = None
        self._tree: CompiledTree | None = None
        self._known: dict[Any, Status] = {}
        self._end: tuple[RunStatus, Why | None] | None = None
        self._end_limit: Timer | None = None
        self._wake_asked = False
        self._ticks_now = 0
        self._ticks_moment = -1.0

    def add_listener(self, listener: Callable[[MissionRun, Event], None]) -> None:
        """Call back with the run at every event: the journal, the topics, the live view."""
        self._listeners.append(listener)

    # ---- triggers -------------------------------------------------------------------------------------

    def trigger(self, request: Request) -> MissionRun:
        """Start, queue or refuse a mission.

        Returns:
            The new run, running or queued. Its first tick comes right after this call, not inside it.

        Raises:
            ConfigError: Unknown mission, one with errors, or bad inputs; the message says what would have
                worked.
            RequestRefused: Another mission runs, or triggers are blocked.
        """
        mission = self.library.get(request.mission)
        inputs = parse_inputs(mission, request.inputs)
        decision = decide(request, self.current, self.blocked_by)
        if decision.verdict is Verdict.REJECT:
            raise RequestRefused(decision.reason)
        run = MissionRun(self._run_ids.next(request.mission), request, inputs)
        # A run that has to wait is built once more when its turn comes: what is wrong is said to the caller.
        prepared = self._prepare(run)
        if self.current is None:
            self._begin(run, *prepared)
            return run
        if decision.verdict is Verdict.PREEMPT:
            self._waiting.appendleft(run)
            self._emit(run, EventKind.QUEUED, reason=decision.reason)
            self.stop(f"preempted by {run.run_id} ({request.caller})")
        else:
            self._enqueue(run)
            self._emit(run, EventKind.QUEUED, reason=decision.reason)
        return run

    def stop(self, reason: str, run_id: str | None = None) -> MissionRun | None:
        """Stop the current run, or the one with this id (queued ones too).

        Returns:
            The run that is being stopped, None when there was nothing to stop.
        """
        for waiting in tuple(self._waiting):
            if run_id == waiting.run_id:
                self._waiting.remove(waiting)
                self._close(waiting, RunStatus.STOPPED, Why(waiting.mission, "stopped", reason))
                return waiting
        run = self.current
        if run is None or (run_id is not None and run_id != run.run_id):
            return None
        if run.status is RunStatus.RUNNING:
            self._emit(run, EventKind.STOP_ASKED, reason=reason)
            tip = self.tip()
            at = Why(run.mission, "stopped", f"{reason} (was at {tip!r})" if tip else reason)
            self._end_tree(RunStatus.STOPPED, at)
        return run

    def stop_all(self, reason: str) -> None:
        """Stop the current run and drop every queued one."""
        while self._waiting:
            self._close(self._waiting.popleft(), RunStatus.STOPPED, Why("queue", "stopped", reason))
        self.stop(reason)

    def abandon(self, reason: str) -> None:
        """Stop everything and do not wait for the ends of the skills: for the end of the process."""
        self.stop_all(reason)
        run = self.current
        if run is not None:
            assert self._context is not None
            self._end_anyway(run, [entry.skill for entry in self._context.runs])

    def find(self, run_id: str | None = None) -> MissionRun | None:
        """The run with this id among the current, the queued and the last one; without an id the current
        run or else the last one.
        """
        candidates = [self.current, *self._waiting, self.last]
        for run in candidates:
            if run is not None and run_id in (None, "", run.run_id):
                return run
        return None

    def render(self, run: MissionRun, *, colour: bool = False) -> str:
        """The ASCII tree of a run: live for the current one, as recorded for others."""
        if run is self.current and self._tree is not None and run.status is RunStatus.RUNNING:
            return ascii_tree(self._tree.root, colour=colour, visited_only=False)
        return run.tree

    def tip(self) -> str:
        """The name of the node that the current run waits for, empty when nothing runs."""
        tip = self._tree.root.tip() if self._tree is not None else None
        return tip.name if tip is not None else ""

    # ---- ticking --------------------------------------------------------------------------------------

    def wake(self) -> None:
        """Ask for a tick; any number of calls before the tick count as one."""
        if not self._wake_asked:
            self._wake_asked = True
            self._call_soon(self._on_wake)

    def _prepare(self, run: MissionRun) -> tuple[TreeContext, CompiledTree]:
        """Build what a run works with; starts nothing."""
        context = TreeContext(
            clock=self._clock,
            keys=KeyStore(),
            wake=self.wake,
            skills=self._skills,
            declarations=self._declarations,
            on_skill_started=lambda path, skill, inputs: self._emit(
                run, EventKind.SKILL_STARTED, node=path, skill=skill, inputs=dict(inputs)
            ),
            on_skill_ended=lambda path, skill, result: self._on_skill_ended(run, path, skill, result),
        )
        return context, compile_mission(self.library.get(run.mission), self.library, run.inputs, context)

    def _begin(self, run: MissionRun, context: TreeContext, tree: CompiledTree) -> None:
        self.current = run
        run.status = RunStatus.RUNNING
        run.started = self._clock.now()
        self._known = {}
        self._end = None
        self._context, self._tree = context, tree
        self._emit(run, EventKind.STARTED, inputs=dict(run.inputs), caller=run.request.caller)
        self.wake()

    def _on_wake(self) -> None:
        self._wake_asked = False
        run = self.current
        if run is None:
            return
        if run.status is RunStatus.RUNNING:
            self._tick(run)
        if run.status is RunStatus.ENDING:
            self._finish_if_drained(run)

    def _tick(self, run: MissionRun) -> None:
        assert self._tree is not None
        root = self._tree.root
        if self._spins():
            self._end_tree(
                RunStatus.FAILED, Why(root.name, "spinning", "the tree wakes itself without time passing")
            )
            return
        try:
            root.tick_once()
        except Exception as error:
            # A bug in a behaviour or a skill must not take the mission server, and its stop service, away.
            self._emit_broken(run, error)
            why = Why(root.name, "internal_error", f"{type(error).__name__}: {error}")
            self._end_tree(RunStatus.FAILED, why)
            return
        run.ticks += 1
        self._emit_node_changes(run, root)
        self.on_tick(run)
        if root.status is Status.SUCCESS:
            run.outputs = self._tree.outputs()
            self._end_tree(RunStatus.SUCCEEDED, None)
        elif root.status is Status.FAILURE:
            self._end_tree(RunStatus.FAILED, explain(root))

    def _spins(self) -> bool:
        now = self._clock.now()
        self._ticks_now = self._ticks_now + 1 if now == self._ticks_moment else 1
        self._ticks_moment = now
        return self._ticks_now > MAX_TICKS_AT_ONE_MOMENT

    def _emit_node_changes(self, run: MissionRun, root: py_trees.behaviour.Behaviour) -> None:
        for change in node_changes(root, self._known):
            self._emit(run, EventKind.NODE, **change)

    def _end_tree(self, status: RunStatus, why: Why | None) -> None:
        run, tree = self.current, self._tree
        assert run is not None and tree is not None
        # The picture of the tree is taken before its nodes forget where they stood.
        run.tree = ascii_tree(tree.root, colour=False, visited_only=False)
        run.status = RunStatus.ENDING
        self._end = (status, why)
        self._limit_end(run)
        try:
            tree.root.stop(Status.INVALID)
        except Exception as error:
            # As in a tick; the other skills are still waited for.
            self._emit_broken(run, error)
        self.wake()

    def _limit_end(self, run: MissionRun) -> None:
        self._end_limit = self._clock.call_at(self._clock.now() + END_LIMIT_S, lambda: self._end_late(run))

    def _finish_if_drained(self, run: MissionRun) -> None:
        """A run is over when every skill it started has ended too: no goal is left behind."""
        assert self._end is not None
        if not self._open_skills(run):
            self._finish(run, *self._end)

    def _open_skills(self, run: MissionRun) -> list[str]:
        """The names of the skills that have not reported their end; one that breaks when asked is over."""
        context = self._context
        assert context is not None
        for entry in tuple(context.runs):
            try:
                context.poll(entry)
            except Exception as error:
                context.runs.remove(entry)
                self._emit_broken(run, error)
        return [entry.skill for entry in context.runs]

    def _end_late(self, run: MissionRun) -> None:
        """The skills had their time."""
        if run is not self.current:
            return
        skills = self._open_skills(run)
        if CLEANUP in skills:
            self._limit_end(run)
        else:
            self._end_anyway(run, skills)

    def _end_anyway(self, run: MissionRun, skills: list[str]) -> None:
        """End a run although some skills have not reported their end; the reason names them."""
        assert self._end is not None
        status, why = self._end
        if skills:
            silent = f"not known to have ended: {', '.join(dict.fromkeys(skills))}"
            if status is RunStatus.SUCCEEDED:
                status, why = RunStatus.FAILED, Why(run.mission, "timed_out", silent)
            elif why is not None:
                why = replace(why, reason=f"{why.reason}; {silent}")
        self._finish(run, status, why)

    def _finish(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        if self._end_limit is not None:
            self._end_limit.cancel()
            self._end_limit = None
        self._context = self._tree = None
        self.current = None
        self.last = run
        self._close(run, status, why)
        if self._waiting and self.current is None:
            waiting = self._waiting.popleft()
            self._begin(waiting, *self._prepare(waiting))

    def _close(self, run: MissionRun, status: RunStatus, why: Why | None) -> None:
        run.status = status
        run.why = why
        run.ended = self._clock.now()
        self._emit(
            run,
            EventKind.ENDED,
            status=status.value,
            code=run.code,
            reason=run.reason,
            cause=why.path if why else "",
            duration=seconds_text(run.started, run.ended),
        )

    def _enqueue(self, run: MissionRun) -> None:
        """Queue behind everything of the same or a higher priority."""
        for index, waiting in enumerate(self._waiting):
            if run.request.priority > waiting.request.priority:
                self._waiting.insert(index, run)
                return
        self._waiting.append(run)

    def _on_skill_ended(self, run: MissionRun, path: str, skill: str, result: Result) -> None:
        self._emit(
            run,
            EventKind.SKILL_ENDED,
            node=path,
            skill=skill,
            outcome=result.outcome.value,
            code=result.code,
            reason=result.reason,
            outputs=dict(result.outputs),
        )
        # In a run that is ending, the last skill's end is what the executor waits for.
        self.wake()

    def _emit_broken(self, run: MissionRun, error: Exception) -> None:
        self._emit(run, EventKind.BROKEN, detail="".join(traceback.format_exception(error)))

    def _emit(self, run: MissionRun, kind: EventKind, **data: Any) -> None:
        if run.status.final and kind is not EventKind.ENDED:
            return  # a skill that reports its end after its run was closed without it
        event = Event(self._clock.now(), run.run_id, kind, data)
        for listener in tuple(self._listeners):
            listener(run, event)
