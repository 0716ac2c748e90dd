"""Which nodes a composite without memory watches while a later node runs."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.trees.language import model
from florence_bt.trees.language.model import Node


def guards_of(node: Node) -> tuple[Node, ...]:
    """The nodes below a node that it asks again while another one runs."""
    match node:
        case (
            model.Sequence(children=children, memory=False) | model.Selector(children=children, memory=False)
        ):
            return children[:-1]
        case model.If(condition=Node() as condition, memory=False):
            return (condition,)
    return ()


def passes_on(node: Node) -> bool:
    """Whether a node that is watched has the nodes below it watched.

    What repeats a node, delays it or keeps its result asks when it means to.
    """
    return not isinstance(node, model.Retry | model.Repeat | model.Once | model.Cooldown | model.Delay)


def is_condition(node: model.RunSkill, declaration: SkillDeclaration) -> bool:
    """Whether a skill is asked again where it is watched: it answers at once, or `every` says so."""
    return declaration.instant or node.every is not None


def unwatched(
    node: Node, *, watched: bool = False, below: Node | None = None
) -> Iterator[tuple[model.RunSkill, Node | None]]:
    """Every skill of a tree that is not asked again.

    Args:
        node: The root.
        watched: Whether a node above it watches it.
        below: The node above it that keeps it from being watched.

    Yields:
        The skill; and the node that keeps one further up from watching it, or None.
    """
    if isinstance(node, model.RunSkill) and not watched:
        yield node, below
    guards = set(guards_of(node))
    if watched and not passes_on(node):
        watched, below = False, node
    for part in node.parts:
        if part in guards:
            yield from unwatched(part, watched=True)
        else:
            yield from unwatched(part, watched=watched, below=below)
    if node.cleanup is not None:
        yield from unwatched(node.cleanup)
