"""Composites that say their steps behave in py_trees like any other composite."""

from __future__ import annotations

from py_trees import behaviours
from py_trees.common import Status

from florence_bt.behaviours.stepping import Stepping, Steps
from florence_bt.behaviours.ticking import Ticker


class Backwards(Stepping):
    """Does its children from the last to the first."""

    def steps(self) -> Steps:
        if self.status is not Status.RUNNING:
            self.halt_all()
        for child in reversed(self.children):
            if child.status is Status.SUCCESS:
                continue
            self.current_child = child
            yield child
            if child.status is not Status.SUCCESS:
                return child.status
        return Status.SUCCESS


def tree() -> Backwards:
    return Backwards("backwards", [behaviours.Success("a"), behaviours.TickCounter("b", 1, Status.SUCCESS)])


def test_py_trees_and_the_ticker_do_the_same():
    # tick 1: b RUNNING. tick 2: b SUCCESS, then a. tick 3: all anew, b RUNNING.
    stock, ours = tree(), tree()
    ticker = Ticker(ours, record=True)
    visited = []
    for _ in range(3):
        visited.append([node.name for node in stock.tick()])
        ticker.tick()
        assert [n.status for n in stock.iterate()] == [n.status for n in ours.iterate()]
    assert visited == [["b", "backwards"], ["b", "a", "backwards"], ["b", "backwards"]]
    assert [child.status for child in ours.children] == [Status.INVALID, Status.RUNNING]


def test_stops_of_children_are_recorded():
    root = tree()
    ticker = Ticker(root, record=True)
    for _ in range(3):
        ticker.tick()
    assert [(node.name, new.name) for node, _, new in ticker.changes] == [
        ("a", "INVALID"),
        ("b", "INVALID"),
        ("b", "RUNNING"),
        ("backwards", "RUNNING"),
    ]
    assert root.on_halt is None
    ticker.stop()
    assert [(node.name, new.name) for node, _, new in ticker.changes] == [
        ("b", "INVALID"),
        ("backwards", "INVALID"),
    ]
