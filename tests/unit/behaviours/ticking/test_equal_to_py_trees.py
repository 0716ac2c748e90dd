"""Our ticker against py_trees itself: the same calls in the same order, statuses, tips and messages."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable

import py_trees
import pytest
from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.behaviours.ticking import Ticker
from tests.sweeps import sweep
from tests.unit.behaviours.ticking import random_reactive, random_trees

CHUNK = 100


@pytest.fixture(autouse=True)
def restart_time(monkeypatch) -> Callable[[], None]:
    """The time-out of py_trees reads the clock of the operating system; here each look takes a second."""

    def restart() -> None:
        monkeypatch.setattr(decorators.time, "monotonic", itertools.count().__next__)

    return restart


@pytest.mark.parametrize("first", sweep(range(0, 1200, CHUNK), every=4))
def test_random_trees(first, restart_time):
    for seed in range(first, first + CHUNK):
        restart_time()
        stock = random_trees.play(seed, py_trees.trees.BehaviourTree, depth=4)
        restart_time()
        assert random_trees.play(seed, random_trees.TickedTree, depth=4) == stock, f"seed {seed}"


@pytest.mark.parametrize("first", sweep(range(5000, 5400, CHUNK), every=4))
def test_random_trees_with_leaves_that_answer_nonsense(first, restart_time, capsys):
    for seed in range(first, first + CHUNK):
        restart_time()
        stock = random_trees.play(seed, py_trees.trees.BehaviourTree, odd=True)
        complaints = capsys.readouterr().out
        restart_time()
        assert random_trees.play(seed, random_trees.TickedTree, odd=True) == stock, f"seed {seed}"
        assert capsys.readouterr().out == complaints


@pytest.mark.parametrize("quiet", [True, False])
@pytest.mark.parametrize("first", sweep(range(0, 400, CHUNK), every=4))
def test_random_trees_of_our_own_nodes(first, quiet, restart_time):
    for seed in range(first, first + CHUNK):
        restart_time()
        stock = random_reactive.play(seed, lambda root: root.tick_once, 3, quiet)
        restart_time()
        ours = random_reactive.play(seed, lambda root: Ticker(root, record=True).tick, 3, quiet)
        assert ours == stock, f"seed {seed}, quiet {quiet}"


def test_every_decorator_of_py_trees_is_among_them():
    stock = {
        cls
        for _, cls in inspect.getmembers(decorators, inspect.isclass)
        if issubclass(cls, decorators.Decorator) and cls is not decorators.Decorator
    }
    script = random_trees.Script(1)
    made = [make(script, behaviours.Running("leaf")) for make in random_trees.DECORATORS]
    assert stock <= {type(node) for node in made}


def test_an_exception_comes_through_and_leaves_the_same_statuses():
    class Broken(Behaviour):
        def update(self) -> Status:
            raise RuntimeError("a bug")

    def tree() -> Behaviour:
        inner = composites.Sequence(
            "inner", False, [behaviours.Success("a"), Broken("b"), behaviours.Success("c")]
        )
        return composites.Parallel("root", ParallelPolicy.SuccessOnAll(), [behaviours.Running("r"), inner])

    stock, ours = tree(), tree()
    with pytest.raises(RuntimeError, match="a bug"):
        stock.tick_once()
    with pytest.raises(RuntimeError, match="a bug"):
        Ticker(ours).tick()
    assert random_trees.state_of(ours) == random_trees.state_of(stock)


def test_the_same_errors_for_a_policy_that_cannot_work():
    stranger = behaviours.Success("stranger")
    policies = [ParallelPolicy.SuccessOnSelected([stranger]), ParallelPolicy.SuccessOnSelected([])]
    for policy in (*policies, ParallelPolicy.Base()):
        messages = []
        for make in (lambda root: root.tick_once, lambda root: Ticker(root).tick):
            tick = make(composites.Parallel("root", policy, [behaviours.Success("a")]))
            with pytest.raises(RuntimeError) as caught:
                tick()
            messages.append(str(caught.value))
        assert messages[0] == messages[1]


def test_an_update_that_is_replaced_on_one_node_is_respected():
    leaf, other = behaviours.Success("leaf"), behaviours.Success("other")
    ticker = Ticker(composites.Selector("root", False, [leaf, other]))
    leaf.update = lambda: Status.FAILURE
    assert ticker.tick() is Status.SUCCESS
    assert (leaf.status, other.status) == (Status.FAILURE, Status.SUCCESS)


def test_nodes_with_an_equality_of_their_own_are_told_apart():
    class Alike(Behaviour):
        def __init__(self, name: str, answer: Status) -> None:
            super().__init__(name)
            self.answer = answer

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Alike)

        def update(self) -> Status:
            return self.answer

    root = composites.Parallel(
        "root",
        ParallelPolicy.SuccessOnOne(),
        [Alike("a", Status.RUNNING), Alike("b", Status.SUCCESS)],
    )
    ticker = Ticker(root, record=True)
    assert ticker.tick() is Status.SUCCESS
    assert [child.status for child in root.children] == [Status.INVALID, Status.SUCCESS]


def test_a_deep_tree():
    depth = 150
    node: Behaviour = behaviours.Running("leaf")
    for level in range(depth):
        node = composites.Sequence(f"level {level}", False, [node])
    ticker = Ticker(node, record=True)
    assert ticker.tick() is Status.RUNNING and len(ticker.changes) == depth + 1
    assert ticker.tick() is Status.RUNNING and not ticker.changes
    ticker.stop()
    assert node.status is Status.INVALID and len(ticker.changes) == depth + 1


def test_a_child_that_does_not_stop_at_the_first_time_is_stopped_twice():
    class Stubborn(Behaviour):
        stops = 0

        def update(self) -> Status:
            return Status.RUNNING

        def stop(self, new_status: Status) -> None:
            self.stops += 1
            if self.stops > 1:
                super().stop(new_status)

    def tree() -> Behaviour:
        return decorators.PassThrough("pass", Stubborn("stubborn"))

    stock, ours = tree(), tree()
    ticker = Ticker(ours)
    stock.tick_once()
    ticker.tick()
    stock.stop(Status.INVALID)
    ticker.stop()
    assert (ours.decorated.stops, ours.decorated.status) == (2, Status.INVALID)
    assert (stock.decorated.stops, stock.decorated.status) == (2, Status.INVALID)
