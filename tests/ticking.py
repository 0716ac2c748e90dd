"""Ticks trees on a manual clock, as an executor would: only when something happened."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.skill import Skill

MAX_TICKS = 10_000
"""More ticks than any tree of a test needs."""


class Wake:
    """Remembers that a tick was asked for."""

    def __init__(self) -> None:
        self.asked = False

    def __call__(self) -> None:
        """Ask."""
        self.asked = True

    def take(self) -> bool:
        """Whether a tick was asked for since the last call."""
        asked, self.asked = self.asked, False
        return asked


def make_context(
    clock: ManualClock,
    skills: Mapping[str, Skill] | None = None,
    declarations: Mapping[str, SkillDeclaration] | None = None,
    keys: Mapping[str, Any] | None = None,
    **hooks: Any,
) -> TreeContext:
    """A context whose wake is a :class:`Wake`.

    Args:
        clock: The clock that :func:`tick_until` will move.
        skills: The skills by name.
        declarations: What they say about themselves.
        keys: Keys that have a value from the start.
        **hooks: ``on_skill_started`` and ``on_skill_ended`` of the context.
    """
    return TreeContext(
        clock=clock,
        wake=Wake(),
        skills=skills or {},
        declarations=declarations or {},
        keys=KeyStore(keys),
        **hooks,
    )


def tick_until(
    root: Behaviour, clock: ManualClock, context: TreeContext, done: Callable[[], bool] | None = None
) -> int:
    """Tick a tree until it has finished, nothing can wake it any more, or a condition holds.

    Args:
        root: The tree.
        clock: The clock of the context; it is moved from event to event.
        context: A context of :func:`make_context`.
        done: Looked at after each tick and each event of the clock; ends the ticking early.

    Returns:
        How many ticks it took.

    Raises:
        AssertionError: The tree did not finish within :data:`MAX_TICKS` ticks.
    """
    wake = context.wake
    if not isinstance(wake, Wake):
        raise TypeError("tick_until needs a context of make_context")
    for ticks in range(1, MAX_TICKS + 1):
        wake.take()
        context.tick_beside()
        root.tick_once()
        if root.status is not Status.RUNNING or (done is not None and done()):
            return ticks
        while not wake.asked:
            if not clock.run_next() or (done is not None and done()):
                return ticks
    raise AssertionError(f"{root.name} did not finish within {MAX_TICKS} ticks")


def drain(clock: ManualClock, context: TreeContext) -> None:
    """Move the clock until no run is left, as an executor does after a stop.

    Raises:
        AssertionError: A run is left that nothing will end.
    """
    while context.runs:
        if not clock.run_next():
            raise AssertionError(f"runs that never end: {[run.path for run in context.runs]}")
        context.tick_beside()
