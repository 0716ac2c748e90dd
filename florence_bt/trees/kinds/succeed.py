"""``succeed``: a failure counts as success."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.language.model import Wrapper
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Succeed(Wrapper):
    """Does the node below, and succeeds when it fails, too."""

    kind: ClassVar = NodeKind(
        word="succeed",
        about="runs a node and counts its failure as success",
        symbol="✓",
        value=NODE,
        example="- succeed:\n    wait: 1 s",
        others=("force_success",),
    )
    skipped_with_child: ClassVar = False

    @property
    def default_title(self) -> str:
        """Such as ``try say hello``."""
        return f"try {self.child.title}"

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success, if the node below ends at all."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        return NodeOutcomes(child.can_succeed or child.can_fail, NO_CODES)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the decorator."""
        from florence_bt.behaviours import decorators

        return decorators.ForceSuccess(name, builder.child(self, skipped_fails))
