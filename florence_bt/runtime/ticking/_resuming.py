"""Sequences and selectors that go on where something changed instead of asking all their children again.

The children before the one that decided (``last``) have all answered "go on". As long as they are clean they
would answer the same again, so only those that were touched, and those that are never settled, are ticked:
they wait in ``pending``. When one of them answers differently, the rest goes as in py_trees.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from heapq import heappop
from typing import Any

from py_trees.common import Status

from florence_bt.runtime.ticking._composites import Stop, begin, halt_from, make_stop, starts_with_reset
from florence_bt.runtime.ticking._leaves import FAILURE, INVALID, RUNNING, SUCCESS, overrides
from florence_bt.runtime.ticking._records import CLEAN, OPEN, TOUCHED, Record
from florence_bt.runtime.ticking._table import Table


class Resuming(ABC):
    """What all composites that resume have in common.

    Args:
        node: The composite.
        table: The functions of the other nodes; it has a record of each.
        record: The record of this node.
    """

    resets = True
    """Whether the node resets its children when it starts anew."""

    def __init__(self, node: Any, table: Any, record: Record) -> None:
        self.node = node
        self.table = table
        self.record = record
        record.opaque = False
        self.pending: list[int] = []
        record.pending = self.pending
        self.kids: list[Record] = []
        self.later: list[int] = []
        self.renews = False
        self.left = INVALID
        self.last = -1
        self.top = -1
        self.begins = overrides(node, "initialise")
        self.restarts_silently = not self.begins and not overrides(node, "terminate")
        self.stop = self._make_stop(table)

    def tick(self) -> Status:
        """Tick what has to be ticked."""
        node, record = self.node, self.record
        if record.state == CLEAN and node.status is not INVALID:
            return self.left
        again = node.status is not RUNNING
        resumes = record.known and node.status is self.left and (not again or record.state == TOUCHED)
        self.renews = resumes and again and (self.resets or record.renewed)
        record.state, record.touched, record.known, record.renewed = OPEN, False, False, False
        self.later.clear()
        return self._conclude(self._resume(again) if resumes else self._start())

    def go_on(self, index: int, answer: Status) -> Status:
        """Do what comes after the tick of one child, which has happened already; this node was clean.

        Args:
            index: The place of the child.
            answer: What it answered.
        """
        record = self.record
        again = self.node.status is not RUNNING
        self.renews = again and (self.resets or record.renewed)
        record.state, record.touched, record.known, record.renewed = OPEN, False, False, False
        self.later.clear()
        if self.kids[index].state != CLEAN:
            self.later.append(index)
        if index > self.top:
            self.top = index
        return self._conclude(self._go_on(again, index, answer))

    def _conclude(self, new: Status) -> Status:
        """Take the new status, and note what the next tick has to look at."""
        node, record = self.node, self.record
        if new is RUNNING and node.status is not RUNNING:
            self.table.change(node, RUNNING)
        self.left = new
        self._remember(new)
        record.known = new is not INVALID
        if self.table.visit is not None:
            self.table.visit(node)
        return new

    def halt(self) -> None:
        """Stop the node and everything below it."""
        self.record.state, self.record.known = OPEN, False
        self.pending.clear()
        self.stop(self.node, INVALID)

    def step(self, index: int) -> Status:
        """Tick one child; when it is not settled afterwards it will be looked at again."""
        if index > self.top:
            self.top = index
        kid = self.kids[index]
        if self.renews:
            kid.renew()
        new: Status = kid.keeper.tick()
        if kid.state != CLEAN:
            self.later.append(index)
        return new

    def adopt(self) -> None:
        """Look at the children as they are now."""
        children = self.node.children
        if len(children) != len(self.kids) or any(
            kid.node is not child for kid, child in zip(self.kids, children, strict=True)
        ):
            self.kids = [self.table.adopt(child, self.record, n) for n, child in enumerate(children)]
        self.top = len(children) - 1
        self.pending.clear()

    def next_touched(self, position: int) -> int:
        """The first child behind a place that has to be looked at, or -1.

        One that is touched before that place has to wait for the next tick, as in a full tick.
        """
        while self.pending:
            index = heappop(self.pending)
            if index <= position:
                self.later.append(index)
            elif index <= self.last:
                return index
        return -1

    def halt_lower(self, index: int) -> None:
        """Stop what stands behind a child that decides now."""
        for lower in range(index + 1, self.top + 1):
            child = self.kids[lower].node
            if child.status is not INVALID:
                self.table.halt_of(child)(child)
        self.top = index

    def _remember(self, new: Status) -> None:
        """Note which children have to be looked at next time, and whether none has."""
        if self.pending or self.later:
            waiting = {*self.pending, *self.later}
            self.pending[:] = sorted(n for n in waiting if n <= self.last and self.matters(n, new))
        settled = not self.pending and not self.record.touched and self._would_stay(new)
        self.record.state = CLEAN if settled else OPEN
        self.record.high = self.last

    def matters(self, index: int, new: Status) -> bool:
        """Whether the next tick will look at this child, which may not be settled."""
        return self.kids[index].state != CLEAN

    def all_clean(self, count: int) -> bool:
        """Whether the first children are all settled."""
        return all(kid.state == CLEAN for kid in self.kids[:count])

    def _make_stop(self, table: Table) -> Stop:
        return make_stop(table, self.node)

    @abstractmethod
    def _start(self) -> Status:
        """Tick as py_trees does, whatever stands."""

    @abstractmethod
    def _resume(self, again: bool) -> Status:
        """Tick what is pending; ``again``: the node had finished, and a full tick would start it anew."""

    @abstractmethod
    def _go_on(self, again: bool, index: int, answer: Status) -> Status:
        """The same, when the first of them has been ticked already."""

    @abstractmethod
    def _would_stay(self, new: Status) -> bool:
        """Whether another tick would change nothing, given that no child is pending."""


class Ordered(Resuming):
    """A sequence or a selector: children one after the other, until one decides."""

    good: tuple[Status, ...]
    """The answers of a child after which the next one is asked."""

    def _advance(self, index: int) -> Status:
        """Ask the children from an index on."""
        while index < len(self.kids):
            self._enter(index)
            new = self.step(index)
            if new not in self.good:
                return self._decide(index, new)
            index += 1
        return self._run_out()

    def _ask_pending(self, position: int = -1) -> Status:
        """Ask those that wait behind a place; without a new decision the old one stands."""
        while (position := self.next_touched(position)) >= 0:
            new = self.step(position)
            if new not in self.good:
                return self._decide(position, new)
            if position == self.last:
                return self._advance(position + 1)
        return self.left

    def _go_on(self, again: bool, index: int, answer: Status) -> Status:
        self._look_back(again)
        if answer not in self.good:
            return self._decide(index, answer)
        return self._advance(index + 1) if index == self.last else self._ask_pending(index)

    def _remember(self, new: Status) -> None:
        super()._remember(new)
        self.record.low = self.last if new is RUNNING and self.node.memory else 0

    def _look_back(self, again: bool) -> None:
        """Note what stood before this tick; ``again``: the node had finished."""

    def matters(self, index: int, new: Status) -> bool:
        """With memory only the running child matters."""
        return super().matters(index, new) and (
            index == self.last or new is not RUNNING or not self.node.memory
        )

    def _would_stay(self, new: Status) -> bool:
        if new is RUNNING:
            return True
        # With memory the children before the last one have not been watched while the node was running.
        return self.restarts_silently and (not self.node.memory or self.all_clean(self.last + 1))

    def _enter(self, index: int) -> None:
        """A child is about to be asked."""

    @abstractmethod
    def _decide(self, index: int, new: Status) -> Status:
        """A child has answered something that ends the round."""

    @abstractmethod
    def _run_out(self) -> Status:
        """Every child has answered "go on"."""


class ResumingSequence(Ordered):
    """``py_trees.composites.Sequence``."""

    good = (SUCCESS,)

    def _start(self) -> Status:
        node = self.node
        self.adopt()
        children = node.children
        if node.status is not RUNNING:
            node.current_child = children[0] if children else None
            halt_from(self.table, children, 0)
            if self.begins:
                begin(self.table, node)
                self.adopt()
        elif node.memory and node.current_child is not None:
            return self._advance(children.index(node.current_child))
        elif not children:
            node.current_child = None
        return self._advance(0)

    def _resume(self, again: bool) -> Status:
        if again or not self.node.memory:
            return self._ask_pending()
        self.pending.clear()
        return self._advance(self.last)

    def _enter(self, index: int) -> None:
        self.node.current_child = self.kids[index].node

    def _decide(self, index: int, new: Status) -> Status:
        if self.renews or not self.node.memory:
            self.halt_lower(index)
        self._enter(index)
        self.last = index
        if new is not RUNNING:
            self.stop(self.node, new)
        return new

    def _run_out(self) -> Status:
        self.last = len(self.kids) - 1
        self.stop(self.node, SUCCESS)
        return SUCCESS


class ResumingSelector(Ordered):
    """``py_trees.composites.Selector``, and our own one that resets its children when it starts anew."""

    good = (FAILURE, INVALID)

    def __init__(self, node: Any, table: Any, record: Record) -> None:
        super().__init__(node, table, record)
        self.resets = starts_with_reset(node)
        if self.resets:
            self.begins = False
            self.restarts_silently = not overrides(node, "terminate")
        self.previous: Any = None
        self.cleared = True
        self.first = 0

    def _start(self) -> Status:
        node = self.node
        self.adopt()
        children = node.children
        if node.status is not RUNNING:
            node.current_child = children[0] if children else None
            if self.resets:
                halt_from(self.table, children, 0)
            elif self.begins:
                begin(self.table, node)
                self.adopt()
        index = 0
        if not children:
            node.current_child = None
        elif node.memory:
            assert node.current_child is not None  # as in py_trees: the running child was taken away
            index = children.index(node.current_child)
            self._clear_upper(index)
        self.previous = node.current_child
        self.first = index
        return self._advance(index)

    def _resume(self, again: bool) -> Status:
        self._look_back(again)
        if again or not self.node.memory:
            return self._ask_pending()
        self.pending.clear()
        if not self.cleared:
            self._clear_upper(self.last)
        return self._advance(self.last)

    def _look_back(self, again: bool) -> None:
        self.previous = (self.kids[0].node if self.kids else None) if again else self.node.current_child
        self.first = self.last if self.node.memory and not again else 0

    def _clear_upper(self, index: int) -> None:
        """With memory py_trees resets the children that were passed, with the next tick after that."""
        for kid in self.kids[:index]:
            if kid.node.status is not INVALID:
                self.table.halt_of(kid.node)(kid.node)

    def _decide(self, index: int, new: Status) -> Status:
        child = self.kids[index].node
        self.node.current_child = child
        if self.previous is not child or self.renews:
            self.halt_lower(index)
        self.cleared = not self.node.memory or index == self.first
        self.last = index
        if new is not RUNNING:
            self.stop(self.node, new)
        return new

    def _run_out(self) -> Status:
        self.last = len(self.kids) - 1
        self.stop(self.node, FAILURE)
        self.node.current_child = self.kids[-1].node if self.kids else None
        return FAILURE

    def _would_stay(self, new: Status) -> bool:
        return super()._would_stay(new) and (self.cleared if new is RUNNING else self._lower_reset())

    def _lower_reset(self) -> bool:
        """Whether the children behind the last one stand at INVALID, as after a reset by the parent."""
        for kid in self.kids[self.last + 1 : self.top + 1]:
            if kid.node.status is not INVALID:
                return False
        self.top = self.last
        return True
