"""Follows what an author wants to hold of a mission through the graph of its states.

A property is a small automaton. It reads what happens on a way, step by step, beside the mission itself.
What happens inside of a mission that is called is the business of that mission: here it begins and ends, like
a skill.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

from florence_bt.assurance.events import Groups, Happening, is_at, is_end
from florence_bt.assurance.explorer import Edge, Ending, Graph
from florence_bt.trees.language.model import Property, PropertyEvent

Memory = tuple[Any, ...]
"""What a property remembers of the way so far."""
BROKEN: Memory = ("broken",)
_Step = tuple[int, Memory]
"""A state, with what is remembered there."""


def way_that_breaks(wanted: Property, graph: Graph, groups: Groups) -> tuple[Edge, ...] | None:
    """Return the shortest way on which a property does not hold; None: it holds on all that were explored."""
    automaton = _Automaton(wanted, groups)
    start: _Step = (0, ())
    came: dict[_Step, tuple[_Step, Edge] | None] = {start: None}
    todo = deque([start])
    while todo:
        at = todo.popleft()
        ending = graph.endings.get(at[0])
        if at[1] == BROKEN or (ending is not None and automaton.breaks_at(at[1], ending)):
            return _back(came, at)
        for edge in graph.edges[at[0]]:
            after = (edge.target, automaton.after(at[1], edge))
            if after not in came:
                came[after] = (at, edge)
                todo.append(after)
    return None


def _back(came: Mapping[_Step, tuple[_Step, Edge] | None], at: _Step) -> tuple[Edge, ...]:
    way: list[Edge] = []
    while (step := came[at]) is not None:
        at, edge = step
        way.append(edge)
    return tuple(way[::-1])


class _Automaton:
    """One property, as it reads what happens."""

    def __init__(self, wanted: Property, groups: Groups) -> None:
        self._wanted = wanted
        self._groups = groups
        self._first, self._then = wanted.first, wanted.then
        self._read = {
            "never": self._never,
            "after": self._after,
            "at_most": self._at_most,
            "always_before": self._always_before,
        }[wanted.word]

    def after(self, memory: Memory, edge: Edge) -> Memory:
        """Return what is remembered after a step."""
        if self._wanted.word == "after" and memory and memory != BROKEN:
            late = memory[0] + edge.seconds
            memory = BROKEN if late > self._wanted.within + 1e-3 else (late,)
        for each in edge.happened:
            if memory == BROKEN:
                break
            memory = self._read(memory, each)
        return memory

    def breaks_at(self, memory: Memory, ending: Ending) -> bool:
        """Tell whether it does not hold where the mission has ended."""
        match self._wanted.word:
            case "never":
                return (
                    self._wanted.condition is None and self._then is None and self._ends(self._first, ending)
                )
            case "after":
                begun = bool(memory) or self._ends(self._first, ending)
                return begun and ending.status != "STOPPED" and not self._ends(self._then, ending)
            case "always_before":
                return not memory and self._ends(self._first, ending)
        return False

    def _is(self, event: PropertyEvent | None, each: Happening) -> bool:
        return event is not None and is_at(event, each, self._groups)

    def _ends(self, event: PropertyEvent | None, ending: Ending) -> bool:
        return event is not None and is_end(event, ending.status, ending.code, self._groups)

    def _never(self, memory: Memory, each: Happening) -> Memory:
        if self._wanted.condition is not None:
            unwanted = each.what == "unwanted" and each.text == self._wanted.text
            return BROKEN if unwanted else memory
        if self._then is None:
            return BROKEN if self._is(self._first, each) else memory
        running = set(memory)
        if self._is(self._first, each) and any(skill == self._then.who for skill, _ in running):
            return BROKEN
        if each.what == "start":
            running.add((each.skill, each.path))
        elif each.what in ("end", "cancel"):
            running.discard((each.skill, each.path))
        return BROKEN if self._both_run(running) else self._those_that_count(running)

    def _both_run(self, running: set[tuple[str, str]]) -> bool:
        """Tell whether two runs are there of skills that must not run together."""
        assert self._first is not None
        assert self._then is not None
        names = [skill for skill, _ in running]
        pair = {self._first.who, self._then.who}
        both = pair <= set(names) and (len(pair) > 1 or names.count(self._then.who) > 1)
        return self._first.how == "runs" and both

    def _those_that_count(self, running: set[tuple[str, str]]) -> Memory:
        names = {event.who for event in self._wanted.events}
        return tuple(sorted(each for each in running if each[0] in names))

    def _after(self, memory: Memory, each: Happening) -> Memory:
        if memory and each.what == "pause":
            return (-math.inf,)  # what was paused may take longer
        if memory:
            return () if self._is(self._then, each) or each.what in ("stop", "override") else memory
        return (0.0,) if self._is(self._first, each) else memory

    def _at_most(self, memory: Memory, each: Happening) -> Memory:
        if not self._is(self._first, each):
            return memory
        count = (memory[0] if memory else 0) + 1
        return BROKEN if count > self._wanted.most else (count,)

    def _always_before(self, memory: Memory, each: Happening) -> Memory:
        if not memory and self._is(self._first, each):
            return BROKEN
        return ("came",) if self._is(self._then, each) else memory
