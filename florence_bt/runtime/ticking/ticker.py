"""The ticker: ticks a tree of py_trees with the same outcome as py_trees, but faster, and records changes."""

from __future__ import annotations

from typing import Any

from py_trees import composites, decorators, logging
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.decorators import PreparedDecorator
from florence_bt.behaviours.stepping import Stepping
from florence_bt.runtime.ticking._composites import (
    make_parallel,
    make_selector,
    make_sequence,
    make_stepping,
)
from florence_bt.runtime.ticking._nodes import (
    make_decorator,
    make_leaf,
    make_own,
    make_prepared_decorator,
    visited,
)
from florence_bt.runtime.ticking._table import Halt, StatusChange, Tick, TickTable, Visit

INFO = logging.Level.INFO
MAKERS = {
    (Behaviour.tick, Behaviour.stop): make_leaf,
    (composites.Sequence.tick, composites.Sequence.stop): make_sequence,
    (composites.Selector.tick, composites.Selector.stop): make_selector,
    (composites.Parallel.tick, composites.Parallel.stop): make_parallel,
    (decorators.Decorator.tick, decorators.Decorator.stop): make_decorator,
    (PreparedDecorator.tick, decorators.Decorator.stop): make_prepared_decorator,
}
"""What makes the functions for a class, by its ``tick`` and ``stop``."""


class Ticker:
    """Ticks the tree below a root; the tree stays an ordinary tree of py_trees.

    Args:
        root: The root of the tree.
        record: Whether :attr:`changes` has every change of a status.
        visit: Called with each node that was ticked, when its tick is over.

    Attributes:
        root: The root of the tree.
        count: How many ticks there were.
    """

    def __init__(self, root: Behaviour, *, record: bool = False, visit: Visit | None = None) -> None:
        self.root = root
        self.count = 0
        self._table = TickTable(_functions_of, record, visit)
        self._py_trees_tick, _ = make_own(self._table, type(root))

    @property
    def changes(self) -> tuple[StatusChange, ...]:
        """What the last tick changed, in order; only when recording.

        What other code changed between two ticks is not in it: stop the tree with :meth:`stop`.
        """
        return tuple(self._table.changes)

    def tick(self) -> Status:
        """Tick once.

        Returns:
            The new status of the root.
        """
        root, table = self.root, self._table
        table.changes.clear()
        self.count += 1
        if logging.level < INFO:
            return self._py_trees_tick(root)  # with the debug texts of py_trees
        return table.ticks[root.__class__](root)

    def stop(self) -> None:
        """Stop the whole tree with INVALID; when recording, :attr:`changes` has what that changed."""
        self._table.changes.clear()
        self._table.halts[self.root.__class__](self.root)


def _functions_of(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """How nodes of a class are ticked and stopped."""
    if cls.tick is Stepping.tick:
        make = make_stepping
    else:
        make = MAKERS.get((cls.tick, cls.stop), make_own)
    tick, halt = make(table, cls)
    if table.visit is not None and make is not make_own:
        tick = visited(tick, table.visit)
    return tick, halt
