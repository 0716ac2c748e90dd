"""``once``: its first result stays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.language.model import Wrapper
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, skipped_with
from florence_bt.trees.language.value_schemas import NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Once(Wrapper):
    """Does the node below once and keeps its result."""

    kind: ClassVar = NodeKind(
        word="once",
        about="runs a node once and keeps its result",
        symbol="①",
        value=NODE,
        example="- once:\n    wait: 1 s",
        others=("run_once",),
    )
    passes_on: ClassVar = False

    @property
    def default_title(self) -> str:
        """Such as ``once say hello``."""
        return f"once {self.child.title}"

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the node below."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        return skipped_with(child, child, skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the decorator."""
        from florence_bt.behaviours import decorators

        return decorators.Once(name, builder.child(self, skipped_fails))
