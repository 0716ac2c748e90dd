"""``sequence``: one after the other until one fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.kinds.in_order import InOrder
from florence_bt.trees.kinds.modifiers import MEMORY
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, codes_of, up_to
from florence_bt.trees.language.value_schemas import NODES

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sequence(InOrder):
    """Does its nodes one after the other until one fails."""

    kind: ClassVar = NodeKind(
        word="sequence",
        about="runs its nodes one after the other until one fails",
        symbol="→",
        value=NODES,
        example="- sequence:\n    - wait: 1 s",
        modifiers=(MEMORY,),
        others=("reactive_sequence", "reactivesequence"),
    )

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success when all can, and as any that is reached can fail."""
        parts = [known.of(child, skip_fails=False) for child in self.children]
        reached = up_to(parts, lambda part: not part.can_succeed)
        return NodeOutcomes(all(part.can_succeed for part in parts), codes_of(reached))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the composite of py_trees, or ours without memory."""
        from py_trees import composites as plain

        from florence_bt.behaviours import composites

        if self.memory:
            return plain.Sequence(name, True, builder.children(self.children, skipped_fails=False))
        return composites.ReactiveSequence(name, *builder.watching(self, skipped_fails=False))
