"""What the functions that tick the nodes of one tree share: how each class is ticked and stopped, the record.

Every class of nodes gets two plain functions, made by its maker (:mod:`._dispatch`) when a node of it is met
for the first time: one that ticks a node and one that stops it with INVALID. Nothing is kept per node, so a
tree may change its shape at any moment, and a large tree stays in the caches of the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, overload

from py_trees.behaviour import Behaviour
from py_trees.common import Status

Tick = Callable[[Any], Status]
"""Ticks a node with what is below it; the node's new status."""
Halt = Callable[[Any], None]
"""Stops a node with what is below it: ``node.stop(Status.INVALID)``."""
StatusChange = tuple[Behaviour, Status, Status]
"""A node, its status before and its status after."""
Visit = Callable[[Behaviour], None]
Functions = tuple[Tick, Halt]


class Changes(Sequence[StatusChange]):
    """Changes of statuses in their order.

    Stored flat: a list of many small tuples would keep the garbage collector busy.
    """

    def __init__(self) -> None:
        self.flat: list[Any] = []

    def __len__(self) -> int:
        return len(self.flat) // 3

    @overload
    def __getitem__(self, index: int) -> StatusChange: ...
    @overload
    def __getitem__(self, index: slice) -> list[StatusChange]: ...
    def __getitem__(self, index: int | slice) -> StatusChange | list[StatusChange]:
        if isinstance(index, slice):
            return list(self)[index]
        first = 3 * range(len(self))[index]
        node, old, new = self.flat[first : first + 3]
        return node, old, new

    def __iter__(self) -> Iterator[StatusChange]:
        flat = iter(tuple(self.flat))
        return zip(flat, flat, flat, strict=True)


class Table:
    """The functions for the nodes of one tree.

    Args:
        functions_of: Makes the two functions for the class of a node.
        record: Whether every change of a status is noted in :attr:`changes`.
        visit: Called with each node when its tick is over, in the order in which py_trees yields them.

    Attributes:
        ticks: How a node is ticked, by its class.
        halts: How a node is stopped, by its class.
        changes: The changes since they were cleared.
        note: Takes one change; None when nobody wants to know.
        odd: Classes of which some node has methods of its own.
        root: The root of the tree.
        abandoned: Generators of nodes with ways of their own that nobody asked for more in this tick.
        places: The last place in a long row of children, by the ``id`` of the parent; a hint only.
    """

    def __init__(
        self, functions_of: Callable[[Table, Behaviour], Functions], record: bool, visit: Visit | None
    ) -> None:
        self.visit = visit
        self.ticks: dict[type, Tick] = {}
        self.halts: dict[type, Halt] = {}
        self.changes = Changes()
        self.note: Callable[[StatusChange], None] | None = self.changes.flat.extend if record else None
        self.places: dict[int, int] = {}
        self.odd: frozenset[type] = frozenset()
        self.root: Behaviour | None = None
        self.abandoned: list[Iterator[Behaviour]] = []
        self._functions_of = functions_of

    def root_tick(self, root: Behaviour) -> Tick:
        """What ticks the whole tree."""
        return self.tick_of(root)

    def tick_of(self, node: Behaviour) -> Tick:
        """What ticks nodes of this node's class, made now when it is new."""
        if node.__class__ not in self.ticks:
            self.learn(node)
        return self.ticks[node.__class__]

    def halt_of(self, node: Behaviour) -> Halt:
        """What stops nodes of this node's class, made now when it is new."""
        if node.__class__ not in self.halts:
            self.learn(node)
        return self.halts[node.__class__]

    def learn(self, node: Behaviour) -> None:
        """Make the functions for the class of a node."""
        self.ticks[node.__class__], self.halts[node.__class__] = self._functions_of(self, node)

    def forget(self) -> None:
        """Make all functions anew when they are needed next."""
        self.ticks.clear()
        self.halts.clear()
        self.places.clear()

    def change(self, node: Behaviour, new: Status) -> None:
        """Give a node another status."""
        if self.note is not None:
            self.note((node, node.status, new))
        node.status = new

    def watch(self, nodes: Sequence[Behaviour], action: Callable[[], Any]) -> Any:
        """Let somebody else tick or stop nodes, and note what that changed in them and below."""
        if self.note is None:
            return action()
        before = level_by_level(nodes)
        statuses = [node.status for node in before]
        try:
            return action()
        finally:
            after = level_by_level(nodes)
            if len(after) != len(before) or [node.status for node in after] != statuses:
                self._tell(nodes, {id(node): old for node, old in zip(before, statuses, strict=True)})

    def _tell(self, roots: Sequence[Behaviour], before: dict[int, Status]) -> None:
        """Note how nodes and those below differ from what they were."""
        assert self.note is not None
        for root in roots:
            for node in nodes_of(root):
                old = before.get(id(node), Status.INVALID)
                if node.status is not old:
                    self.note((node, old, node.status))


def level_by_level(roots: Sequence[Behaviour]) -> list[Behaviour]:
    """Every node, those nearer to the roots first: the quickest way to meet them all."""
    found = list(roots)
    for node in found:
        if node.children:
            found += node.children
    return found


def nodes_of(root: Behaviour) -> Iterator[Behaviour]:
    """Every node, children before their parents as ``root.iterate()`` has them, however deep the tree is."""
    waiting: list[tuple[Behaviour, bool]] = [(root, False)]
    while waiting:
        node, entered = waiting.pop()
        if entered or not node.children:
            yield node
        else:
            waiting.append((node, True))
            waiting.extend((child, False) for child in reversed(node.children))
