"""``selector``: one after the other until one succeeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.kinds.in_order import InOrder
from florence_bt.trees.kinds.modifiers import MEMORY
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes, codes_of, up_to
from florence_bt.trees.language.value_schemas import NODES

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selector(InOrder):
    """Tries its nodes one after the other until one succeeds."""

    kind: ClassVar = NodeKind(
        word="selector",
        about="tries its nodes one after the other until one succeeds",
        symbol="?",
        value=NODES,
        example="- selector:\n    - wait: 1 s",
        modifiers=(MEMORY,),
        failures={"skipped": "`when` kept a node of a selector from starting"},
        others=("fallback", "priority", "reactive_fallback", "reactivefallback"),
    )

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success when one can, with failure when all can."""
        parts = [known.of(child, skip_fails=True) for child in self.children]
        can_succeed = any(part.can_succeed for part in up_to(parts, lambda part: not part.can_fail))
        if not parts or not all(part.can_fail for part in parts):
            return NodeOutcomes(can_succeed, NO_CODES)
        # It fails as the last one did; one that was skipped may leave the word to those before it.
        return NodeOutcomes(can_succeed, codes_of(parts) if "skipped" in parts[-1].codes else parts[-1].codes)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the composite, with memory or without."""
        from florence_bt.behaviours import composites

        if self.memory:
            return composites.Selector(name, True, builder.children(self.children, skipped_fails=True))
        return composites.ReactiveSelector(name, *builder.watching(self, skipped_fails=True))
