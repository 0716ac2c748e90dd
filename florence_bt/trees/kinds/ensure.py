"""``ensure``: a condition that the success of a node must meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from florence_bt.trees.kinds.sequence import Sequence
from florence_bt.trees.language.node_kind import NodeKind
from florence_bt.trees.language.value_schemas import EXPRESSION

NOT_ENSURED = "not_ensured"
"""The code of an ``ensure`` that names none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensure(Sequence):
    """Does a node, and asks then whether a condition holds."""

    kind: ClassVar = NodeKind(
        word="ensure",
        about="must hold when the node has succeeded; it has failed otherwise",
        symbol="≟",
        value=EXPRESSION,
        failures={NOT_ENSURED: "a node succeeded, and its `ensure` does not hold"},
    )

    @property
    def default_title(self) -> str:
        """As the node."""
        return self.children[0].title
