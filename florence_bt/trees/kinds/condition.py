"""``condition``: succeeds when an expression holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.trees.kinds.modifiers import CODE
from florence_bt.trees.language.expressions.compiling import constant_of
from florence_bt.trees.language.model import Expression, Node
from florence_bt.trees.language.node_kind import NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import EXPRESSION

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

CONDITION_FALSE = "condition_false"
"""The code of a ``condition`` that names none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Condition(Node):
    """Succeeds when an expression holds, and fails when it does not.

    Attributes:
        condition: The expression.
    """

    kind: ClassVar = NodeKind(
        word="condition",
        about="succeeds when an expression holds",
        symbol="◇",
        value=EXPRESSION,
        example="- condition: $found",
        modifiers=(CODE,),
        failures={CONDITION_FALSE: "the expression of a `condition` does not hold"},
        others=("check", "assert"),
    )

    condition: Expression

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the expression."""
        condition, fields = form.reader.expression(form.value, "condition"), form.fields
        return cls(condition=condition, **fields) if condition is not None else None

    @property
    def default_title(self) -> str:
        """The expression itself, such as ``$distance < 1 m``."""
        return self.condition.text

    def asked(self) -> tuple[Expression, ...]:
        """Return the expression."""
        return (self.condition,)

    def check(self, checks: NodeChecks) -> None:
        """Check that the expression is true or false."""
        checks.condition(self.condition, "condition")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: one way only where the expression has always the same value."""
        fixed = constant_of(self.condition)
        own = {self.own_failure(CONDITION_FALSE)} if fixed is not True else NO_CODES
        return NodeOutcomes(fixed is not False, known.of_expression(self.condition) | own)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the leaf."""
        from florence_bt.behaviours import leaves

        code = self.own_failure(CONDITION_FALSE)
        return leaves.Condition(name, builder.context, builder.condition(self.condition), code)
