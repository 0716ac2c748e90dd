"""Explores every way that a mission can go: a graph of states, each with what may follow."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from florence_bt.assurance.events import Happening
from florence_bt.assurance.lasting import Lasting
from florence_bt.assurance.snapshot import Snapshot
from florence_bt.assurance.world import NextEvent, World


class Edge(NamedTuple):
    """A step from one state to another.

    Attributes:
        target: The state that it leads to.
        event: What happened.
        path: What was chosen in it.
        happened: What followed.
        seconds: How long it took at most.
    """

    target: int
    event: NextEvent
    path: tuple[int, ...]
    happened: tuple[Happening, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class Ending:
    """The end of a mission in a state in which nothing of it is left.

    Attributes:
        status: The status of the run.
        code: Its code.
        outputs: What it gives.
        lasting: Thing -> what became of it.
    """

    status: str
    code: str
    outputs: dict[str, Any]
    lasting: dict[str, Lasting]


@dataclass(slots=True)
class Graph:
    """The states of a mission.

    Attributes:
        edges: For each state what may follow; state 0 is the first.
        endings: State -> how the mission has ended there.
        stuck: States in which nothing more can happen although the mission goes on.
        stopped: States after a stop or an override.
        waits: How many states wait for something outside.
        unexplored: How many states were left when the limits were reached.
        seconds: How long the exploration took.
    """

    edges: list[list[Edge]] = field(default_factory=list)
    endings: dict[int, Ending] = field(default_factory=dict)
    stuck: list[int] = field(default_factory=list)
    stopped: set[int] = field(default_factory=set)
    waits: int = 0
    unexplored: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of an exploration.

    Attributes:
        seconds: How long it may take, without the missions that are called.
        steps: How many steps may be taken.
    """

    seconds: float = 30.0
    steps: int = 1_000_000


def explore(world: World, limits: Limits, stopwatch: Callable[[], float] = time.process_time) -> Graph:
    """Explore a mission.

    Args:
        world: The mission, which has not begun.
        limits: When to give up; what is left then is counted in the graph.
        stopwatch: Gives the seconds that count.
    """
    return _Exploration(world, limits, stopwatch).run()


class _Exploration:
    """One exploration, state by state; the last one found is the next one looked at."""

    def __init__(self, world: World, limits: Limits, stopwatch: Callable[[], float]) -> None:
        self._stopwatch = stopwatch
        self._steps_taken = 0
        self._world = world
        self._limits = limits
        self._graph = Graph()
        self._known: dict[Any, int] = {}
        self._todo: list[tuple[int, Snapshot]] = []

    def run(self) -> Graph:
        """Explore all."""
        began = self._stopwatch()
        self._state()
        graph = self._graph
        while self._todo:
            late = self._stopwatch() - began > self._limits.seconds
            if late or self._steps_taken > self._limits.steps:
                graph.unexplored = len(self._todo)
                break
            self._expand(*self._todo.pop())
        graph.seconds = self._stopwatch() - began
        return graph

    def _state(self) -> int:
        """Return the number of the state in which the world is now; a new one is to be explored."""
        world = self._world
        key = world.key()
        number = self._known.get(key)
        if number is not None:
            return number
        graph = self._graph
        number = self._known[key] = len(graph.edges)
        graph.edges.append([])
        moment = world.moment
        if moment.end is not None and moment.end[0] == "STOPPED":
            graph.stopped.add(number)
        if world.over:
            assert moment.end is not None
            graph.endings[number] = Ending(*moment.end, dict(moment.outputs), dict(moment.lasting))
        else:
            self._todo.append((number, world.snapshot()))
        return number

    def _expand(self, number: int, snapshot: Snapshot) -> None:
        world, graph = self._world, self._graph
        snapshot.restore()
        events = list(world.events())
        graph.waits += world.waits
        goes_on = False
        for event in events:
            goes_on = goes_on or event.what not in ("pause", "stop", "override")
            for edge in self._steps(event, snapshot):
                graph.edges[number].append(edge)
        if not goes_on:
            graph.stuck.append(number)

    def _steps(self, event: NextEvent, snapshot: Snapshot) -> Iterator[Edge]:
        """Take a step once for each way in which its choices can be made."""
        world = self._world
        path: list[int] | None = []
        while path is not None:
            snapshot.restore()
            self._steps_taken += 1
            world.happened.clear()
            world.choices.begin(path)
            seconds = world.do(event)
            chosen = tuple(world.choices.path)
            path = world.choices.next()
            yield Edge(self._state(), event, chosen, tuple(world.happened), seconds)
