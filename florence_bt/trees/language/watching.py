"""Which nodes a composite without memory watches while a later node runs."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.trees.language import model
from florence_bt.trees.language.model import Node


def guards_of(node: Node) -> tuple[Node, ...]:
    """Return the nodes below a node that it asks again while another one runs."""
    match node:
        case (
            model.Sequence(children=children, memory=False) | model.Selector(children=children, memory=False)
        ):
            return children[:-1]
        case model.If(condition=Node() as condition, memory=False):
            return (condition,)
    return ()


def passes_on(node: Node) -> bool:
    """Tell whether a node that is watched has the nodes below it watched: ``once`` keeps its first result."""
    return not isinstance(node, model.Once)


def is_condition(node: model.RunSkill, declaration: SkillDeclaration) -> bool:
    """Tell whether a skill is asked again where it is watched: it answers at once, or `every` says so."""
    return declaration.instant or node.every is not None


def unwatched(node: Node, *, watched: bool = False) -> Iterator[model.RunSkill]:
    """Yield every skill of a tree that is not asked again.

    Args:
        node: The root.
        watched: Whether a node above it watches it.
    """
    if isinstance(node, model.RunSkill) and not watched:
        yield node
    guards = set(guards_of(node))
    if isinstance(node, model.Until | model.WaitUntil | model.Interruptible):
        guards.add(node.goal)
    watched = watched and passes_on(node)
    for part in node.parts:
        yield from unwatched(part, watched=watched or part in guards)
    if node.cleanup is not None:
        yield from unwatched(node.cleanup)


def asked_first(node: Node) -> Node:
    """Return the node whose answer a condition is, below what only turns, repeats or limits it."""
    while isinstance(node, model.Wrapper) and passes_on(node) and not node.guards:
        node = node.child
    return node
