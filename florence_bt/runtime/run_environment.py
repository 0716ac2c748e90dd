"""The environment of every run, and its change when a person takes the robot over."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, MutableMapping
from dataclasses import dataclass

from florence_bt.behaviours.context import OpenRun
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure
from florence_bt.core.skill import InstantSkill, Skill
from florence_bt.runtime.breakpoints import Breakpoints
from florence_bt.runtime.event_bus import EventBus
from florence_bt.trees.language.loader import MissionLibrary

BASE = "base"
"""The resource of the skills that drive."""


def _nothing() -> None:
    """Do nothing: nobody waits for the processor."""


@dataclass(frozen=True, slots=True)
class RunEnvironment:
    """The environment that every run works with.

    Attributes:
        library: The missions.
        skills: The skills by name.
        declarations: What the skills say about themselves.
        clock: Drives everything.
        wake: Asks for :meth:`TreeRun.step` soon.
        event_bus: Tells what happens.
        breakpoints: Before which nodes runs are paused.
        yield_cpu: Called when what is urgent is done, before the rest: processes that got a goal may begin.
    """

    library: MissionLibrary
    skills: Mapping[str, Skill]
    declarations: Mapping[str, SkillDeclaration]
    clock: Clock
    wake: Callable[[], None]
    event_bus: EventBus
    breakpoints: Breakpoints
    yield_cpu: Callable[[], None] = _nothing


def keep_off_the_base(
    skills: MutableMapping[str, Skill],
    declarations: Mapping[str, SkillDeclaration],
    runs: Iterable[OpenRun],
    reason: str,
    on_error: Callable[[Exception], None],
) -> None:
    """Let nothing of a run drive any more, its clean-ups included; what does not drive goes on.

    Args:
        skills: The skills of the run; those that drive are replaced.
        declarations: What the skills say about themselves.
        runs: The runs of skills that have not reported their end; those that drive are cancelled.
        reason: Why, for people.
        on_error: Called when a skill breaks while it is cancelled; the others are cancelled anyway.
    """
    rejecting = InstantSkill(lambda inputs: failure("rejected", reason))
    for name, declaration in declarations.items():
        if BASE in declaration.resources and name in skills:
            skills[name] = rejecting
    for entry in tuple(runs):
        if BASE in entry.resources:
            try:
                entry.run.cancel()
            except Exception as error:
                on_error(error)
