"""Parallels that tick only the children for which something is new."""

from __future__ import annotations

from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.runtime.ticking._composites import (
    Stop,
    begin,
    halt_from,
    make_selector,
    make_sequence,
    make_stop,
)
from florence_bt.runtime.ticking._dispatch import Maker
from florence_bt.runtime.ticking._leaves import FAILURE, RUNNING, SUCCESS
from florence_bt.runtime.ticking._parallel import (
    SELECTED,
    make_parallel,
    make_parallel_stop,
    validates_always,
    verdict,
)
from florence_bt.runtime.ticking._records import Record
from florence_bt.runtime.ticking._resuming import Resuming, ResumingSelector, ResumingSequence
from florence_bt.runtime.ticking._table import Table


class ResumingParallel(Resuming):
    """``py_trees.composites.Parallel``; it keeps the indices of the children that succeeded and failed."""

    def __init__(self, node: Any, table: Any, record: Record) -> None:
        super().__init__(node, table, record)
        self.succeeded: set[int] = set()
        self.failed: set[int] = set()
        self.stopped_some = False
        self.stop_alone = make_stop(table, node)
        self.validates = validates_always(node)

    def _make_stop(self, table: Table) -> Stop:
        return make_parallel_stop(table, self.node)

    def _start(self) -> Status:
        node = self.node
        self._validate()
        self.adopt()
        if node.status is not RUNNING:
            halt_from(self.table, node.children, 0)
            node.current_child = None
            if self.begins:
                begin(self.table, node)
                self.adopt()
        self.last = len(self.kids) - 1
        self.succeeded.clear()
        self.failed.clear()
        for index, kid in enumerate(self.kids):
            if node.policy.synchronise and kid.node.status is SUCCESS:
                self.succeeded.add(index)
            else:
                self._step(index)
        self.stopped_some = True
        return self._finish()

    def _resume(self, again: bool) -> Status:
        self._validate()
        return self._ask_pending(again, -1)

    def _go_on(self, again: bool, index: int, answer: Status) -> Status:
        self._validate()
        self._count(index, answer)
        return self._ask_pending(again, index)

    def _ask_pending(self, again: bool, position: int) -> Status:
        skips = self.node.policy.synchronise and not again
        self.stopped_some = not again
        while (position := self.next_touched(position)) >= 0:
            if not (skips and self.kids[position].node.status is SUCCESS):
                self._step(position)
        return self._finish()

    def _validate(self) -> None:
        if self.validates or isinstance(self.node.policy, SELECTED):
            self.node.validate_policy_configuration()

    def _step(self, index: int) -> None:
        self._count(index, self.step(index))

    def _count(self, index: int, new: Status) -> None:
        self.succeeded.discard(index)
        self.failed.discard(index)
        if new is SUCCESS:
            self.succeeded.add(index)
        elif new is FAILURE:
            self.failed.add(index)

    def _finish(self) -> Status:
        if not self.kids:
            new, self.node.current_child = SUCCESS, None
        else:
            new, self.node.current_child = self._verdict()
        if new is not RUNNING:
            if len(self.succeeded) + len(self.failed) < len(self.kids):
                self.stopped_some = True
                self.stop(self.node, new)
            else:
                self.stop_alone(self.node, new)  # no child is left to be stopped
        return new

    def _verdict(self) -> tuple[Status, Behaviour]:
        kids, policy = self.kids, self.node.policy
        if self.failed:
            return FAILURE, kids[min(self.failed)].node
        if isinstance(policy, ParallelPolicy.SuccessOnAll):
            return SUCCESS if len(self.succeeded) == len(kids) else RUNNING, kids[-1].node
        if isinstance(policy, ParallelPolicy.SuccessOnOne):
            return (SUCCESS, kids[max(self.succeeded)].node) if self.succeeded else (RUNNING, kids[-1].node)
        return verdict(self.node)

    def _remember(self, new: Status) -> None:
        super()._remember(new)
        # Some of its children may be passed over, or it looks at its policy in its own way.
        self.record.opaque = bool(self.node.policy.synchronise) or self.validates

    def matters(self, index: int, new: Status) -> bool:
        """A child that has succeeded is passed over while the node runs, when the policy says so."""
        passed = new is RUNNING and self.node.policy.synchronise and index in self.succeeded
        return super().matters(index, new) and not passed

    def _would_stay(self, new: Status) -> bool:
        if new is RUNNING:
            return True
        return self.restarts_silently and (not self.stopped_some or self.all_clean(len(self.kids)))


RESUMING: dict[Maker, type[Resuming]] = {
    make_sequence: ResumingSequence,
    make_selector: ResumingSelector,
    make_parallel: ResumingParallel,
}
"""The composites that go on where something changed, by the maker that the full ticker has for them."""
