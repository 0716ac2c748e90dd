"""How each node of a mission can end, for those who count what tests have seen of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.trees.language import model
from florence_bt.trees.language._ends import SUCCEEDS
from florence_bt.trees.language._facts import Facts
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node

MISTAKES = frozenset({"missing_key", "bad_input", "bad_output", "bad_expression", "no_skill"})
"""Codes of mistakes in a mission or a robot, as opposed to what can go wrong in the world."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The ends that a node can have by what happens in the world.

    Attributes:
        success: Whether it can succeed.
        failure: Whether it can fail.
        stopped: Whether it can be running and then be left.
        skipped: Whether a guard can keep it from starting.
    """

    success: bool
    failure: bool
    stopped: bool
    skipped: bool


def possible_outcomes(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> list[tuple[Node, Outcomes]]:
    """Every node of a mission with the ends that it can have, in the order of the file.

    Args:
        mission: The mission, without errors.
        library: Where called missions are found.
        declarations: The skills by name.
    """
    facts = Facts(library, declarations).of(mission)
    lasting = _Lasting(library, declarations)
    return [
        (
            node,
            Outcomes(
                success=facts.of(node).ends.can_succeed and not isinstance(node, model.Fail),
                failure=bool(facts.of(node).ends.codes - MISTAKES),
                stopped=lasting.can_run(node),
                skipped=node.when is not None or node.unless is not None,
            ),
        )
        for node in mission.nodes()
    ]


@dataclass(frozen=True, slots=True)
class Prospects:
    """What can come of a mission, for those who hold expectations against it.

    Attributes:
        kinds: The kinds of its inputs and keys, as far as they are known.
        keys: Every input and key that it has, whether the kind is known or not.
        codes: The codes it can fail with, mistakes in a mission or a robot included.
        can_succeed: Whether it can succeed.
    """

    kinds: Mapping[str, Kind]
    keys: frozenset[str]
    codes: frozenset[str]
    can_succeed: bool


def prospects_of(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> Prospects:
    """What can come of a mission.

    Args:
        mission: The mission, without errors.
        library: Where called missions are found.
        declarations: The skills by name.
    """
    facts = Facts(library, declarations)
    known = facts.of(mission)
    written = {key.text for node in mission.nodes() for key, _ in facts.writes(node, known.kinds)}
    ends = known.root.ends if known.root is not None else SUCCEEDS
    return Prospects(
        kinds=known.kinds,
        keys=frozenset({*mission.inputs, *mission.keys, *written}),
        codes=ends.codes | MISTAKES,
        can_succeed=ends.can_succeed,
    )


class _Lasting:
    """Finds the nodes that can take time."""

    def __init__(self, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]) -> None:
        self._library = library
        self._declarations = declarations
        self._missions: dict[str, bool] = {}

    def can_run(self, node: Node) -> bool:
        if node.cleanup is not None and self.can_run(node.cleanup):
            return True
        match node:
            case model.Wait() | model.Delay():
                return True
            case model.Use(skill=skill):
                declaration = self._declarations.get(skill)
                return declaration is not None and not declaration.instant
            case model.Call(mission=mission):
                return self._mission_can_run(mission.text)
        return any(self.can_run(part) for part in node.parts)

    def _mission_can_run(self, name: str) -> bool:
        if name not in self._missions:
            self._missions[name] = False  # a mission that calls itself adds nothing
            mission = self._library.find(name)
            self._missions[name] = (
                mission is not None and mission.tree is not None and self.can_run(mission.tree)
            )
        return self._missions[name]
