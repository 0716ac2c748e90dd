"""``invert``: success becomes failure and failure success."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.kinds.modifiers import CODE
from florence_bt.trees.language.model import Wrapper
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes, skipped_with
from florence_bt.trees.language.value_schemas import NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


UNEXPECTED_SUCCESS = "unexpected_success"
"""The code of an ``invert`` that names none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Invert(Wrapper):
    """Turns the success of the node below into failure, and its failure into success."""

    kind: ClassVar = NodeKind(
        word="invert",
        about="turns the success of a node into failure and its failure into success",
        symbol="¬",
        value=NODE,
        example="- invert:\n    condition: $found",
        modifiers=(CODE,),
        failures={UNEXPECTED_SUCCESS: "what was inverted succeeded"},
        others=("inverter", "not"),
    )

    @property
    def default_title(self) -> str:
        """Such as ``not robot in room``."""
        return f"not {self.child.title}"

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: the other way round."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        own = frozenset({self.own_failure(UNEXPECTED_SUCCESS)}) if child.can_succeed else NO_CODES
        return skipped_with(child, NodeOutcomes(child.can_fail, own), skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the decorator."""
        from florence_bt.behaviours import decorators

        child = builder.child(self, skipped_fails)
        return decorators.Invert(name, child, self.own_failure(UNEXPECTED_SUCCESS))
