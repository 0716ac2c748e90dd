"""The ticker: ticks a tree of py_trees with the same outcome as py_trees, only much faster."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from py_trees import logging
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.runtime.ticking._dispatch import functions_of, is_odd
from florence_bt.runtime.ticking._incremental import IncrementalTable
from florence_bt.runtime.ticking._leaves import make_unknown
from florence_bt.runtime.ticking._table import Changes, Table, Visit

INFO = logging.Level.INFO
SHALLOW = 100
"""Trees up to this depth are ticked without a look at the interpreter's limit of nested calls."""
CALLS_PER_LEVEL = 8


class Ticker:
    """Ticks the tree below a root; the tree stays an ordinary tree of py_trees.

    Args:
        root: The root of the tree.
        record: Whether :attr:`changes` tells every change of a status.
        incremental: Whether nodes for which nothing is new are passed over (``behaviours.reactive`` has the
            contract). Whoever then changes the shape of the tree between two ticks says so with
            :meth:`rebuild`, and whoever stops a node from outside with :meth:`touch`; for the root that is
            not needed.
        visit: Called with each node that was ticked, when its tick is over.

    Attributes:
        count: How many ticks there were.
    """

    def __init__(
        self,
        root: Behaviour,
        *,
        record: bool = False,
        incremental: bool = False,
        visit: Visit | None = None,
    ) -> None:
        self.count = 0
        self._root = root
        self._table = (IncrementalTable if incremental else Table)(functions_of, record, visit)
        self._table.root = root
        self._abandoned = self._table.abandoned
        self._record = self._table.changes.flat if record else None
        self.rebuild()

    @property
    def root(self) -> Behaviour:
        """The root of the tree."""
        return self._root

    @property
    def changes(self) -> Changes:
        """What the last tick changed, in order; only when recording.

        What somebody else changed between two ticks is not told: stop the tree with :meth:`stop`.
        """
        return self._table.changes

    def tick(self) -> Status:
        """Tick once.

        Returns:
            The new status of the root.
        """
        if self._record is not None:
            self._record.clear()
        self.count += 1
        try:
            if self._depth <= SHALLOW and logging.level >= INFO:
                return self._tick_root(self._root)
            return self._tick_specially()
        finally:
            if self._abandoned:
                self._abandoned.clear()

    def _tick_specially(self) -> Status:
        if logging.level < INFO:
            # Who has set the logging of py_trees to DEBUG wants to read what py_trees itself says.
            self.rebuild()
            return make_unknown(self._table, self._root)[0](self._root)
        with deep_calls(self._depth):
            return self._tick_root(self._root)

    def stop(self) -> None:
        """Stop the whole tree with INVALID; when recording, :attr:`changes` tells what that changed."""
        if self._record is not None:
            self._record.clear()
        with deep_calls(self._depth):
            self._table.halt_of(self._root)(self._root)

    def touch(self, node: Behaviour) -> None:
        """Look at a node, and at those above it, with the next tick, although they may be settled."""
        if isinstance(self._table, IncrementalTable):
            self._table.touch(node)

    def rebuild(self) -> None:
        """Look at every node afresh: for who has replaced methods of nodes, or changed the shape of a tree
        that is ticked incrementally.
        """
        table = self._table
        table.forget()
        self._depth = 0
        odd: set[type] = set()
        level = [self._root]
        while level:
            self._depth += 1
            odd.update(type(node) for node in level if is_odd(node))
            level = [child for node in level for child in node.children]
        table.odd = frozenset(odd)
        self._tick_root = table.root_tick(self._root)


@contextmanager
def deep_calls(depth: int) -> Iterator[None]:
    """Allow as many nested calls as a tree of some depth needs, on top of what is allowed already."""
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(limit + CALLS_PER_LEVEL * depth)
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)
