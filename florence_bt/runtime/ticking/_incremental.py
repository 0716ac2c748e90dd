"""The table of an incremental ticker: the same functions, and records that tell when to use them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from florence_bt.behaviours.reactive import Reactive
from florence_bt.runtime.ticking._dispatch import maker_of
from florence_bt.runtime.ticking._leaves import INVALID
from florence_bt.runtime.ticking._records import CLEAN, OPEN, Record
from florence_bt.runtime.ticking._resuming_parallel import RESUMING
from florence_bt.runtime.ticking._settled import settled_of
from florence_bt.runtime.ticking._table import Functions, Table, Visit


class IncrementalTable(Table):
    """A table in which every class is ticked by the records of its nodes.

    Attributes:
        records: The record of every node that was met, by the node's ``id``.
    """

    def __init__(
        self, functions_of: Callable[[Table, Behaviour], Functions], record: bool, visit: Visit | None
    ) -> None:
        super().__init__(functions_of, record, visit)
        self.records: dict[int, Record] = {}
        self._full: dict[type, Functions] = {}

    def learn(self, node: Behaviour) -> None:
        """Make the functions for the class of a node, and let the records decide about their use."""
        cls = node.__class__
        self._full[cls] = self._functions_of(self, node)
        known, meet = self.records.get, self._meet
        self.ticks[cls] = lambda node: (known(id(node)) or meet(node)).keeper.tick()
        self.halts[cls] = lambda node: (known(id(node)) or meet(node)).keeper.halt()

    def record_of(self, node: Behaviour) -> Record:
        """The record of a node, made now when it is met for the first time."""
        record = self.records.get(id(node))
        return self._meet(node) if record is None else record

    def adopt(self, child: Behaviour, parent: Record, index: int) -> Record:
        """The record of a child, which now knows its place."""
        record = self.record_of(child)
        record.parent, record.index = parent, index
        return record

    def touch(self, node: Behaviour) -> None:
        """Look at a node, and at those above it, again with the next tick."""
        above: Behaviour | None = node
        while above is not None and id(above) not in self.records:
            above = above.parent
        if above is not None:
            self.records[id(above)].doubt()

    def forget(self) -> None:
        """Know nothing any more: the next tick is a full one."""
        super().forget()
        self.records.clear()
        self._full.clear()

    def _meet(self, node: Behaviour) -> Record:
        self.tick_of(node)  # learns the class
        record = self.records[id(node)] = Record(node)
        record.parent = self.records.get(id(node.parent))
        if isinstance(node, Reactive):
            node.on_touch = record.touch
        maker = maker_of(self, node)
        if maker in RESUMING:
            record.keeper = RESUMING[maker](node, self, record)
        else:
            record.keeper = PassingOver(
                record, self._full[node.__class__], settled_of(node, maker, self), self
            )
        return record


class PassingOver:
    """Ticks a leaf, a decorator or a composite of our own unless it is clean.

    Args:
        record: The record of the node.
        functions: How the node is ticked and stopped.
        settled: Whether another tick would change nothing, asked right after one; None: it always might.
        table: The records of the other nodes.
    """

    __slots__ = ("_full_halt", "_full_tick", "_record", "_settled", "_table")

    def __init__(
        self,
        record: Record,
        functions: Functions,
        settled: Callable[[], bool] | None,
        table: IncrementalTable,
    ) -> None:
        self._record = record
        self._full_tick, self._full_halt = functions
        self._settled = settled
        self._table = table

    def tick(self) -> Status:
        """Tick the node unless it is clean."""
        record = self._record
        node: Any = record.node
        # A clean node at INVALID was stopped by somebody else.
        if record.state == CLEAN and node.status is not INVALID:
            status: Status = node.status
            return status
        if record.renewed and isinstance(node, Decorator):
            self._table.record_of(node.decorated).renew()
        record.state, record.touched, record.renewed = OPEN, False, False
        new = self._full_tick(node)
        if self._settled is not None and new is not INVALID and not record.touched and self._settled():
            record.state = CLEAN
        return new

    def halt(self) -> None:
        """Stop the node."""
        self._record.state = OPEN
        self._full_halt(self._record.node)
