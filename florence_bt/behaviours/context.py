"""The context of one run, shared by every node: the clock, the keys, the skills, the runs still going on.

The executor builds one :class:`TreeContext` per run. A called mission works on the same context with keys
of its own (:meth:`TreeContext.with_keys`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.clock import Clock, Timer
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Skill, SkillRun

if TYPE_CHECKING:
    from florence_bt.behaviours.cleaning_up import CleanupRun

StartedHook = Callable[[str, str, Mapping[str, Any]], None]
"""Called with the path of the node, the name of the skill and its inputs."""
EndedHook = Callable[[str, str, Result], None]
"""Called with the path of the node, the name of the skill and the result of its run."""


def _ignore(*_: Any) -> None:
    """Do nothing, as there is no subscriber."""


def _at_once(callback: Callable[[], None]) -> None:
    callback()


@dataclass(eq=False, slots=True)
class OpenRun:
    """A run of a skill that was started and has not reported its end.

    Attributes:
        path: The path of the node that started it.
        skill: The name of the skill (or of the clean-up).
        run: The run itself.
        wake: Asks for a tick of the tree that the node belongs to.
        inputs: What the skill was started with; None for a run that was started elsewhere.
        left: Whether the node that started it was left; the context then records its end by itself.
        late: Whether the skill took longer than its declaration allows.
        suspended: Whether it was cancelled for a pause and will be started again, by its node.
        on_suspend: Called when it was cancelled for a pause, for the node to say so.
        on_resume: Called when the pause is over, for the node to start it again at once or in its next tick.
        end_reported: Whether the end of the cancelled run was reported already.
        deadline: The timer behind ``late``.
        resources: What no other skill may use until this run has ended.
    """

    path: str
    skill: str
    run: SkillRun
    wake: Callable[[], None]
    inputs: Mapping[str, Any] | None = None
    left: bool = False
    late: bool = False
    suspended: bool = False
    on_suspend: Callable[[], object] = _ignore
    on_resume: Callable[[], object] = _ignore
    end_reported: bool = False
    deadline: Timer | None = None
    resources: frozenset[str] = frozenset()


@dataclass(slots=True)
class Pause:
    """The pause of a run; shared by every context of one run.

    Attributes:
        active: No node may be ticked and no skill started.
    """

    active: bool = False


@dataclass(frozen=True)
class TreeContext:
    """The context that the nodes of one run's tree share.

    Attributes:
        clock: The clock of every time-out, pause and deadline.
        wake: Asks the executor for a tick; when called during a tick, for one more.
        skills: The skills of this robot by name.
        declarations: What the skills say about themselves, by name.
        keys: The keys of the mission call that a node belongs to.
        runs: Every run that has not reported its end, also those that were cancelled. A mission is over when
            its tree has finished or was stopped and this list is empty.
        on_skill_started: Called when a run begins.
        on_asked_again: Called with the path of a watched skill that is asked again in the background, before
            its run begins.
        on_skill_ended: Called once when a run has reported its end, also after a cancel; by then the run has
            left ``runs``, unless its node will start another one after a pause.
        pause: Whether the run is paused.
        later: Does what is not urgent: during a tick when it is over, at once otherwise.
        waiting: Called when a run has ended: skills that wait until what they need is free.
        watching: Called when the run goes on after a pause: skills that are watched as conditions.
        beside: The clean-ups that go on beside the tree, each to be ticked with it.
    """

    clock: Clock
    wake: Callable[[], None]
    skills: Mapping[str, Skill]
    declarations: Mapping[str, SkillDeclaration]
    keys: KeyStore = field(default_factory=KeyStore)
    runs: list[OpenRun] = field(default_factory=list)
    on_skill_started: StartedHook = _ignore
    on_asked_again: Callable[[str], None] = _ignore
    on_skill_ended: EndedHook = _ignore
    pause: Pause = field(default_factory=Pause)
    later: Callable[[Callable[[], None]], None] = _at_once
    waiting: list[Callable[[], None]] = field(default_factory=list)
    watching: list[Callable[[], None]] = field(default_factory=list)
    beside: list[CleanupRun] = field(default_factory=list)

    def with_keys(self, keys: KeyStore) -> TreeContext:
        """Return the same context for a called mission, which has its own keys."""
        return replace(self, keys=keys)

    def start(self, path: str, skill: str, inputs: Mapping[str, Any]) -> OpenRun:
        """Start a skill and keep its run until it reports its end.

        Args:
            path: The path of the node that wants it.
            skill: The name of the skill, one of :attr:`skills`.
            inputs: The complete inputs in SI units, already checked.
        """
        entry = self.adopt(path, skill, self._begin(path, skill, inputs))
        entry.inputs = inputs
        entry.resources = self.declarations[skill].resources
        self._limit(entry)
        return entry

    def adopt(self, path: str, skill: str, run: SkillRun) -> OpenRun:
        """Keep a run that was started elsewhere, until it reports its end."""
        entry = OpenRun(path, skill, run, self.wake)
        self.runs.append(entry)
        run.on_change(partial(self._on_change, entry))
        return entry

    def poll(self, entry: OpenRun) -> Result | None:
        """Return the result of a run, or None; the first time there is one the run is no longer kept."""
        result = _result_of(entry)
        if result is not None and entry in self.runs:
            self.runs.remove(entry)
            if entry.deadline is not None:
                self.later(partial(_end_limit, entry))
            self.on_skill_ended(entry.path, entry.skill, result)
            self._call_waiting()
        return result

    def holder(self, skill: str) -> OpenRun | None:
        """Return the run that uses what a skill needs for itself; None when it can start."""
        needed = self.declarations[skill].resources
        for entry in tuple(self.runs) if needed else ():
            free = entry.suspended and entry.end_reported
            # A run whose node was left may have ended without notice.
            if entry.resources & needed and not free and not (entry.left and self.poll(entry) is not None):
                return entry
        return None

    def leave(self, entry: OpenRun) -> None:
        """Cancel the run of a node that is left, and wait for its end in the background."""
        entry.left = True
        _end_limit(entry)
        if entry.suspended and entry.end_reported:
            self.drop(entry)
            return
        entry.suspended = False
        entry.run.cancel()
        self.poll(entry)

    def drop(self, entry: OpenRun) -> None:
        """Forget a run."""
        self.runs.remove(entry)
        _end_limit(entry)
        self._call_waiting()

    def tick_beside(self) -> None:
        """Tick the clean-ups that go on beside the tree."""
        for cleanup in tuple(self.beside):
            cleanup.tick()

    def suspend(self) -> None:
        """Cancel every run that goes on, for a pause; a run that had finished keeps its result."""
        candidates = [
            entry
            for entry in self.runs
            if entry.inputs is not None and not entry.left and not entry.suspended
        ]
        going = [entry for entry in candidates if self.poll(entry) is None]
        self.pause.active = True
        for entry in going:
            entry.suspended = True
            entry.end_reported = False
            _end_limit(entry)
            entry.run.cancel()
            entry.on_suspend()
            self._look_at_suspended(entry)

    def still_ending(self) -> list[OpenRun]:
        """Return the runs that were cancelled for a pause and have not reported their end."""
        return [entry for entry in self.runs if entry.suspended and not entry.end_reported]

    def resume(self) -> None:
        """Let the nodes of the suspended skills start them again; conditions above them are asked first."""
        self.pause.active = False
        for call in tuple(self.watching):
            call()
        for entry in tuple(self.runs):
            if entry.suspended:
                entry.wake()
                entry.on_resume()

    def _call_waiting(self) -> None:
        for call in tuple(self.waiting):
            call()

    def _begin(self, path: str, skill: str, inputs: Mapping[str, Any]) -> SkillRun:
        # A mock of a test may answer differently at different nodes.
        start_at = getattr(self.skills[skill], "start_at", None)
        run: SkillRun = self.skills[skill].start(inputs) if start_at is None else start_at(path, inputs)
        # Reported afterwards: nothing stands between the end of one skill and the start of the next.
        self.on_skill_started(path, skill, inputs)
        return run

    def _limit(self, entry: OpenRun) -> None:
        """Give a run that goes on the time that its skill declares."""
        if self.poll(entry) is None:
            when = self.clock.now() + self.declarations[entry.skill].deadline_s
            entry.deadline = self.clock.call_at(when, lambda: _on_deadline(entry))

    def _on_change(self, entry: OpenRun) -> None:
        if entry.left:
            # No node looks at it any more; who waits for what it holds is called.
            self.poll(entry)
            return
        if entry.suspended:
            self._look_at_suspended(entry)
        entry.wake()

    def _look_at_suspended(self, entry: OpenRun) -> None:
        """Report the end of a run that was cancelled for a pause; one that succeeded after all is done."""
        result = None if entry.end_reported else _result_of(entry)
        if result is None:
            return
        entry.end_reported = True
        if result.succeeded:
            entry.suspended = False
            self.drop(entry)
        self.on_skill_ended(entry.path, entry.skill, result)
        entry.wake()


def _result_of(entry: OpenRun) -> Result | None:
    result = entry.run.poll()
    if result is not None and not isinstance(result, Result):
        raise TypeError(
            f"the skill {entry.skill!r} gave {result!r} as its result, which must be a Result or None"
        )
    return result


def _on_deadline(entry: OpenRun) -> None:
    entry.deadline = None
    entry.late = True
    entry.wake()


def _end_limit(entry: OpenRun) -> None:
    if entry.deadline is not None:
        entry.deadline.cancel()
        entry.deadline = None
