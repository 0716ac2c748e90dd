"""What every node of one run's tree shares: the clock, the keys, the skills and the runs still going on.

The executor builds one :class:`TreeContext` per run. A called mission works on the same context with keys
of its own (:meth:`TreeContext.with_keys`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Skill, SkillRun

StartedHook = Callable[[str, str, Mapping[str, Any]], None]
"""Called with the path of the node, the name of the skill and its inputs."""
EndedHook = Callable[[str, str, Result], None]
"""Called with the path of the node, the name of the skill and the result of its run."""


def _ignore(*_: Any) -> None:
    """Nobody wants to know."""


@dataclass(eq=False, slots=True)
class OpenRun:
    """A run of a skill that was started and has not reported its end.

    Attributes:
        path: The path of the node that started it.
        skill: The name of the skill (or of the clean-up).
        run: The run itself.
        left: Whether the node that started it looks at it no more; the context then notes its end by itself.
    """

    path: str
    skill: str
    run: SkillRun
    left: bool = False


@dataclass(frozen=True)
class TreeContext:
    """What the nodes of one run's tree share.

    Attributes:
        clock: The clock of every time-out, pause and deadline.
        wake: Asks the executor for a tick; when called during a tick, for one more.
        skills: The skills of this robot by name.
        declarations: What the skills say about themselves, by name.
        keys: The keys of the mission call that a node belongs to.
        runs: Every run that has not reported its end, also those that were cancelled. A mission is over when
            its tree has finished or was stopped and this list is empty.
        on_skill_started: Called when a run begins.
        on_skill_ended: Called once when a run has reported its end, also after a cancel; by then the run has
            left ``runs``.
    """

    clock: Clock
    wake: Callable[[], None]
    skills: Mapping[str, Skill]
    declarations: Mapping[str, SkillDeclaration]
    keys: KeyStore = field(default_factory=KeyStore)
    runs: list[OpenRun] = field(default_factory=list)
    on_skill_started: StartedHook = _ignore
    on_skill_ended: EndedHook = _ignore

    def with_keys(self, keys: KeyStore) -> TreeContext:
        """The same context for a called mission, which has its own keys."""
        return replace(self, keys=keys)

    def start(self, path: str, skill: str, inputs: Mapping[str, Any]) -> OpenRun:
        """Start a skill and keep its run until it reports its end.

        Args:
            path: The path of the node that wants it.
            skill: The name of the skill, one of :attr:`skills`.
            inputs: The complete inputs in SI units, already checked.
        """
        self.on_skill_started(path, skill, inputs)
        return self.adopt(path, skill, self.skills[skill].start(inputs))

    def adopt(self, path: str, skill: str, run: SkillRun) -> OpenRun:
        """Keep a run that was started elsewhere, until it reports its end."""
        entry = OpenRun(path, skill, run)
        self.runs.append(entry)
        run.on_change(lambda: self._on_change(entry))
        return entry

    def poll(self, entry: OpenRun) -> Result | None:
        """The result of a run, or None; the first time there is one the run is no longer kept."""
        result = entry.run.poll()
        if result is not None and entry in self.runs:
            self.runs.remove(entry)
            self.on_skill_ended(entry.path, entry.skill, result)
        return result

    def leave(self, entry: OpenRun) -> None:
        """Cancel a run that no node will look at any more, and wait for its end in the background."""
        entry.left = True
        entry.run.cancel()
        self.poll(entry)

    def _on_change(self, entry: OpenRun) -> None:
        if entry.left:
            self.poll(entry)
        self.wake()
