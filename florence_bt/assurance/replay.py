"""Plays a way through a mission once more, with times: what follows what, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from florence_bt.assurance.events import Happening
from florence_bt.assurance.explorer import Edge
from florence_bt.assurance.unknown import Atom
from florence_bt.assurance.verifier import Explored
from florence_bt.assurance.world import JUST_BEFORE_S, World
from florence_bt.core.clock import ManualTimer
from florence_bt.core.outcome import Result

A_MOMENT_S = 0.1
"""How long a skill takes whose time makes no difference."""


@dataclass(slots=True)
class Call:
    """A run of a skill on a way.

    Attributes:
        path: The node that started it.
        skill: The skill.
        began: When it began, seconds from the start of the mission.
        inputs: What it was given.
        ended: When it ended; None: it did not.
        result: How it ended; None also when it was cancelled.
    """

    path: str
    skill: str
    began: float
    inputs: Any
    ended: float | None = None
    result: Result | None = None


@dataclass(slots=True)
class Replayed:
    """A way through a mission with times.

    Attributes:
        lines: When what happened.
        calls: The runs of skills, in order.
        decided: What was decided about values on the way.
        stops: When somebody stopped it or took the robot over, and which of the two.
        inputs: The inputs of the mission.
        seconds: When the way ends.
    """

    lines: list[tuple[float, Happening]] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    decided: dict[Atom, bool] = field(default_factory=dict)
    stops: list[tuple[float, str]] = field(default_factory=list)
    inputs: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0

    def note(self, when: float, each: Happening) -> None:
        """Note what happened, and when."""
        self.lines.append((when, each))
        if each.what == "start":
            self.calls.append(Call(each.path, each.skill, when, each.inputs))
        elif each.what == "end":
            call = next((c for c in reversed(self.calls) if c.path == each.path and c.ended is None), None)
            if call is not None:
                call.ended = when
                cancelled = each.result is None or each.result.code == "cancelled"
                call.result = None if cancelled else each.result
        elif each.what in ("stop", "override"):
            self.stops.append((when, each.what))


def replay(explored: Explored, way: Sequence[Edge], *, slow: bool = False) -> Replayed:
    """Play a way through a mission that was explored.

    Args:
        explored: The mission.
        way: The way.
        slow: Whether skills whose time makes no difference take as long as they may, instead of a moment.
    """
    return _Replay(explored.world, slow).play(explored, way)


class _Replay:
    """One replay.

    The clock of the world stands still for timers that are open: what they take is added here.
    """

    def __init__(self, world: World, slow: bool) -> None:
        self._world = world
        self._slow = slow
        self._ahead = 0.0
        self._opened: dict[ManualTimer, float] = {}
        self._played = Replayed()

    @property
    def _now(self) -> float:
        return round(self._world.clock.now() + self._ahead, 3)

    def play(self, explored: Explored, way: Sequence[Edge]) -> Replayed:
        """Play it."""
        world, played = self._world, self._played
        explored.start.restore()
        for edge in way:
            self._let_pass(edge)
            world.happened.clear()
            world.choices.begin(edge.path)
            before = dict(world.facts.decided)
            world.do(edge.event)
            played.decided.update(before)
            played.decided.update(world.facts.decided)
            for each in world.happened:
                played.note(self._now, each)
            for timer in world.clock.still_open():
                self._opened.setdefault(timer, self._now)
            if edge.event.what == "begin":
                played.inputs = {name: world.tree.keys.read(name) for name in world.mission.inputs}
        played.seconds = self._now
        return played

    def _let_pass(self, edge: Edge) -> None:
        """Let the time pass in which nothing happens before a step."""
        clock, event = self._world.clock, edge.event
        if event.what == "expire":
            timer, seconds = list(clock.still_open().items())[event.timer]
            due = self._opened.get(timer, self._now) + seconds
            self._ahead = max(self._ahead, due - clock.now())
        elif event.what in ("end", "pause", "stop", "override") and not event.late:
            due_next = clock.next_due()
            left = A_MOMENT_S if due_next is None else min(A_MOMENT_S, (due_next - clock.now()) / 2.0)
            if self._slow and edge.seconds > left:
                left = edge.seconds - JUST_BEFORE_S if due_next is not None else left
                self._ahead += edge.seconds if due_next is None else 0.0
            clock.advance_to(clock.now() + left)
