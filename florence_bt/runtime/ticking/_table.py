"""How the nodes of one tree are ticked and stopped: two plain functions for each class of nodes.

The functions of a class are made when a node of the class is met for the first time. Nothing is kept per
node, so the tree may change its shape at any moment.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

RUNNING, SUCCESS, FAILURE, INVALID = Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID

Tick = Callable[[Any], Status]
"""Ticks a node with what is below it; returns the new status of the node."""
Halt = Callable[[Any], None]
"""Stops a node with what is below it: ``node.stop(Status.INVALID)``."""
StatusChange = tuple[Behaviour, Status, Status]
"""A node, its status before and its status after."""
Visit = Callable[[Behaviour], None]


class TickTable:
    """The functions for the nodes of one tree, and the changes of their statuses.

    Args:
        make: Makes both functions for a class.
        record: Whether every change of a status is kept in :attr:`changes`.
        visit: Called with each node when its tick is over, in the order in which py_trees yields them.

    Attributes:
        ticks: How a node is ticked, by its class.
        halts: How a node is stopped, by its class.
        changes: The changes since they were cleared, in order.
    """

    def __init__(
        self, make: Callable[[TickTable, type], tuple[Tick, Halt]], record: bool, visit: Visit | None
    ) -> None:
        self.record = record
        self.visit = visit
        self.changes: list[StatusChange] = []
        self.ticks: dict[type, Tick] = _ByClass(self._learn)
        self.halts: dict[type, Halt] = _ByClass(self._learn)
        self._make = make

    def _learn(self, cls: type) -> None:
        self.ticks[cls], self.halts[cls] = self._make(self, cls)

    def change(self, node: Behaviour, new: Status) -> None:
        """Give a node another status."""
        if self.record:
            self.changes.append((node, node.status, new))
        node.status = new

    def halt_from(self, children: Sequence[Behaviour], first: int) -> None:
        """Stop the children from an index on, except those at INVALID."""
        for child in children[first:]:
            if child.status is not INVALID:
                self.halts[child.__class__](child)

    def watch(self, nodes: Sequence[Behaviour], action: Callable[[], Any]) -> Any:
        """Let other code tick or stop nodes, and record what that changed in them and below."""
        if not self.record:
            return action()
        before = {node: node.status for node in _children_first(nodes)}
        try:
            return action()
        finally:
            for node in _children_first(nodes):
                old = before.get(node, INVALID)
                if node.status is not old:
                    self.changes.append((node, old, node.status))


class _ByClass(dict[type, Any]):
    """Functions by class; asks for those of a class that is new."""

    def __init__(self, learn: Callable[[type], None]) -> None:
        self._learn = learn

    def __missing__(self, cls: type) -> Any:
        self._learn(cls)
        return self[cls]


def _children_first(nodes: Sequence[Behaviour]) -> list[Behaviour]:
    """Nodes with all below them, children before their parents."""
    found: list[Behaviour] = []
    for node in nodes:
        if node.children:
            found += _children_first(node.children)
        found.append(node)
    return found
