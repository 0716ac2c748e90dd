"""What every node has, and the walk over a tree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from florence_bt.trees.language.expressions.syntax import Expression
from florence_bt.trees.language.model.values import Reasons
from florence_bt.trees.language.source import Position


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """What every node has.

    Attributes:
        position: Where its kind key stands.
        name: The name that the author gave, or None.
        reasons: ``because``, or None.
        cleanup: ``finally``, or None.
        when: ``when``: what must hold before the node starts, or None; the node is skipped otherwise.
        unless: ``unless``: what must not hold before the node starts, or None.
        holds: ``while``: what must hold all along, or None; the node fails otherwise.
    """

    position: Position
    name: str | None = None
    reasons: Reasons | None = None
    cleanup: Node | None = None
    when: Expression | None = None
    unless: Expression | None = None
    holds: Expression | None = None

    @property
    def parts(self) -> tuple[Node, ...]:
        """The nodes directly below, without the clean-up."""
        return ()

    @property
    def title(self) -> str:
        """The name for people."""
        return self.name or self.default_title

    @property
    def default_title(self) -> str:
        """A name made from the kind."""
        return type(self).__name__.lower()

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The conditions of the node itself: guards, and what ``if`` and ``condition`` ask."""
        return self.guards

    @property
    def guards(self) -> tuple[Expression, ...]:
        """``when``, ``unless`` and ``while``, those that are there."""
        return tuple(guard for guard in (self.when, self.unless, self.holds) if guard is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wrapper(Node):
    """A node with one node below."""

    child: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child."""
        return (self.child,)


def walk(node: Node) -> Iterator[Node]:
    """A node and every node below it, clean-ups included, in the order of the file."""
    yield node
    for part in node.parts:
        yield from walk(part)
    if node.cleanup is not None:
        yield from walk(node.cleanup)
