"""The tree of one run, from its first tick to the end of the last skill that it started.

A :class:`TreeRun` ticks, pauses and ends the tree; which run comes next is the executor's business.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.cleaning_up import CLEANUP
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import Why, explain, path_of, remember_failure
from florence_bt.core.clock import Clock, Timer
from florence_bt.core.outcome import Result
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.runtime.run_clock import RunClock
from florence_bt.runtime.run_environment import RunEnvironment, keep_off_the_base
from florence_bt.trees.drawings.ascii import LastStatus, TreeRow, draw_rows, tree_rows
from florence_bt.trees.language.compile import CompiledTree, compile_mission
from florence_bt.trees.language.vocabulary import MAX_QUICK_ROUNDS

END_LIMIT_S = 15.0
"""Limit for skills to report their end after their run has ended or was paused; longer than a skill's own
limit for the answer to a cancel. A clean-up has all the time that its own skills have."""


class TreeRun:
    """Ticks the tree of a run. Building one starts nothing.

    Args:
        run: The run; its status is kept up to date.
        environment: What it works with.
        on_tick: Called with the run after each tick.
        on_over: Called once, when nothing of the run is left, with how it ended.

    Raises:
        ConfigError: The mission, or one that it calls, has an error.
    """

    def __init__(
        self,
        run: MissionRun,
        environment: RunEnvironment,
        on_tick: Callable[[MissionRun], None],
        on_over: Callable[[MissionRun, RunStatus, Why | None], None],
    ) -> None:
        self.run = run
        self.clock = RunClock(environment.clock)
        self._environment = environment
        self._skills = dict(environment.skills)
        self._asked_again: set[str] = set()
        self.on_tick = on_tick
        self.on_over = on_over
        self._context = TreeContext(
            clock=self.clock,
            keys=KeyStore(),
            wake=self._wake,
            skills=self._skills,
            declarations=environment.declarations,
            on_skill_started=self._on_skill_started,
            on_asked_again=self._asked_again.add,
            on_skill_ended=self._on_skill_ended,
            later=self._after_tick,
        )
        self.tree: CompiledTree = compile_mission(
            environment.library.get(run.mission),
            environment.library,
            run.inputs,
            self._context,
            as_reached=True,
        )
        self._ticks = TreeTicks(self.root, self.clock)
        self._end: tuple[RunStatus, Why | None] | None = None
        self._limit: Timer | None = None
        self._held: list[Callable[[], None]] | None = None
        self._tick_began: float | None = None
        self._resume_wanted = False
        self._resume_kind = EventKind.RESUMED

    @property
    def root(self) -> Behaviour:
        """The root of the tree."""
        return self.tree.root

    def tip(self) -> str:
        """Return the name of the node that the run waits for, empty when there is none."""
        tip = self.root.tip()
        return tip.name if tip is not None else ""

    def move_to(self, environment: RunEnvironment) -> None:
        """Go on in another environment, after a replay in the real one. The run is paused and stays so."""
        self._environment = environment
        self._skills.clear()
        self._skills.update(environment.skills)
        self.clock.move_to(environment.clock)

    def step(self, *, by_itself: bool = False) -> None:
        """Do what there is to do now: something woke the run.

        Args:
            by_itself: Whether that was the step before, and nothing outside the tree.
        """
        if self.run.status is not RunStatus.PAUSED:
            self._ticks.note(self._environment.clock.now(), by_itself=by_itself)
            self._tick()
        elif self._resume_wanted:
            self._resume_when_drained()
        self.finish_if_drained()

    # ---- ticking --------------------------------------------------------------------------------------

    def _tick(self) -> None:
        """Tick the clean-ups beside the tree, and the tree unless it has ended."""
        goes_on = self.run.status is RunStatus.RUNNING
        if not goes_on and not self._context.beside:
            return
        if self._ticks.count > MAX_QUICK_ROUNDS:
            self._end_spinning()
            return
        self.run.ticks += 1
        self._held = []
        self._tick_began = self._environment.clock.now()
        try:
            self._context.tick_beside()
            if goes_on:
                self._ticks.tick(self._environment.breakpoints.gate())
        except Exception as error:
            # A bug in a behaviour or a skill must not take the mission server, and its stop service, away.
            self._break_down(error)
            self._tick_began = None
            return
        finally:
            self._do_held()
            self._held = None
        if goes_on:
            self._tell_held()
            self._after_main_tick()
        self._tick_began = None
        if goes_on:
            self._stand_at_breakpoint()

    def _tell_held(self) -> None:
        if self._ticks.held:
            paths = list(map(path_of, self._ticks.held))
            self._publish(EventKind.HELD, nodes=paths)

    def _stand_at_breakpoint(self) -> None:
        """Pause a run when the tick has come to a node that is not to be started yet, and has not left it."""
        breakpoints = self._environment.breakpoints
        waiting = [node for node in self._ticks.held if node.status is Status.RUNNING]
        # A replay is paused when its journal says so.
        if waiting and self.run.status is RunStatus.RUNNING and not breakpoints.paths:
            breakpoints.stepping = False
            names = " and ".join(repr(node.name) for node in waiting)
            self.pause(f"a breakpoint before {names}")

    def _after_main_tick(self) -> None:
        """Publish what the tick has changed, and end with the tree."""
        root = self.root
        for change in self._ticks.changes():
            self._publish(EventKind.NODE, **change)
        self.on_tick(self.run)
        if root.status is Status.SUCCESS:
            self.run.outputs = self.tree.outputs()
            self.run.output_texts = self.tree.output_texts()
            self.end(RunStatus.SUCCEEDED, None)
        elif root.status is Status.FAILURE:
            self.end(RunStatus.FAILED, explain(root))

    def _end_spinning(self) -> None:
        """End a tree that goes on without time passing, or the clean-ups that do when it has ended."""
        if self.run.status is RunStatus.RUNNING:
            self.end(RunStatus.FAILED, _spinning(self.root))
            return
        for cleanup in tuple(self._context.beside):
            why = _spinning(cleanup.tree)
            cleanup.break_off(why.code, why.reason)

    def _after_tick(self, callback: Callable[[], None]) -> None:
        """Do what is not urgent when the tick is over, now when none goes on: the next skill starts first."""
        if self._held is None:
            callback()
        else:
            self._held.append(callback)

    def _do_held(self) -> None:
        if self._held:
            self._environment.yield_cpu()
        while self._held:
            held, self._held = self._held, []
            for callback in held:
                callback()

    # ---- pausing --------------------------------------------------------------------------------------

    def pause(self, reason: str) -> None:
        """Stop the robot and the time of a running run, or take the resume of a paused one back.

        A run that stays paused keeps its first reason.
        """
        run = self.run
        self._do_held()
        if run.status is RunStatus.PAUSED:
            self._stay_paused(reason)
            return
        run.paused = reason
        run.status = RunStatus.PAUSED
        self.clock.freeze()
        # The log first, so that it shows which skills ended because of the pause.
        with self._environment.event_bus.publishing(run, EventKind.PAUSED, reason=reason, tip=self.tip()):
            try:
                self._context.suspend()
            except Exception as error:
                self._break_down(error)

    def _stay_paused(self, reason: str) -> None:
        if not self._resume_wanted:
            return
        self._resume_wanted = False
        self._cancel_limit()
        self.run.paused = reason
        self._environment.event_bus.publish(self.run, EventKind.PAUSED, reason=reason, tip=self.tip())

    def resume(self, kind: EventKind = EventKind.RESUMED) -> None:
        """Go on as soon as the skills that were cancelled for the pause have reported their ends.

        Args:
            kind: The event that is published.
        """
        self._resume_kind = kind
        self._resume_wanted = True
        self._cancel_limit()
        self._limit = self._environment.clock.call_at(
            self._environment.clock.now() + END_LIMIT_S, self._resume_late
        )
        self._resume_when_drained()

    def _resume_when_drained(self) -> None:
        if not self._context.still_ending():
            self._go_on()

    def _resume_late(self) -> None:
        """End a run whose skills had their time to stop: without their ends they cannot be started again."""
        silent = ", ".join(dict.fromkeys(entry.skill for entry in self._context.still_ending()))
        reason = f"after the pause: not known to have ended: {silent}"
        self.end(RunStatus.FAILED, Why(self.run.mission, "timed_out", reason))

    def _go_on(self) -> None:
        self._resume_wanted = False
        self._cancel_limit()
        # After a crash: a run of which only clean-ups were left ends with them, and begins nothing else.
        ending = self._end is not None
        self.run.status = RunStatus.ENDING if ending else RunStatus.RUNNING
        self.run.paused = ""
        if ending:
            self._limit_end()
        self._environment.event_bus.publish(self.run, self._resume_kind)
        self.clock.thaw()
        try:
            self._context.resume()
        except Exception as error:
            self._break_down(error)
            return
        self._environment.wake()

    # ---- ending ---------------------------------------------------------------------------------------

    def stop(self, reason: str) -> None:
        """Stop the run; harmless when it ends already."""
        run = self.run
        if run.status is RunStatus.ENDING:
            return
        self._do_held()
        tip = self.tip()
        at = Why(run.mission, "stopped", f"{reason} (was at {tip!r})" if tip else reason)
        with self._environment.event_bus.publishing(run, EventKind.STOP_ASKED, reason=reason):
            self.end(RunStatus.STOPPED, at)

    def keep_off(self, reason: str) -> None:
        """Drive no more: a person has the robot. The rest of the clean-ups goes on; call it before a stop."""
        event_bus = self._environment.event_bus
        with event_bus.publishing(self.run, EventKind.OVERRIDDEN, reason=reason):
            keep_off_the_base(
                self._skills,
                self._environment.declarations,
                self._context.runs,
                reason,
                partial(event_bus.publish_error, self.run),
            )

    def end(self, status: RunStatus, why: Why | None) -> None:
        """End the tree; the run is over when every skill has reported its end.

        Args:
            status: How the run ends.
            why: The cause when it was no success.
        """
        self.run.status = RunStatus.ENDING
        self.run.paused = ""
        self._end = (status, why)
        self._resume_wanted = False
        self._context.pause.active = False
        self._limit_end()
        self._stop_tree()
        # Clean-ups need time, also after a pause.
        self.clock.thaw()
        self._resume_cleanups()
        self._environment.wake()

    def rows(self) -> tuple[TreeRow, ...]:
        """Return the tree as it is now, to be drawn."""
        return tree_rows(self.root, self._ticks.seconds, self._ticks.left)

    def abandon(self) -> None:
        """End at once, without waiting for the ends of the skills: the process goes down."""
        self._end_anyway([entry.skill for entry in self._context.runs])

    def _break_down(self, error: Exception) -> None:
        self._do_held()
        self._environment.event_bus.publish_error(self.run, error)
        why = Why(self.root.name, "internal_error", f"{type(error).__name__}: {error}")
        self.end(RunStatus.FAILED, why)

    def _stop_tree(self) -> None:
        self._ticks.let_go()
        self._ticks.note_end()
        try:
            self.root.stop(Status.INVALID)
        except Exception as error:
            # As in a tick. What the nodes did not get to cancel is cancelled here; then all are waited for.
            self._environment.event_bus.publish_error(self.run, error)
            for entry in tuple(self._context.runs):
                if not entry.left and entry.inputs is not None:
                    self._leave(entry)

    def _resume_cleanups(self) -> None:
        """Let the skills of clean-ups that a pause has cancelled start again; all others were left."""
        try:
            self._context.resume()
        except Exception as error:
            self._environment.event_bus.publish_error(self.run, error)

    def _leave(self, entry: Any) -> None:
        try:
            self._context.leave(entry)
        except Exception as error:
            self._environment.event_bus.publish_error(self.run, error)

    def _limit_end(self) -> None:
        self._cancel_limit()
        clock = self._environment.clock
        self._limit = clock.call_at(clock.now() + END_LIMIT_S, self._end_late)

    def _cancel_limit(self) -> None:
        if self._limit is not None:
            self._limit.cancel()
            self._limit = None

    def finish_if_drained(self) -> None:
        """Finish a run that ends, when every skill it started has ended too: no goal is left behind."""
        if self.run.status is RunStatus.ENDING and not self._open_skills():
            assert self._end is not None
            self._finish(*self._end)

    def _open_skills(self) -> list[str]:
        """Return the skills that have not reported their end; one that breaks when asked is over."""
        context = self._context
        for entry in tuple(context.runs):
            try:
                context.poll(entry)
            except Exception as error:
                context.drop(entry)
                self._environment.event_bus.publish_error(self.run, error)
        return [entry.skill for entry in context.runs]

    def _end_late(self) -> None:
        """End a run whose skills had their time."""
        skills = self._open_skills()
        if CLEANUP in skills and not self._context.still_ending():
            self._limit_end()
        else:
            self._end_anyway(skills)

    def _end_anyway(self, skills: list[str]) -> None:
        """End a run although some skills have not reported their end; the reason names them."""
        assert self._end is not None
        status, why = self._end
        if skills:
            silent = f"not known to have ended: {', '.join(dict.fromkeys(skills))}"
            if status is RunStatus.SUCCEEDED:
                status, why = RunStatus.FAILED, Why(self.run.mission, "timed_out", silent)
            elif why is not None:
                why = replace(why, reason=f"{why.reason}; {silent}")
        self._finish(status, why)

    def _finish(self, status: RunStatus, why: Why | None) -> None:
        self._cancel_limit()
        # What still runs now, such as a clean-up of a process that ends, is left.
        self.run.rows = tuple([row._replace(left=True) if row.running else row for row in self.rows()])
        self.run.tree = draw_rows(self.run.rows)
        self.on_over(self.run, status, why)

    def _publish(self, kind: EventKind, **data: Any) -> None:
        """Publish what a tick has brought about, or what happened between two ticks."""
        self._environment.event_bus.publish(self.run, kind, since=self._tick_began, **data)

    # ---- skills ---------------------------------------------------------------------------------------

    def _wake(self) -> None:
        self._environment.wake()

    def _on_skill_started(self, path: str, skill: str, inputs: Mapping[str, Any]) -> None:
        again = path in self._asked_again
        self._asked_again.discard(path)
        self._after_tick(partial(self._publish_started, path, skill, inputs, again))

    def _on_skill_ended(self, path: str, skill: str, result: Result) -> None:
        more = {"paused": self._context.pause.active, "between_ticks": self._held is None}
        flags = {name: True for name, holds in more.items() if holds}
        self._after_tick(partial(self._publish_ended, path, skill, result, flags))

    def _publish_started(self, path: str, skill: str, inputs: Mapping[str, Any], again: bool) -> None:
        more = {"again": True} if again else {}
        self._publish(EventKind.SKILL_STARTED, node=path, skill=skill, inputs=dict(inputs), **more)

    def _publish_ended(self, path: str, skill: str, result: Result, flags: Mapping[str, bool]) -> None:
        self._publish(
            EventKind.SKILL_ENDED,
            node=path,
            skill=skill,
            outcome=result.outcome.value,
            code=result.code,
            reason=result.reason,
            outputs=dict(result.outputs),
            **flags,
        )
        if self.run.status is RunStatus.ENDING:
            # The run is over with the end of its last skill.
            self._environment.wake()


def _spinning(root: Behaviour) -> Why:
    """Return the failure of a tree that goes on without time passing, at the lowest node that runs."""
    node = root
    while child := next((child for child in node.children if child.status is Status.RUNNING), None):
        node = child
    reason = (
        f"{node.name} goes on without end: {MAX_QUICK_ROUNDS} rounds in a row took no time "
        "(a wait, or a skill that takes time, belongs into such a loop)"
    )
    return Why(path_of(node), "spinning", reason)


class TreeTicks:
    """Ticks a tree.

    Args:
        root: The tree.
        clock: The clock of the run: pauses do not count for the nodes.

    Attributes:
        tick: Ticks the tree once.
        let_go: Lets the nodes that were held be what they are: not started.
        count: How many ticks there were in a row for which nothing outside the tree had to happen.
    """

    def __init__(self, root: Behaviour, clock: Clock) -> None:
        self._ticker = Ticker(root, record=True)
        self.tick = self._ticker.tick
        self.let_go = self._ticker.let_go
        self._clock = clock
        self._times: dict[Behaviour, tuple[float, float | None]] = {}
        self._paths: dict[Behaviour, str] = {}
        self._last: dict[Behaviour, tuple[int, LastStatus]] = {}
        self._began: dict[Behaviour, int] = {}
        self.count = 0
        self._moment = -1.0

    @property
    def held(self) -> tuple[Behaviour, ...]:
        """The nodes that the last tick has not started because of a breakpoint."""
        return self._ticker.held

    def note_end(self) -> None:
        """Note where every node stands, before the tree is stopped and its nodes forget it; count anew."""
        self.count = 0
        now, tick = self._clock.now(), self._ticker.count
        known: dict[Behaviour, Why] = {}
        nodes = [self._ticker.root]
        for node in nodes:
            nodes += node.children
            if node.status is not Status.INVALID:
                why = explain(node, known) if node.status is Status.FAILURE else None
                self._last[node] = tick, LastStatus(node.status, node.feedback_message, why)
            if node.status is Status.RUNNING:
                self._note_time(node, Status.INVALID, now)

    def note(self, now: float, *, by_itself: bool) -> None:
        """Count a tick.

        Args:
            now: The moment, on the real clock.
            by_itself: Whether the tick before asked for it.
        """
        self.count = self.count + 1 if by_itself or now == self._moment else 1
        self._moment = now

    def changes(self) -> Iterator[dict[str, str]]:
        """Yield what the last tick changed, in order: the data of events."""
        now = self._clock.now()
        known: dict[Behaviour, Why] = {}
        for node, old, new in self._ticker.changes:
            self._note_time(node, new, now)
            why = explain(node, known) if new is Status.FAILURE else None
            if new is not Status.INVALID:
                remember_failure(node, why)
            self._note_last(node, old, new, why)
            change = {"node": self._path(node), "old": old.name, "new": new.name}
            if why is None:
                change["reason"] = node.feedback_message
            else:
                change.update(code=why.code, reason=why.reason, cause=why.path)
            yield change

    def _path(self, node: Behaviour) -> str:
        path = self._paths.get(node)
        if path is None:
            above = node.parent
            path = node.name if above is None else f"{self._path(above)}/{node.name}"
            self._paths[node] = path
        return path

    def left(self, node: Behaviour) -> LastStatus | None:
        """Return where a node stood that the nodes above it have left; None when they have not reached it.

        A node that begins again has not reached those below it.
        """
        last = self._last.get(node)
        if node.status is not Status.INVALID or last is None:
            return None
        tick, left = last
        above = node.parent
        while above is not None:
            if self._began.get(above, 0) > tick:
                return None
            above = above.parent
        return left

    def seconds(self, node: Behaviour) -> float | None:
        """Return how long a node took, or has been running; None when it was not reached."""
        if node not in self._times or (node.status is Status.INVALID and self.left(node) is None):
            return None
        began, ended = self._times[node]
        return (self._clock.now() if ended is None else ended) - began

    def _note_last(self, node: Behaviour, old: Status, new: Status, why: Why | None) -> None:
        tick = self._ticker.count
        if new is not Status.INVALID:
            self._last[node] = tick, LastStatus(new, node.feedback_message, why)
            if old is not Status.RUNNING:
                self._began[node] = tick
        elif old is Status.RUNNING and node in self._last:
            self._last[node] = self._last[node][0], LastStatus(old, node.feedback_message, None)

    def _note_time(self, node: Behaviour, status: Status, now: float) -> None:
        if status is Status.RUNNING:
            self._times[node] = (now, None)
            return
        began, ended = self._times.get(node, (now, None))
        if status is not Status.INVALID or ended is None:
            self._times[node] = (began if ended is None else now, now)
