"""Missions that are called: each is explored once for each way of being called, and counts by how it ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from florence_bt.assurance.explorer import Ending, Graph
from florence_bt.assurance.lasting import Effects
from florence_bt.assurance.paths import longest
from florence_bt.assurance.plan import CodeClass, Plan, codes_behind
from florence_bt.assurance.skills import End, OpenEnd
from florence_bt.assurance.snapshot import Unchanging
from florence_bt.assurance.unknown import is_unknown, known_part
from florence_bt.core.clock import Clock
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.trees.language.model import Mission

WayOfCalling = tuple[tuple[str, Any], ...]
"""The inputs that are known and count, by name."""


@dataclass(frozen=True, slots=True)
class Summary:
    """The ways in which a mission can end.

    Attributes:
        ends: The ways, with each code by itself.
        stops: What may last after it was stopped.
        longest: How long it takes at most, in seconds; infinite: as long as it takes.
        complete: Whether all of it was explored.
    """

    ends: tuple[End, ...]
    stops: tuple[Effects, ...]
    longest: float
    complete: bool

    def with_classes(self, classes: Callable[[Iterable[str]], Iterable[CodeClass]]) -> tuple[End, ...]:
        """Return the ways in which it can end, with codes together that a caller does not tell apart."""
        succeeding = [end for end in self.ends if end.code is None]
        by_effects: dict[Effects, set[str]] = {}
        for end in self.ends:
            if end.code is not None:
                by_effects.setdefault(end.effects, set()).add(end.code)
        failing = [End(code, (), effects) for effects, codes in by_effects.items() for code in classes(codes)]
        return (*succeeding, *failing)


def summary_of(mission: Mission, graph: Graph) -> Summary:
    """Sum up how a mission can end that was explored."""
    ends: dict[End, None] = {}
    stops: dict[Effects, None] = {}
    for ending in graph.endings.values():
        effects = _effects(ending)
        if ending.status == "STOPPED":
            stops[effects] = None
        elif ending.status == "SUCCEEDED":
            ends[End(None, _known_outputs(mission, ending), effects)] = None
        else:
            ends.update((End(code, (), effects), None) for code in sorted(codes_behind(ending.code)))
    return Summary(tuple(ends), tuple(stops) or ((),), longest(graph)[0], not graph.unexplored)


def _effects(ending: Ending) -> Effects:
    return tuple(sorted(ending.lasting.items()))


def _known_outputs(mission: Mission, ending: Ending) -> tuple[tuple[str, Any], ...]:
    return tuple(
        (name, ending.outputs[name])
        for name, port in mission.outputs.items()
        if port.kind is Kind.BOOLEAN and name in ending.outputs
    )


class CalledMission(Unchanging):
    """A mission that is called, as a skill that ends in every way in which it can.

    Args:
        declaration: What it takes and gives.
        plan: Which of its inputs count.
        summary: Gives how it ends when it is called in a way.
        classes: Puts codes together that the caller does not tell apart.
        clock: Drives the caller.
        on_cancel: Called when a run is cancelled.
    """

    def __init__(
        self,
        declaration: SkillDeclaration,
        plan: Plan,
        summary: Callable[[str, WayOfCalling], Summary],
        classes: Callable[[Iterable[str]], Iterable[CodeClass]],
        clock: Clock,
        on_cancel: Callable[[OpenEnd], None],
    ) -> None:
        self._declaration = declaration
        self._plan = plan
        self._summary = summary
        self._classes = classes
        self._clock = clock
        self._on_cancel = on_cancel

    def start_at(self, path: str, inputs: Mapping[str, Any]) -> OpenEnd:
        """Begin a run at a node."""
        summary = self._summary(self._declaration.name, self._way(inputs))
        run = OpenEnd(
            summary.with_classes(self._classes), self._declaration, path, summary.longest, summary.stops
        )
        run.on_cancel = self._on_cancel
        if math.isfinite(summary.longest):
            run.limit = self._clock.call_at(self._clock.now() + summary.longest, _nothing)
        return run

    def start(self, inputs: Mapping[str, Any]) -> OpenEnd:
        """Begin a run."""
        return self.start_at("", inputs)

    def _way(self, inputs: Mapping[str, Any]) -> WayOfCalling:
        """Return what is known of the inputs, as far as it counts."""
        known: list[tuple[str, Any]] = []
        for name, value in sorted(inputs.items()):
            if name in self._plan.needed:
                known.append((name, known_part(value)))
            elif name in self._plan.deciding and not _is_open(value):
                known.append((name, value))
        return tuple(known)


def _is_open(value: Any) -> bool:
    return any(map(_is_open, value)) if isinstance(value, tuple) else is_unknown(value)


def _nothing() -> None:
    """Do nothing: the mission ends before."""


def as_skill(declared: SkillDeclaration, resources: frozenset[str]) -> SkillDeclaration:
    """Return what a mission says about itself as a skill that uses what it uses."""
    return replace(declared, resources=resources)
