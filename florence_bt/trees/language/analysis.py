"""Analysis of missions and their parts without running them: the basis of the checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from florence_bt.core.declaration import CodeGroup, Kind, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Literal, Mission, Node, show
from florence_bt.trees.language.node_kind import KnownKinds
from florence_bt.trees.language.outcomes import SUCCEEDS, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.values import kind_of

NOTHING = frozenset[str]()


@dataclass(frozen=True, slots=True)
class NodeFacts:
    """The facts about one node with everything below it, called missions included.

    Attributes:
        outcomes: How it can end.
        resources: What only one skill at a time may use, of all its skills.
        known: Whether every skill and mission below exists.
        lasting: Whether it can be running, because something below takes time.
        acts: Whether a skill below is no condition but an action, clean-ups apart.
        asks: Whether something below can be watched as a condition, clean-ups apart.
        asked_resources: What the skills use that are asked where the node is watched.
        unwatchable: The first node at or below it that only asks and cannot be watched, with its mission: it
            has a clean-up, or it is a ``once``.
        depth: The height of the tree in nodes.
        count: How many nodes there are.
    """

    outcomes: NodeOutcomes
    resources: frozenset[str]
    known: bool
    lasting: bool
    acts: bool
    asks: bool
    asked_resources: frozenset[str]
    unwatchable: tuple[Mission, Node] | None
    depth: int
    count: int


@dataclass(frozen=True, slots=True)
class MissionFacts:
    """The facts about one mission.

    Attributes:
        mission: The mission.
        nodes: What is known of each node.
        kinds: The kinds of its inputs and keys, as far as they are known.
        names: Input or key -> what its text must name (a hotspot, a room), because such an input of a skill
            is given it.
        all: Every node from the root down, clean-ups included.
    """

    mission: Mission
    nodes: Mapping[Node, NodeFacts]
    kinds: Mapping[str, Kind]
    names: Mapping[str, str]
    all: tuple[Node, ...]

    @property
    def root(self) -> NodeFacts | None:
        """Give what is known of the whole tree."""
        return self.nodes[self.mission.tree] if self.mission.tree is not None else None

    def of(self, node: Node) -> NodeFacts:
        """Return what is known of a node of this mission."""
        return self.nodes[node]


def skills_used_by(mission: Mission) -> set[str]:
    """Return the skills that a mission uses, and the missions that it calls, which count as skills."""
    return {
        node.skill if isinstance(node, kinds.RunSkill) else node.mission.text
        for node in mission.nodes()
        if isinstance(node, (kinds.RunSkill, kinds.CallMission))
    }


class Analysis:
    """The surroundings of the missions that are checked, and what is known of each of them.

    Each mission is looked at once, those that it calls first, so that neither a long chain of calls nor a
    mission that is called a thousand times costs more.

    Args:
        library: Every mission.
        declarations: Every skill.
    """

    def __init__(self, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]) -> None:
        self.library = library
        self.declarations = declarations
        self._known: dict[Mission, MissionFacts] = {}
        self._callees: dict[Mission, tuple[str, ...]] = {}
        self._kinds: dict[Mission, Mapping[str, Kind]] = {}
        self._texts: dict[Mission, Mapping[str, tuple[str, ...]]] = {}

    @cached_property
    def groups(self) -> Mapping[str, CodeGroup]:
        """The groups of failure codes that the skills declare, by name."""
        return groups_of(self.declarations)

    def of(self, mission: Mission) -> MissionFacts:
        """Return what is known of a mission."""
        if mission in self._known:
            return self._known[mission]
        waiting, begun = [mission], set[Mission]()
        while waiting:
            top = waiting[-1]
            if top not in self._known and top not in begun:
                begun.add(top)
                below = map(self.library.find, self.callees(top))
                waiting += [each for each in below if each is not None and each not in begun]
                continue
            waiting.pop()
            if top not in self._known:
                self._known[top] = _FactsOfMission(top, self).result()
        return self._known[mission]

    def called(self, name: str) -> MissionFacts | None:
        """Return what is known of a mission that is called; None when there is none, or it calls itself."""
        mission = self.library.find(name)
        return self._known.get(mission) if mission is not None else None

    def calls(self, mission: Mission) -> Iterator[kinds.CallMission]:
        """Yield every call of another mission."""
        return (node for node in mission.nodes() if isinstance(node, kinds.CallMission))

    def callees(self, mission: Mission) -> tuple[str, ...]:
        """Return the missions that a mission calls, each once."""
        known = self._callees.get(mission)
        if known is None:
            names = dict.fromkeys(call.mission.text for call in self.calls(mission))
            known = self._callees[mission] = tuple(names)
        return known

    def callees_of(self, name: str) -> tuple[str, ...]:
        """Return the missions that the mission of a name calls; none when there is no such mission."""
        mission = self.library.find(name)
        return self.callees(mission) if mission is not None else ()

    def cycle_of(self, mission: Mission) -> frozenset[str]:
        """Return the missions through which a mission calls itself, with itself; none if it does not."""
        return self._cycles.get(mission.name, NOTHING)

    @cached_property
    def _cycles(self) -> dict[str, frozenset[str]]:
        return cycles(self.library.names(), self.callees_of)

    def output_kinds(self, node: Node) -> Mapping[str, Kind]:
        """Return the outputs that a skill or a called mission can give, with their kinds."""
        if isinstance(node, kinds.RunSkill):
            declaration = self.declarations.get(node.skill)
            return {name: port.kind for name, port in declaration.outputs.items()} if declaration else {}
        mission = self.library.find(node.mission.text) if isinstance(node, kinds.CallMission) else None
        return {name: port.kind for name, port in mission.outputs.items()} if mission else {}

    def writes(self, node: Node, known: Mapping[str, Kind]) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys that a node itself writes, each with its kind if that is known.

        Args:
            node: The node.
            known: The kinds of keys that are known already.
        """
        return node.writes(KnownKinds(lambda value: kind_of(value, known), self.output_kinds))

    def measured(self, mission: Mission) -> frozenset[str]:
        """Return the keys to which skills and called missions of a mission give what is no whole number."""
        return frozenset(
            key.text
            for node in self.of(mission).all
            if isinstance(node, kinds.RunSkill | kinds.CallMission)
            for output, key in node.outputs
            if self.output_kinds(node).get(output.text) is not Kind.INTEGER
        )

    def known_texts(self, mission: Mission) -> Mapping[str, tuple[str, ...]]:
        """Return the keys that can only have certain texts, with these: all that write them say which."""
        known = self._texts.get(mission)
        if known is None:
            self._texts[mission] = {}  # a mission that calls itself says nothing
            known = self._texts[mission] = self._find_texts(mission)
        return known

    def _find_texts(self, mission: Mission) -> dict[str, tuple[str, ...]]:
        given = {
            name: (port.default,) if isinstance(port.default, str) else ()
            for name, port in mission.keys.items()
        }
        open_ended = set(mission.inputs)
        for node in mission.nodes():
            for key, texts in self._texts_written(node):
                given[key] = tuple(dict.fromkeys((*given.get(key, ()), *texts)))
                open_ended |= {key} if not texts else NOTHING
        return {key: texts for key, texts in given.items() if texts and key not in open_ended}

    def _texts_written(self, node: Node) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the keys that a node writes, each with the texts that it can get; none if it can be any."""
        if isinstance(node, kinds.Set):
            for key, value in node.values:
                is_text = isinstance(value, Literal) and kind_of(value, {}) is Kind.TEXT
                yield key.text, (show(value),) if is_text else ()
        elif isinstance(node, kinds.RunSkill | kinds.CallMission):
            for output, key in node.outputs:
                yield key.text, self._texts_given(node, output.text)
        else:
            yield from ((key.text, ()) for key, _ in self.writes(node, {}))

    def _texts_given(self, node: kinds.RunSkill | kinds.CallMission, output: str) -> tuple[str, ...]:
        if isinstance(node, kinds.RunSkill):
            declaration = self.declarations.get(node.skill)
            port = declaration.outputs.get(output) if declaration else None
            return port.choices if port is not None and port.kind is Kind.TEXT else ()
        mission = self.library.find(node.mission.text)
        return self.known_texts(mission).get(output, ()) if mission is not None else ()

    def key_kinds(self, mission: Mission) -> Mapping[str, Kind]:
        """Return the kinds of a mission's inputs and keys: as declared, else as the first writer has it.

        Of the missions that it calls only the outputs are looked at, so this costs less than :meth:`of`.
        """
        known = self._kinds.get(mission)
        if known is None:
            known = self._kinds[mission] = self._find_kinds(mission)
        return known

    def _find_kinds(self, mission: Mission) -> dict[str, Kind]:
        kinds = {name: port.kind for name, port in (*mission.keys.items(), *mission.inputs.items())}
        for node in mission.nodes():
            for key, kind in self.writes(node, kinds):
                if kind is not None:
                    kinds.setdefault(key.text, kind)
        return kinds

    def names_in(self, node: Node) -> Iterator[tuple[Literal, model.Value, str]]:
        """Yield inputs of a skill or called mission that name something: (input, value, what it names)."""
        if isinstance(node, kinds.RunSkill):
            declaration = self.declarations.get(node.skill)
            ports = declaration.inputs if declaration else {}
            wanted: Mapping[str, str] = {name: port.names for name, port in ports.items() if port.names}
        elif isinstance(node, kinds.CallMission):
            called = self.called(node.mission.text)
            wanted = called.names if called else {}
        else:
            return
        yield from ((name, value, wanted[name.text]) for name, value in node.inputs if name.text in wanted)


class _FactsOfMission:
    """Gathers the facts of one mission from the leaves up."""

    def __init__(self, mission: Mission, analysis: Analysis) -> None:
        self._mission = mission
        self._analysis = analysis
        self._outcomes = MissionOutcomes(mission, analysis.declarations, self._called_outcomes).by_node
        self._nodes: dict[Node, NodeFacts] = {}
        self._all = tuple(mission.nodes())

    def result(self) -> MissionFacts:
        if self._mission.tree is not None:
            self._gather(self._mission.tree)
        return MissionFacts(
            mission=self._mission,
            nodes=self._nodes,
            kinds=self._analysis.key_kinds(self._mission),
            names=self._names(),
            all=self._all,
        )

    def _called_outcomes(self, name: str) -> NodeOutcomes | None:
        called = self._analysis.called(name)
        return called.root.outcomes if called is not None and called.root is not None else None

    def _gather(self, node: Node) -> NodeFacts:
        parts = [self._gather(part) for part in node.parts]
        resources, known, acts = NOTHING, True, False
        asks = node.holds is not None or bool(node.asked())
        lasting = node.takes_time
        match node:
            case kinds.RunSkill(skill=skill):
                declaration = self._analysis.declarations.get(skill)
                resources, known = (declaration.resources, True) if declaration else (NOTHING, False)
                lasting = declaration is not None and not declaration.instant
                asks = declaration is not None and node.is_condition(declaration)
                acts = not asks
            case kinds.CallMission(mission=mission):
                called = self._analysis.called(mission.text)
                known = called is not None and called.root is not None
                parts += [called.root] if called is not None and called.root is not None else []
        below = parts if node.cleanup is None else [*parts, self._gather(node.cleanup)]
        acts = acts or any(part.acts for part in parts)
        asks = asks or any(part.asks for part in parts)
        asked = resources if isinstance(node, kinds.RunSkill) and asks else NOTHING
        outcomes = self._outcomes.get(node, SUCCEEDS)
        kept = not node.passes_on and outcomes.can_fail
        cannot = asks and not acts and (node.cleanup is not None or kept)
        gathered = NodeFacts(
            outcomes=outcomes,
            resources=resources.union(*(part.resources for part in below)),
            known=known and all(part.known for part in below),
            lasting=lasting or any(part.lasting for part in below),
            acts=acts,
            asks=asks,
            asked_resources=asked.union(*(part.asked_resources for part in parts if node.passes_on)),
            unwatchable=(self._mission, node)
            if cannot
            else next((part.unwatchable for part in parts if part.unwatchable is not None), None),
            depth=1 + max((part.depth for part in below), default=0),
            count=1 + sum(part.count for part in below),
        )
        self._nodes[node] = gathered
        return gathered

    def _names(self) -> dict[str, str]:
        names: dict[str, str] = {}
        for node in self._all:
            named = [
                (value.key, what)
                for _, value, what in self._analysis.names_in(node)
                if isinstance(value, model.Reference)
            ]
            if isinstance(node, kinds.RunSkill) and node.skill in self._analysis.declarations:
                ports = self._analysis.declarations[node.skill].outputs
                named += [
                    (key.text, ports[output.text].names)
                    for output, key in node.outputs
                    if output.text in ports and ports[output.text].names
                ]
            for key, what in named:
                # A room is a hotspot too, but not every hotspot is a room.
                if what == "room" or key not in names:
                    names[key] = what
        for node in self._all:
            # A list names what its items name.
            match node:
                case kinds.ForEach(items=model.Reference(key=key), item_key=item) if item.text in names:
                    names.setdefault(key, names[item.text])
        return names


def reachable(start: Iterable[str], next_to: Callable[[str], Iterable[str]]) -> dict[str, str]:
    """Map every name that can be reached from some names to the name from which it was reached first."""
    came_from: dict[str, str] = {}
    waiting = list(start)
    for name in waiting:
        for found in next_to(name):
            if found not in came_from:
                came_from[found] = name
                waiting.append(found)
    return came_from


def callers_among(names: Iterable[str], callees: Callable[[str], Iterable[str]]) -> dict[str, list[str]]:
    """Map each mission that some missions call, with those among them that call it."""
    callers: dict[str, list[str]] = {}
    for name in names:
        for called in callees(name):
            callers.setdefault(called, []).append(name)
    return callers


def chain_back(
    start: str, goal: str, cycle: frozenset[str], callees: Callable[[str], Iterable[str]]
) -> list[str]:
    """Return the shortest chain of calls from one mission to another in its cycle, ends included."""
    callers = callers_among(sorted(cycle), callees)
    back = reachable([goal], lambda name: callers.get(name, ()))
    chain = [start]
    while chain[-1] != goal:
        chain.append(back[chain[-1]])
    return chain


def cycles(names: Iterable[str], callees: Callable[[str], Iterable[str]]) -> dict[str, frozenset[str]]:
    """Map each mission that calls itself, with all missions through which it does (itself among them).

    Linear in the number of calls.

    Args:
        names: Where to begin.
        callees: The missions that a mission calls.

    Source: Tarjan, Depth-first search and linear graph algorithms, 1972 (strongly connected components).
    """
    number: dict[str, int] = {}
    lowest: dict[str, float] = {}
    open_names: list[str] = []
    work: list[tuple[str, Iterator[str]]] = []
    found: dict[str, frozenset[str]] = {}

    def begin(name: str) -> None:
        number[name] = lowest[name] = len(number)
        open_names.append(name)
        work.append((name, iter(callees(name))))

    def close(name: str) -> None:
        group = [open_names.pop()]
        while group[-1] != name:
            group.append(open_names.pop())
        lowest.update(dict.fromkeys(group, math.inf))
        if len(group) > 1 or name in callees(name):
            found.update(dict.fromkeys(group, frozenset(group)))

    for start in names:
        if start not in number:
            begin(start)
        while work:
            name, below = work[-1]
            called = next(below, None)
            if called is not None and called not in number:
                begin(called)
            elif called is not None:
                lowest[name] = min(lowest[name], lowest[called])
            else:
                work.pop()
                above = work[-1][0] if work else name
                lowest[above] = min(lowest[above], lowest[name])
                if lowest[name] == number[name]:
                    close(name)
    return found


MAX_NODES = 50_000
"""Nodes that a mission has at most, those of the missions that it calls counted at every call."""
MAX_TREE_DEPTH = 150
"""The greatest height of a tree in nodes, those of called missions included."""


def too_large(mission: Mission, analysis: Analysis) -> Iterator[ConfigError]:
    """Tell why a mission is too large to run, with everything that it calls; nothing when it is not.

    Args:
        mission: The mission.
        analysis: Its surroundings.
    """
    root = analysis.of(mission).root
    if root is None or mission.tree is None:
        return
    problems: list[tuple[str, str]] = []
    if root.count > MAX_NODES:
        shown = str(root.count) if root.count < 10**9 else "more than a billion"
        message = (
            f"the mission has {shown} nodes with those of the missions that it calls; {MAX_NODES} can run"
        )
        problems.append((message, "repeat: instead of writing a call many times"))
    if root.depth > MAX_TREE_DEPTH:
        message = f"{root.depth} nodes are nested, with those of called missions; {MAX_TREE_DEPTH} can run"
        problems.append((message, "fewer missions that call each other"))
    place = mission.tree.position
    for message, valid in problems:
        yield ConfigError(message, file=mission.file, line=place.line, column=place.column, valid=[valid])
