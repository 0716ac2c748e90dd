"""Nodes with several nodes below: sequence, selector, parallel, if, switch."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from florence_bt.trees.language.expressions.syntax import Expression
from florence_bt.trees.language.model.node import Node
from florence_bt.trees.language.model.values import Literal, Value, show
from florence_bt.trees.language.source import Position


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence(Node):
    """``sequence``: one after the other until one fails."""

    children: tuple[Node, ...]
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


@dataclass(frozen=True, slots=True, kw_only=True)
class Selector(Node):
    """``selector``: one after the other until one succeeds."""

    children: tuple[Node, ...]
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


class PolicyKind(enum.Enum):
    """When a parallel is done."""

    ALL = "all"
    """Succeeds when all have succeeded; fails at the first failure."""
    ANY = "any"
    """Succeeds at the first success; fails when all have failed."""
    SELECTED = "selected"
    """Succeeds when the named ones have succeeded; fails at the first failure of any branch."""
    COUNTED = "counted"
    """Succeeds and fails at given numbers; fails too when the successes are out of reach."""


@dataclass(frozen=True, slots=True)
class Policy:
    """``policy``: when a parallel is done.

    Attributes:
        kind: Which of the forms.
        names: The names of the branches that must succeed, when selected.
        succeed: The number of successes that are enough, when counted.
        fail: The number of failures that are too many, when counted; None when only the reach counts.
        position: Where it stands; None when nothing was written.
    """

    kind: PolicyKind = PolicyKind.ALL
    names: tuple[Literal, ...] = ()
    succeed: int | None = None
    fail: int | None = None
    position: Position | None = None

    def successes_needed(self, branches: int) -> int:
        """How many of so many branches must succeed."""
        match self.kind:
            case PolicyKind.ANY:
                return 1
            case PolicyKind.COUNTED if self.succeed is not None:
                return self.succeed
            case PolicyKind.SELECTED:
                return len(self.names)
        return branches

    def __str__(self) -> str:
        """As the author wrote it."""
        match self.kind:
            case PolicyKind.SELECTED:
                return f"[{', '.join(name.text for name in self.names)}]"
            case PolicyKind.COUNTED:
                fail = f", fail: {self.fail}" if self.fail is not None else ""
                return f"{{succeed: {self.succeed}{fail}}}"
        return self.kind.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Parallel(Node):
    """``parallel``: all at the same time; the policy says when it is done."""

    children: tuple[Node, ...]
    policy: Policy = Policy()

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children

    @property
    def any_is_enough(self) -> bool:
        """Whether the first success ends it."""
        return self.policy.successes_needed(len(self.children)) == 1 and self.policy.kind in (
            PolicyKind.ANY,
            PolicyKind.COUNTED,
        )

    @property
    def selected(self) -> tuple[Node, ...]:
        """The branches that the policy names, by title; names that fit none are left out."""
        wanted = {name.text for name in self.policy.names}
        return tuple(child for child in self.children if child.title in wanted)


@dataclass(frozen=True, slots=True, kw_only=True)
class If(Node):
    """``if``: one of two branches.

    Attributes:
        condition: What is asked: an expression, or a node whose success means yes.
        then: What is done when the condition holds.
        otherwise: ``else``: what is done when it does not; None: nothing, which is a success.
        memory: Whether it is decided once, at the start; else anew with every tick.
    """

    condition: Expression | Node
    then: Node
    otherwise: Node | None = None
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The condition if it is a node, and the branches."""
        condition = (self.condition,) if isinstance(self.condition, Node) else ()
        return (*condition, self.then, *((self.otherwise,) if self.otherwise is not None else ()))

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The guards, and the condition."""
        return (*self.guards, *((self.condition,) if isinstance(self.condition, Expression) else ()))

    @property
    def default_title(self) -> str:
        """Such as ``if $distance < 1 m``."""
        asked = self.condition.title if isinstance(self.condition, Node) else self.condition.text
        return f"if {asked}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch(Node):
    """``switch``: the branch whose case is equal to a value.

    Attributes:
        value: What is looked at, once, at the start.
        cases: The values, each with its branch.
        default: What is done when no case fits; None: the node fails then.
    """

    value: Value
    cases: tuple[tuple[Literal, Node], ...]
    default: Node | None = None

    @property
    def parts(self) -> tuple[Node, ...]:
        """The branches."""
        return (*(node for _, node in self.cases), *((self.default,) if self.default is not None else ()))

    @property
    def default_title(self) -> str:
        """Such as ``switch $mode``."""
        return f"switch {show(self.value)}"
