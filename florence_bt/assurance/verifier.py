"""Explores missions, and those that they call: each once for each way of being called."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from florence_bt.assurance.called import CalledMission, Summary, WayOfCalling, as_skill, summary_of
from florence_bt.assurance.explorer import Graph, Limits, explore
from florence_bt.assurance.plan import Plan, plan_of
from florence_bt.assurance.snapshot import Snapshot
from florence_bt.assurance.world import World
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.skill import Skill
from florence_bt.mission_testing.mocks.stubs import MockedMission, copied, put_stubs
from florence_bt.trees.checks.properties import properties_of
from florence_bt.trees.language.analysis import Analysis, reachable
from florence_bt.trees.language.findings import raise_first_error
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Property

PRECISE_STEPS = 2_000
"""How many steps a mission may have with every timer firing when it is due."""
COARSE_S = 5.0
"""Beyond that, timers that take longer than this may fire at any moment."""


@dataclass(frozen=True, slots=True)
class Explored:
    """A mission that was explored.

    Attributes:
        mission: The mission.
        way: How it was called: the inputs that were known.
        world: The world in which it was explored.
        graph: Its states.
        start: The world before it began.
    """

    mission: Mission
    way: WayOfCalling
    world: World
    graph: Graph
    start: Snapshot


class Verifier:
    """Explores the missions of a library.

    Args:
        library: The missions, checked.
        declarations: The skills.
        limits: When the exploration of one mission ends.
    """

    def __init__(
        self,
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
        limits: Limits | None = None,
    ) -> None:
        self.library = library
        self.declarations = dict(library.with_declared(declarations))
        self._limits = limits or Limits()
        self.analysis = Analysis(library, self.declarations)
        self._called_s = 0.0
        self._properties: dict[str, tuple[Property, ...]] = {}
        self._plans: dict[str, Plan] = {}
        self._explored: dict[tuple[str, WayOfCalling], Explored] = {}
        self._summaries: dict[tuple[str, WayOfCalling], Summary] = {}

    def with_changed(self, library: MissionLibrary, names: Iterable[str]) -> Verifier:
        """Return a verifier of a library in which some missions are others; what does not call them is kept.

        Args:
            library: The library with the changed missions.
            names: The changed missions.
        """
        other = Verifier(library, self.declarations, self._limits)
        changed = set(names)
        kept = {
            name
            for name, _ in self._explored
            if name not in changed and not changed & reachable([name], self.analysis.callees_of).keys()
        }
        other._plans = {name: plan for name, plan in self._plans.items() if name in kept}
        other._explored = {key: each for key, each in self._explored.items() if key[0] in kept}
        other._summaries = {key: each for key, each in self._summaries.items() if key[0] in kept}
        return other

    def explored(self, name: str, way: WayOfCalling = ()) -> Explored:
        """Return a mission explored, called in a way."""
        known = self._explored.get((name, way))
        if known is None:
            known = self._explored[name, way] = self._explore(self.library.get(name), way)
        return known

    def ways_of(self, name: str) -> list[Explored]:
        """Return a mission as it was explored so far, in each way of calling it."""
        return [each for (known, _), each in self._explored.items() if known == name]

    def ways_below(self, mission: Mission) -> list[Explored]:
        """Return what a mission calls, and what is called by that, as it was explored so far."""
        below = reachable(self.analysis.callees(mission), self.analysis.callees_of)
        names = {*self.analysis.callees(mission), *below}
        return [each for name in sorted(names) for each in self.ways_of(name)]

    def summary(self, name: str, way: WayOfCalling) -> Summary:
        """Return how a mission can end that is called in a way."""
        known = self._summaries.get((name, way))
        if known is None:
            explored = self.explored(name, way)
            known = self._summaries[name, way] = summary_of(explored.mission, explored.graph)
        return known

    def plan(self, name: str) -> Plan | None:
        """Return what decides how a mission goes; None: there is no such mission."""
        if name not in self._plans:
            mission = self.library.find(name)
            if mission is None:
                return None
            truths = [each for each, port in mission.outputs.items() if port.kind is Kind.BOOLEAN]
            self._plans[name] = plan_of(mission, self.plan, truths, self.properties(mission))
        return self._plans[name]

    def properties(self, mission: Mission) -> tuple[Property, ...]:
        """Return what its author wants to hold of a mission.

        Raises:
            ConfigError: They are wrong.
        """
        if mission.name not in self._properties:
            found, findings = properties_of(mission, self.analysis)
            raise_first_error(findings)
            self._properties[mission.name] = found
        return self._properties[mission.name]

    def _own_time(self) -> float:
        """Return seconds of the processor, which stand still while missions are explored that are called."""
        return time.process_time() - self._called_s

    def _explore(self, mission: Mission, way: WayOfCalling) -> Explored:
        plan = self.plan(mission.name)
        assert plan is not None  # the mission is there
        library = self.with_stubs(mission)
        began = self._own_time()
        for coarse_s, limits in (
            (None, replace(self._limits, steps=min(PRECISE_STEPS, self._limits.steps))),
            (COARSE_S, self._limits),
        ):
            wanted = () if way else self.properties(mission)
            world = World(mission, library, self.declarations, plan, dict(way), self.called, wanted, coarse_s)
            start = world.snapshot()
            graph = explore(world, limits, self._own_time)
            if not graph.unexplored:
                break
        self._called_s = self._own_time() - began + self._called_s
        return Explored(mission, way, world, graph, start)

    def with_stubs(self, mission: Mission) -> MissionLibrary:
        """Return a library in which each mission that this one calls is one skill."""
        taken: dict[str, set[str]] = {}
        for call in self.analysis.calls(mission):
            taken.setdefault(call.mission.text, set()).update(output.text for output, _ in call.outputs)
        library = copied(self.library)
        stubs = [MockedMission(name, frozenset(outputs)) for name, outputs in taken.items()]
        put_stubs(stubs, library, self.declarations)
        for name in taken:
            root = self.analysis.of(self.library.get(name)).root
            resources = root.resources if root is not None else frozenset[str]()
            library.declarations[name] = as_skill(library.declarations[name], resources)
        return library

    def called(self, world: World) -> Mapping[str, Skill]:
        """Return the missions that the mission of a world calls, as skills."""
        return {
            call: CalledMission(
                world.declarations[call], plan, self.summary, world.classes, world.clock, world.note_cancel
            )
            for call in self.analysis.callees(world.mission)
            if (plan := self.plan(call)) is not None
        }
