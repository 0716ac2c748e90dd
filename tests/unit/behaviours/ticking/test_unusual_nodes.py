"""Nodes that are legal in py_trees and that few people write: the ticker treats them as py_trees does."""

from __future__ import annotations

import itertools

import py_trees
import pytest
from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.behaviours.ticking import Ticker
from tests.unit.behaviours.ticking import random_trees


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


S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING


def test_a_tick_of_ones_own_runs_to_its_end():
    log: list = []
    ticker = Ticker(composites.Sequence("root", False, [Around("a", log, R, S), Answers("b", R)]))
    for _ in range(2):
        ticker.tick()
    assert log == [("a", "before"), ("a", "after")] * 2


def test_only_a_part_of_a_larger_tree_is_ticked():
    """The parent of the ticker's root has no say in how the root is ticked."""
    log: list = []
    part = Around("part", log, R)
    composites.Sequence("whole", False, [part])
    Ticker(part).tick()
    assert log == [("part", "before"), ("part", "after")]


def failing(name: str) -> Behaviour:
    """A success that was made to fail."""
    node = behaviours.Success(name)
    node.update = lambda: Status.FAILURE
    return node


def test_a_subtree_that_comes_later_may_have_methods_of_its_own():
    for make in (py_trees.trees.BehaviourTree, random_trees.TickedTree):
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


@pytest.mark.parametrize("module", ["mine", "florence_bt.behaviours.mine", "py_trees.decorators"])
@pytest.mark.parametrize("deep", [False, True])
def test_what_a_decorator_of_ones_own_stops_is_in_the_record(deep, module, monkeypatch):
    """Wherever its module lies: only classes that are known to leave their child alone are trusted."""
    monkeypatch.setattr(Breaks.update, "__module__", module)
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


class EndsItsChild:
    """Stops its first child when it begins and when it ends."""

    def initialise(self) -> None:
        self.children[0].stop(Status.INVALID)

    def terminate(self, new_status: Status) -> None:
        self.children[0].stop(Status.INVALID)


class OwnSequence(EndsItsChild, composites.Sequence):
    """Does so around its children."""


class OwnSelector(EndsItsChild, composites.Selector):
    """Does so around its children."""


class OwnParallel(EndsItsChild, composites.Parallel):
    """Does so around its children."""


class OwnDecorator(EndsItsChild, decorators.Inverter):
    """Does so around its child."""


OWN = {
    "sequence": lambda: OwnSequence("own", True, [behaviours.Success("a"), Answers("b", R, F)]),
    "selector": lambda: OwnSelector("own", True, [behaviours.Failure("a"), Answers("b", R, S)]),
    "parallel": lambda: OwnParallel(
        "own", ParallelPolicy.SuccessOnAll(False), [behaviours.Success("a"), Answers("b", R, F)]
    ),
    "decorator": lambda: OwnDecorator("own", Answers("a", R, S)),
}


@pytest.mark.parametrize("module", ["mine", "florence_bt.behaviours.mine", "py_trees.behaviour"])
@pytest.mark.parametrize("kind", OWN)
def test_what_a_node_of_ones_own_stops_around_its_children_is_in_the_record(kind, module, monkeypatch):
    for method in (EndsItsChild.initialise, EndsItsChild.terminate):
        monkeypatch.setattr(method, "__module__", module)
    root = composites.Selector("root", False, [OWN[kind](), behaviours.Running("c")])
    ticker = Ticker(root, record=True)
    known = {node: node.status for node in root.iterate()}
    for _ in range(4):
        ticker.tick()
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
