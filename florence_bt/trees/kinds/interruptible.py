"""``interrupted_by``: what comes before a node, which goes on afterwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.outcome import LASTING_CODES
from florence_bt.trees.language.model import Node, Wrapper
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, skipped_with
from florence_bt.trees.language.value_schemas import EXPRESSION, NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interruptible(Wrapper):
    """Does the node below, which is interrupted while something else is done.

    Attributes:
        goal: The node whose success interrupts it.
        interruption: What is done then.
    """

    kind: ClassVar = NodeKind(
        word="interrupted_by",
        about="what comes first when something is so; then the node goes on",
        symbol="⇄",
        value={
            "type": "object",
            "properties": {"if": {"anyOf": [EXPRESSION, NODE]}, "do": NODE},
            "required": ["if", "do"],
            "additionalProperties": False,
        },
    )

    goal: Node
    interruption: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, what interrupts it, and what is done then."""
        return (self.child, self.goal, self.interruption)

    @property
    def default_title(self) -> str:
        """As the node below."""
        return self.child.title

    @property
    def edges(self) -> tuple[str, ...]:
        """Name the part that interrupts it, and the one that is done then."""
        return ("", "interrupted if", "then first")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the node below, or with a failure of what comes before it."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        asked = known.of(self.goal, skip_fails=True).codes & LASTING_CODES
        done = known.of(self.interruption, skip_fails=False)
        return skipped_with(
            child, NodeOutcomes(child.can_succeed, child.codes | asked | done.codes), skip_fails
        )

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the node below, the question beside it, and what is done then."""
        from florence_bt.behaviours import until
        from florence_bt.behaviours.annotations import numbered

        body = builder.child(self, skipped_fails)
        question = builder.question(self.goal)
        interruption = builder.node(self.interruption, skipped_fails=False)
        numbered([body, question.node, interruption])
        return until.Interruptible(name, builder.context, body, question, interruption)
