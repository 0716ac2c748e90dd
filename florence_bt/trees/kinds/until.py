"""``until``: what ends a node, with success."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.outcome import LASTING_CODES
from florence_bt.trees.language.model import Node, Wrapper
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes, skipped_with
from florence_bt.trees.language.value_schemas import EXPRESSION, NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

UNTIL_NOT_MET = "until_not_met"
"""The code of an ``until`` that names none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Until(Wrapper):
    """Does the node below until another one succeeds.

    Attributes:
        goal: The node whose success ends it.
    """

    kind: ClassVar = NodeKind(
        word="until",
        about="what ends the node: a node that succeeds, or an expression that holds",
        symbol="⇥",
        value={"anyOf": [EXPRESSION, NODE]},
        failures={UNTIL_NOT_MET: "a node was done before what its `until` waits for"},
    )

    goal: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, and what ends it."""
        return (self.child, self.goal)

    @property
    def default_title(self) -> str:
        """Such as ``navigate to until look for user``."""
        return f"{self.child.title} until {self.goal.title}"

    @property
    def edges(self) -> tuple[str, ...]:
        """Name the part that ends it."""
        return ("", "until")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success by its goal, else as the node below, which was too early."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        ends = known.of(self.goal, skip_fails=True)
        codes = child.codes | (ends.codes & LASTING_CODES)
        codes |= {self.own_failure(UNTIL_NOT_MET)} if child.can_succeed else NO_CODES
        return skipped_with(child, NodeOutcomes(ends.can_succeed, codes), skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the node below, and the question beside it."""
        from florence_bt.behaviours import until
        from florence_bt.behaviours.annotations import numbered

        body = builder.child(self, skipped_fails)
        question = builder.question(self.goal)
        numbered([body, question.node])
        return until.Until(name, builder.context, body, question, self.own_failure(UNTIL_NOT_MET))
