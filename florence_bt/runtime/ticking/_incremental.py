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
from florence_bt.runtime.ticking._table import Functions, Halt, Table, Tick, Visit
from florence_bt.runtime.ticking._ways import common_way, only_way, starts_anew


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
        self._waiting: list[Record] = []
        self._ticking = False
        self._disturbed = False
        self._full: dict[type, Functions] = {}

    def learn(self, node: Behaviour) -> None:
        """Make the functions for the class of a node, and let the records decide about their use."""
        cls = node.__class__
        self._full[cls] = self._functions_of(self, node)
        known, meet = self.records.get, self._meet
        self.ticks[cls] = lambda node: (known(id(node)) or meet(node)).keeper.tick()
        if maker_of(self, node) in RESUMING:
            self.halts[cls] = lambda node: (known(id(node)) or meet(node)).keeper.halt()
        else:
            self.halts[cls] = self._forgetting(self._full[cls][1])

    def _forgetting(self, full_halt: Halt) -> Halt:
        known = self.records.get

        def halt(node: Any) -> None:
            record = known(id(node))
            if record is not None:
                record.state = OPEN
            full_halt(node)

        return halt

    def root_tick(self, root: Behaviour) -> Tick:
        """What ticks the whole tree."""
        return self._tick_tree

    def _tick_tree(self, root: Behaviour) -> Status:
        record = self.record_of(root)
        self._ticking, self._disturbed = True, False
        try:
            top = self._open_ways(record)
            if top is None:
                return root.status
            if top is not record:
                self._tick_from(top)
                return root.status
            status: Status = record.keeper.tick()
            return status
        finally:
            self._ticking = False

    def _open_ways(self, root: Record) -> Record | None:
        """Where the tick may begin, because nothing is new beside that and below; None: nothing is new.

        A sequence, selector or parallel above that place would do nothing before it has answered, and
        nothing afterwards either when the answer is the old one.
        """
        waiting = self._waiting[:]
        del self._waiting[: len(waiting)]  # not what another thread has added since
        if self.visit is None and root.state == CLEAN and root.node.status is not INVALID:
            if len(waiting) == 1:
                return only_way(waiting[0], root)
            for touched in waiting:
                touched.open_way()
            return common_way(root)
        for touched in waiting:
            touched.open_way()
        return root

    def _tick_from(self, top: Record) -> None:
        """Tick a part of the tree, then what stands above it as far as something changes."""
        if starts_anew(top.parent):
            top.renew()
        before = top.node.status
        try:
            new: Status = top.keeper.tick()
            if new is not before or top.state != CLEAN or self._disturbed:
                self._climb(top, before, new)
        except BaseException:
            top.doubt()
            raise

    def _climb(self, record: Record, before: Status, new: Status) -> None:
        """Let the composites above a node go on behind it, where its answer is new to them."""
        while (above := record.parent) is not None:
            old = above.node.status
            if new is before and record.state == CLEAN and above.state == CLEAN:
                new = old
            else:
                above.renewed = starts_anew(above.parent)
                new = above.keeper.go_on(record.index, new)
            record, before = above, old

    def _on_touch(self, record: Record) -> None:
        if self._ticking:
            self._disturbed = True
            record.open_way()
        else:
            self._waiting.append(record)

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
        self._waiting.clear()
        self._full.clear()

    def _meet(self, node: Behaviour) -> Record:
        self.tick_of(node)  # learns the class
        record = self.records[id(node)] = Record(node, self._on_touch)
        record.parent = self.records.get(id(node.parent))
        if isinstance(node, Reactive):
            node.on_touch = record.touch
        maker = maker_of(self, node)
        if maker in RESUMING:
            record.keeper = RESUMING[maker](node, self, record)
        else:
            record.keeper = PassingOver(
                record, self._full[node.__class__][0], settled_of(node, maker, self), self
            )
        return record


class PassingOver:
    """Ticks a leaf, a decorator or a composite of our own unless it is clean.

    Args:
        record: The record of the node.
        full_tick: How the node is ticked.
        settled: Whether another tick would change nothing, asked right after one; None: it always might.
        table: The records of the other nodes.
    """

    __slots__ = ("_full_tick", "_record", "_settled", "_table")

    def __init__(
        self,
        record: Record,
        full_tick: Tick,
        settled: Callable[[], bool] | None,
        table: IncrementalTable,
    ) -> None:
        self._record = record
        self._full_tick = full_tick
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
