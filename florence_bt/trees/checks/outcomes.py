"""Possible ends of each node of a mission, for those who count what tests have seen of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.behaviours.keys import HIDDEN
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.trees import kinds
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node
from florence_bt.trees.language.outcomes import SUCCEEDS, NodeOutcomes

MISTAKES = frozenset({"missing_key", "bad_input", "bad_output", "bad_expression", "no_skill"})
"""Codes of mistakes in a mission or a robot, as opposed to what can go wrong in the world."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The outcomes that a node can have by what happens in the world.

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
    """Return every node of a mission with the outcomes that it can have, in the order of the file.

    Args:
        mission: The mission, without errors.
        library: Where called missions are found.
        declarations: The skills by name.
    """
    analysis = Analysis(library, declarations).of(mission)
    return [
        (
            node,
            Outcomes(
                success=_can_succeed(node, analysis.of(node).outcomes),
                failure=bool(analysis.of(node).outcomes.codes - MISTAKES),
                stopped=analysis.of(node).lasting,
                skipped=node.when is not None,
            ),
        )
        for node in mission.nodes()
    ]


def _can_succeed(node: Node, outcomes: NodeOutcomes) -> bool:
    return outcomes.can_succeed and not outcomes.only_skips and not isinstance(node, kinds.Fail)


@dataclass(frozen=True, slots=True)
class PossibleOutcomes:
    """The possible ends of a mission, for those who hold expectations against them.

    Attributes:
        kinds: The kinds of its inputs and keys, as far as they are known.
        keys: Every input and key that it has, whether the kind is known or not.
        codes: The codes it can fail with, mistakes in a mission or a robot included.
    """

    kinds: Mapping[str, Kind]
    keys: frozenset[str]
    codes: frozenset[str]


def mission_outcomes(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> PossibleOutcomes:
    """Return what can come of a mission.

    Args:
        mission: The mission, without errors.
        library: Where called missions are found.
        declarations: The skills by name.
    """
    analysis = Analysis(library, declarations)
    known = analysis.of(mission)
    written = {key.text for node in mission.nodes() for key, _ in analysis.writes(node, known.kinds)}
    outcomes = known.root.outcomes if known.root is not None else SUCCEEDS
    return PossibleOutcomes(
        kinds=known.kinds,
        keys=frozenset(
            key for key in (*mission.inputs, *mission.keys, *written) if not key.startswith(HIDDEN)
        ),
        codes=outcomes.codes | MISTAKES,
    )
