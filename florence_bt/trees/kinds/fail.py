"""``fail``: fails with a reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.kinds.modifiers import CODE
from florence_bt.trees.language.model import Node, Value, show
from florence_bt.trees.language.node_kind import NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import TEXT

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

FAILED = "failed"
"""The code of ``fail`` when it names none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fail(Node):
    """Fails.

    Attributes:
        reason: Why, for people.
    """

    kind: ClassVar = NodeKind(
        word="fail",
        about="fails with a reason",
        symbol="✗",
        value=TEXT,
        example="- fail: nobody is at home",
        modifiers=(CODE,),
        failures={FAILED: "`fail` without a code"},
        others=("abort",),
    )

    reason: Value

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the reason."""
        reason, fields = form.reader.template(form.value, "fail"), form.fields
        return cls(reason=reason, **fields) if reason is not None else None

    @property
    def details(self) -> tuple[str, ...]:
        """The reason."""
        return (show(self.reason),)

    @property
    def reads(self) -> tuple[Value, ...]:
        """The reason."""
        return (self.reason,)

    def check(self, checks: NodeChecks) -> None:
        """Check the reason."""
        checks.text(self.reason, "fail")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with failure."""
        return NodeOutcomes(False, known.of_value(self.reason) | {self.own_failure(FAILED)})

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the leaf."""
        from florence_bt.behaviours import leaves

        return leaves.Fail(name, builder.context, builder.text(self.reason), self.own_failure(FAILED))
