"""Nodes that a composite without memory watches while a later node runs."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.model import Node


def unwatched(node: Node, *, watched: bool = False) -> Iterator[kinds.RunSkill]:
    """Yield every skill of a tree that is not asked again.

    Args:
        node: The root.
        watched: Whether a node above it watches it.
    """
    if isinstance(node, kinds.RunSkill) and not watched:
        yield node
    guards = set(node.watched)
    if isinstance(node, kinds.Until | kinds.WaitUntil | kinds.Interruptible):
        guards.add(node.goal)
    watched = watched and node.passes_on
    for part in node.parts:
        yield from unwatched(part, watched=watched or part in guards)
    if node.cleanup is not None:
        yield from unwatched(node.cleanup)


def asked_first(node: Node) -> Node:
    """Return the node whose answer a condition is, below what only turns, repeats or limits it."""
    while isinstance(node, model.Wrapper) and node.passes_on and not node.guards:
        node = node.child
    return node
