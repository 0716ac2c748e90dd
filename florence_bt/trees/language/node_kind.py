"""What a kind of node says about itself: the record beside its node, and what builds a node of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from florence_bt.core.declaration import Kind, Port

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.behaviours.context import TreeContext
    from florence_bt.behaviours.expressions import CompiledExpression
    from florence_bt.trees.language.model import Expression, Literal, Node, Value


@dataclass(frozen=True, slots=True)
class Modifier:
    """A word beside the kind key of a node.

    Attributes:
        word: The word.
        about: What it does, for people.
        value: The JSON Schema of what stands behind it.
    """

    word: str
    about: str
    value: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class NodeKind:
    """The facts about a kind of node that are the same for all its nodes.

    Attributes:
        word: The kind key.
        about: What the node does, for people.
        symbol: A sign for it in drawings.
        value: The JSON Schema of what stands behind the kind key.
        example: A node of it, as the palette of the editor inserts it.
        modifiers: The modifiers that it takes beside those that every node has, in the order of the manual.
        needed: The modifiers that it cannot be without.
        argument: How the value before a ``do`` is written, for messages.
        failures: The codes of failures that are its own -> what they mean.
        others: What other languages and people call it.
    """

    word: str
    about: str
    symbol: str
    value: Mapping[str, Any]
    example: str
    modifiers: tuple[Modifier, ...] = ()
    needed: tuple[str, ...] = ()
    argument: str = ""
    failures: Mapping[str, str] = field(default_factory=dict)
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Demand:
    """What a node demands of a value that it reads.

    Attributes:
        value: The value.
        what: What it is called in messages.
        port: What it must be; None: anything will do.
    """

    value: Value
    what: str
    port: Port | None = None


class TreeBuilder(Protocol):
    """What a node is given to be built with, for one call of one mission.

    A skipped node counts as failure where another one is tried then, or asked again. A node that has only
    this one to do is skipped with it, so this is seen through.
    """

    @property
    def context(self) -> TreeContext:
        """What the nodes of the tree share, with the keys as they are seen here."""
        ...

    def node(self, node: Node, *, skipped_fails: bool) -> Behaviour:
        """Build a node below, with its guards and its clean-up."""

    def inside(self, node: Node, part: Node) -> TreeBuilder:
        """Return what builds a part of a node: with the keys that belong to it."""

    def keep_watched(self) -> None:
        """Keep what is watched here from being asked anew before it has ended."""

    def value(self, value: Value, kind: Kind | None) -> Any:
        """Return a value in SI units, or a value source."""

    def condition(self, expression: Expression) -> CompiledExpression:
        """Compile an expression that is true or false."""

    def codes(self, words: Iterable[Literal]) -> frozenset[str]:
        """Return the codes that some codes and groups stand for."""

    def titled(self, node: Node, behaviour: Behaviour, value: Any, kind: Kind | None) -> Behaviour:
        """Let a dump show the value that stands in a title as ``$key``, once it is known."""

    def numbered(self, siblings: list[Behaviour]) -> list[Behaviour]:
        """Give numbers to siblings with equal names, so that every path is unique."""
