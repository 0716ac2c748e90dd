"""Nodes that are legal in py_trees and that few people write: the ticker treats them as py_trees does."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import py_trees
import pytest
from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.runtime.ticking import BehaviourTree, Ticker
from tests.unit.runtime.ticking import random_trees

Make = Callable[[list], Behaviour]


class Answers(Behaviour):
    """Gives its answers in turn."""

    def __init__(self, name: str, *answers: Status) -> None:
        super().__init__(name)
        self.answers = itertools.cycle(answers)

    def update(self) -> Status:
        return next(self.answers)


class Around(Answers):
    """Does something before and after the tick of every behaviour."""

    def __init__(self, name: str, log: list, *answers: Status) -> None:
        super().__init__(name, *answers)
        self.log = log

    def tick(self):
        self.log.append((self.name, "before"))
        yield from super().tick()
        self.log.append((self.name, "after"))


class Quiet(Around):
    """Never tells anybody that it was ticked."""

    def tick(self):
        self.log.append((self.name, "ticked"))
        for _ in super().tick():
            pass
        yield from ()


S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING
ALL = ParallelPolicy.SuccessOnAll()
AROUND: list[Make] = [
    lambda log: composites.Sequence("root", False, [Around("a", log, S, R, F), Around("b", log, R, S)]),
    lambda log: composites.Sequence("root", True, [Around("a", log, R, S, S), Around("b", log, F, R)]),
    lambda log: composites.Selector("root", False, [Around("a", log, F, R, S), Around("b", log, R, S, F)]),
    lambda log: composites.Parallel("root", ALL, [Around("a", log, R, S), Around("b", log, S, R)]),
    lambda log: decorators.Inverter("root", Around("a", log, R, S, F)),
    lambda log: Around("root", log, R, S, F),
    lambda log: composites.Sequence("root", False, [Quiet("a", log, R, F, S), Around("b", log, S, F)]),
    lambda log: composites.Selector("root", False, [Quiet("a", log, R, S, F), Around("b", log, S, F)]),
    lambda log: composites.Parallel("root", ALL, [Quiet("a", log, R, S, F), Around("b", log, S, F)]),
]


@pytest.mark.parametrize("make", AROUND)
def test_what_a_tick_of_ones_own_does_behind_its_last_yield(make):
    """py_trees asks a generator for more only when its parent goes on behind the node."""
    stock_log: list = []
    log: list = []
    stock, ours = make(stock_log), make(log)
    ticker = Ticker(ours)
    for _ in range(7):
        stock.tick_once()
        ticker.tick()
        assert log == stock_log
        assert random_trees.state_of(ours) == random_trees.state_of(stock)


def test_a_generator_that_nobody_asks_for_more_is_closed_with_the_tick():
    class Closes(Answers):
        closed = 0

        def tick(self):
            try:
                yield from super().tick()
            finally:
                self.closed += 1

    leaf = Closes("leaf", R)
    ticker = Ticker(composites.Sequence("root", False, [leaf]))
    for count in (1, 2, 3):
        ticker.tick()
        assert leaf.closed == count


def test_only_a_part_of_a_larger_tree_is_ticked():
    """The parent of the ticker's root has no say in how the root is ticked."""
    log: list = []
    part = Around("part", log, R)
    composites.Sequence("whole", False, [part])
    Ticker(part).tick()
    assert log == [("part", "before"), ("part", "after")]


class Tells(Answers):
    """Its status is a property."""

    seen: list

    @property
    def status(self) -> Status:
        return self.__dict__.get("hidden", Status.INVALID)

    @status.setter
    def status(self, new: Status) -> None:
        self.__dict__.setdefault("seen", []).append(new)
        self.__dict__["hidden"] = new


class FindingList(Answers):
    """It hears of everything that is set."""

    def __setattr__(self, name: str, value: object) -> None:
        if name == "status":
            self.__dict__.setdefault("seen", []).append(value)
        super().__setattr__(name, value)


@pytest.mark.parametrize("cls", [Tells, FindingList])
def test_a_node_that_hears_of_its_status_hears_it_as_often_as_in_py_trees(cls):
    def tree() -> Behaviour:
        return composites.Sequence("root", False, [cls("a", S, R, F), cls("b", R, R, S)])

    stock, ours = tree(), tree()
    ticker = Ticker(ours, record=True)
    known = {node: node.status for node in ours.iterate()}
    for _ in range(8):
        stock.tick_once()
        ticker.tick()
        assert [n.seen for n in ours.children] == [n.seen for n in stock.children]
        assert random_trees.state_of(ours) == random_trees.state_of(stock)
        known.update({node: new for node, _old, new in ticker.changes})
        assert known == {node: node.status for node in ours.iterate()}


def failing(name: str) -> Behaviour:
    """A success that was made to fail."""
    node = behaviours.Success(name)
    node.update = lambda: Status.FAILURE
    return node


def test_a_method_that_is_replaced_after_the_tree_was_made_is_found_at_setup():
    root = composites.Sequence("root", False, [behaviours.Success("a")])
    tree = BehaviourTree(root)
    root.children[0].update = lambda: Status.FAILURE
    tree.setup()
    tree.tick()
    assert root.status is Status.FAILURE


def test_a_subtree_that_comes_later_may_have_methods_of_its_own():
    for make in (py_trees.trees.BehaviourTree, BehaviourTree):
        root = composites.Sequence("root", False, [behaviours.Success("a"), behaviours.Success("b")])
        tree = make(root)
        tree.tick()
        assert root.status is Status.SUCCESS
        tree.insert_subtree(failing("c"), root.id, 1)
        tree.tick()
        assert [child.status for child in root.children] == [S, F, Status.INVALID]
        tree.prune_subtree(root.children[1].id)
        tree.tick()
        assert root.status is Status.SUCCESS
        tree.replace_subtree(root.children[1].id, failing("d"))
        tree.tick()
        assert [child.status for child in root.children] == [S, F]


class Breaks(decorators.Decorator):
    """Stops its child by itself, now and then with an error after that."""

    ticks = 0

    def update(self) -> Status:
        self.ticks += 1
        if self.ticks % 2:
            return self.decorated.status
        self.decorated.stop(Status.INVALID)
        if self.ticks % 4:
            return Status.RUNNING
        raise RuntimeError("a bug")


@pytest.mark.parametrize("deep", [False, True])
def test_what_a_decorator_of_ones_own_stops_is_in_the_record(deep):
    leaf = behaviours.Running("leaf")
    root = Breaks("root", composites.Sequence("inner", False, [leaf]) if deep else leaf)
    ticker = Ticker(root, record=True)
    known = {node: node.status for node in root.iterate()}
    for _ in range(8):
        try:
            ticker.tick()
        except RuntimeError:
            assert root.ticks % 4 == 0
        for node, old, new in ticker.changes:
            assert known[node] is old
            known[node] = new
        assert known == {node: node.status for node in root.iterate()}


def test_the_time_out_of_py_trees_stops_its_child(monkeypatch):
    def tree() -> Behaviour:
        return decorators.Timeout("limit", composites.Sequence("s", False, [behaviours.Running("r")]), 1.0)

    stock, ours = tree(), tree()
    ticker = Ticker(ours, record=True)
    for now in (10.0, 10.5, 11.5, 12.0, 14.0):
        monkeypatch.setattr(decorators.time, "monotonic", lambda now=now: now)
        stock.tick_once()
        ticker.tick()
        assert random_trees.state_of(ours) == random_trees.state_of(stock)
        if now == 11.5:
            assert [(node.name, new.name) for node, _old, new in ticker.changes] == [
                ("r", "INVALID"),
                ("s", "INVALID"),
                ("limit", "FAILURE"),
            ]
