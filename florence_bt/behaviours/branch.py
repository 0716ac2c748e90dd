"""A branch of a tree that is built when it is first reached. A stand-in shows until then what it will be.

Most runs reach few of the missions that they may call, and building a node takes longer than ticking it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch that is not built yet.

    Attributes:
        build: Builds it.
        stand_in: The same branch of a tree that is never ticked and that many runs may share: every node has
            the name, the path and the id that the node will have that is built in its place.
    """

    build: Callable[[], Behaviour]
    stand_in: Behaviour

    def grow(self) -> Behaviour:
        """Build it."""
        built = self.build()
        take_ids(built, self.stand_in)
        return built


def take_ids(tree: Behaviour, twin: Behaviour) -> None:
    """Give the nodes of a tree the ids of the nodes of another one that was built in the same way."""
    todo = [(tree, twin)]
    while todo:
        node, other = todo.pop()
        if node is not other:  # a stand-in has them already
            node.id = other.id
            todo += zip(node.children, other.children, strict=True)
