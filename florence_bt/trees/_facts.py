"""What can be known about the parts of a mission without running it: the basis of the checks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees import model
from florence_bt.trees.kinds import FAILED
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.model import Literal, Mission, Node, Value
from florence_bt.trees.quantities import guess_value

OWN_CODES = {
    "missing_key": "a key was read that nothing has written",
    "no_skill": "this robot lacks the skill",
    "bad_output": "the skill succeeded without giving what it promises",
}
"""Codes that the tree itself gives the use of a skill, beside those of the skill."""


@dataclass(frozen=True)
class Facts:
    """The surroundings of the missions that are checked.

    Attributes:
        library: Every mission.
        declarations: Every skill.
    """

    library: MissionLibrary
    declarations: Mapping[str, SkillDeclaration]
    _busy: set[str] = field(default_factory=set)

    def calls(self, mission: Mission) -> Iterator[model.Call]:
        """Every call of another mission."""
        return (node for node in mission.nodes() if isinstance(node, model.Call))

    def output_kinds(self, node: model.Use | model.Call) -> Mapping[str, Kind]:
        """The outputs that a node can give, with their kinds."""
        if isinstance(node, model.Use):
            declaration = self.declarations.get(node.skill)
            return {name: port.kind for name, port in declaration.outputs.items()} if declaration else {}
        mission = self.library.find(node.mission.text)
        return {name: port.kind for name, port in mission.outputs.items()} if mission else {}

    def writes(self, node: Node, kinds: Mapping[str, Kind]) -> Iterator[tuple[Literal, Kind | None]]:
        """The keys that a node itself writes, each with its kind if that is known.

        Args:
            node: The node.
            kinds: The kinds of keys that are known already.
        """
        match node:
            case model.Use(outputs=outputs) | model.Call(outputs=outputs):
                given = self.output_kinds(node)
                yield from ((key, given.get(output.text)) for output, key in outputs)
            case model.Set(values=values):
                yield from ((key, kind_of(value, kinds)) for key, value in values)
            case model.Retry(attempt_key=key) if key is not None:
                yield key, Kind.INTEGER

    def key_kinds(self, mission: Mission) -> dict[str, Kind]:
        """The kinds of a mission's inputs and keys, as far as they are known; the first writer decides."""
        kinds = {name: port.kind for name, port in mission.inputs.items()}
        for node in mission.nodes():
            for key, kind in self.writes(node, kinds):
                if kind is not None:
                    kinds.setdefault(key.text, kind)
        return kinds

    def all_known(self, node: Node) -> bool:
        """Whether every skill and mission at and below a node exists."""
        return all(
            (not isinstance(below, model.Use) or below.skill in self.declarations)
            and (not isinstance(below, model.Call) or below.mission.text in self.library)
            for below in model.walk(node)
        )

    def codes(self, node: Node) -> frozenset[str]:
        """The codes that a node can fail with."""
        below = frozenset[str]().union(*(self.codes(part) for part in node.parts))
        match node:
            case model.Succeed():
                return frozenset()
            case model.Invert():
                return frozenset({"inverted"})
            case model.Timeout():
                return below | {"timed_out", *_OF_VALUES}
            case model.Fail(code=code):
                return frozenset({code.text if code else FAILED, "missing_key"})
            case model.Retry() | model.Repeat() | model.Wait():
                return below | _OF_VALUES
            case model.Set():
                return frozenset({"missing_key"})
            case model.Use(skill=skill):
                declaration = self.declarations.get(skill)
                declared = declaration.failures if declaration else {}
                return frozenset({*declared, *COMMON_CODES, *OWN_CODES})
            case model.Call(mission=mission):
                return self._in_called(mission.text, self.codes) | _OF_VALUES
        return below

    def resources(self, node: Node) -> frozenset[str]:
        """What only one skill at a time may use, of all skills at and below a node."""
        found = frozenset[str]().union(*(self.resources(part) for part in node.parts))
        if node.cleanup is not None:
            found |= self.resources(node.cleanup)
        if isinstance(node, model.Use) and node.skill in self.declarations:
            found |= self.declarations[node.skill].resources
        if isinstance(node, model.Call):
            found |= self._in_called(node.mission.text, self.resources)
        return found

    def _in_called(self, name: str, ask: Callable[[Node], frozenset[str]]) -> frozenset[str]:
        """Ask about the tree of a called mission; a mission that calls itself adds nothing."""
        mission = self.library.find(name)
        if mission is None or mission.tree is None or name in self._busy:
            return frozenset()
        self._busy.add(name)
        try:
            return ask(mission.tree)
        finally:
            self._busy.discard(name)


_OF_VALUES = frozenset({"missing_key", "bad_input"})


def kind_of(value: Value, kinds: Mapping[str, Kind]) -> Kind | None:
    """The kind of a value where nothing says what it must be; None when it is not known."""
    match value:
        case Literal(text=text, quoted=quoted):
            return Kind.TEXT if quoted else guess_value(text)[0]
        case model.Reference(key=key):
            return kinds.get(key)
        case model.Template():
            return Kind.TEXT
        case model.PoseParts():
            return Kind.POSE


def fits(given: Kind | None, wanted: Kind | None) -> bool:
    """Whether a key of one kind can be given where another is wanted; what is not known fits."""
    return (
        given is None or wanted is None or given is wanted or (given, wanted) == (Kind.INTEGER, Kind.NUMBER)
    )
