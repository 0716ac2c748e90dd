"""``if``: one of two branches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.plain_yaml import YamlMapping
from florence_bt.trees.kinds.modifiers import MEMORY
from florence_bt.trees.language.expressions.compiling import constant_of
from florence_bt.trees.language.model import Expression, Node
from florence_bt.trees.language.node_kind import Modifier, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, SUCCEEDS, MissionOutcomes, NodeOutcomes, codes_of
from florence_bt.trees.language.value_schemas import EXPRESSION, NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class If(Node):
    """Does one of two nodes.

    Attributes:
        condition: What is asked: an expression, or a node whose success means yes.
        then: What is done when the condition holds.
        otherwise: ``else``: what is done when it does not; None: nothing, which is a success.
        memory: Whether it is decided once, at the start; else again with every tick.
    """

    kind: ClassVar = NodeKind(
        word="if",
        about="runs one of two nodes",
        symbol="◇",
        value={"anyOf": [EXPRESSION, NODE]},
        example="- if: $found\n  then:\n    wait: 1 s",
        modifiers=(
            Modifier("then", "the node to run when the condition holds", NODE, never_input=True),
            Modifier("else", "the node to run when the condition does not hold", NODE, never_input=True),
            MEMORY,
        ),
        needed=("then",),
    )

    condition: Expression | Node
    then: Node
    otherwise: Node | None = None
    memory: bool = True

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the condition and the branches."""
        condition: Expression | Node | None
        if isinstance(form.value, YamlMapping):
            condition = form.reader.node(form.value)
        else:
            condition = form.reader.expression(form.value, "if", or_node=True)
        then, otherwise = form.child("then"), form.optional_child("else")
        fields, memory = form.fields, form.memory()
        if condition is None or then is None:
            return None
        return cls(condition=condition, then=then, otherwise=otherwise, memory=memory, **fields)

    @property
    def parts(self) -> tuple[Node, ...]:
        """The condition if it is a node, and the branches."""
        condition = (self.condition,) if isinstance(self.condition, Node) else ()
        return (*condition, self.then, *((self.otherwise,) if self.otherwise is not None else ()))

    @property
    def default_title(self) -> str:
        """Such as ``if $distance < 1 m``."""
        asked = self.condition.title if isinstance(self.condition, Node) else self.condition.text
        return f"if {asked}"

    @property
    def edges(self) -> tuple[str, ...]:
        """Name each part: the condition, and what is done when it holds or does not."""
        return ("if", "then", "else")[0 if isinstance(self.condition, Node) else 1 :][: len(self.parts)]

    @property
    def details(self) -> tuple[str, ...]:
        """Say whether it has memory."""
        return () if self.memory else ("without memory",)

    # ---- keys and values ------------------------------------------------------------------------------

    def asked(self) -> tuple[Expression, ...]:
        """Return the condition, if it is an expression."""
        return (self.condition,) if isinstance(self.condition, Expression) else ()

    @property
    def watched(self) -> tuple[Node, ...]:
        """The condition if it is a node, without memory."""
        return (self.condition,) if isinstance(self.condition, Node) and not self.memory else ()

    def check(self, checks: NodeChecks) -> None:
        """Check that the condition is true or false."""
        if isinstance(self.condition, Expression):
            checks.condition(self.condition, "if")

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the branches do that can be chosen."""
        then = known.of(self.then, skip_fails=skip_fails)
        other = known.of(self.otherwise, skip_fails=skip_fails) if self.otherwise is not None else SUCCEEDS
        if isinstance(self.condition, Expression):
            fixed, codes = constant_of(self.condition), known.of_expression(self.condition)
        else:
            asked, codes = known.of(self.condition, skip_fails=True), NO_CODES
            fixed = None if asked.can_succeed and asked.can_fail else asked.can_succeed
        ways = [then, other] if fixed is None else [then if fixed else other]
        skips = any(way.can_skip for way in ways)
        return NodeOutcomes(any(way.can_succeed for way in ways), codes_of(ways) | codes, can_skip=skips)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the condition and both branches."""
        from florence_bt.behaviours import branching

        parts, watches = builder.watching(self, skipped_fails=skipped_fails)
        asked = self.condition
        condition = parts.pop(0) if isinstance(asked, Node) else builder.condition(asked)
        watch = watches[0] if watches else None
        return branching.If(name, builder.context, condition, *parts, memory=self.memory, watch=watch)

    def fails_when_skipped(self, part: Node, skipped_fails: bool) -> bool:
        """Tell that a question which is skipped is answered with no."""
        return skipped_fails or part is self.condition
