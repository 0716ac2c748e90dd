"""The trees that the benchmarks of ticking use: the same shapes and leaves for py_trees and for us."""

from __future__ import annotations

from collections.abc import Callable

from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.behaviours.keys import KeyStore

MakeLeaf = Callable[[str], Behaviour]
MakeComposite = Callable[[str, list[Behaviour]], Behaviour]


class Busy(Behaviour):
    """A leaf of one's own that keeps running."""

    def update(self) -> Status:
        return Status.RUNNING


class Done(Behaviour):
    """A leaf of one's own that succeeds at once."""

    def update(self) -> Status:
        return Status.SUCCESS


class Mirror(decorators.Decorator):
    """A decorator of one's own."""

    def update(self) -> Status:
        return self.decorated.status


LEAVES: dict[str, MakeLeaf] = {
    "Running": behaviours.Running,
    "Success": behaviours.Success,
    "own, running": Busy,
    "own, success": Done,
    "Count over Running": lambda name: decorators.Count(name, behaviours.Running(f"{name} leaf")),
    "own decorator over own": lambda name: Mirror(name, Busy(f"{name} leaf")),
    "TickCounter": lambda name: behaviours.TickCounter(name, 3, Status.SUCCESS),
}


def sequence(name: str, children: list[Behaviour]) -> Behaviour:
    return composites.Sequence(name, False, children)


def sequence_with_memory(name: str, children: list[Behaviour]) -> Behaviour:
    return composites.Sequence(name, True, children)


def selector(name: str, children: list[Behaviour]) -> Behaviour:
    return composites.Selector(name, False, children)


def parallel(name: str, children: list[Behaviour]) -> Behaviour:
    return composites.Parallel(name, ParallelPolicy.SuccessOnAll(), children)


def chain(nodes: int, make: MakeComposite, leaf: MakeLeaf) -> Behaviour:
    """One composite with leaves: a chain of steps."""
    return make("chain", [leaf(f"leaf {n}") for n in range(nodes - 1)])


def nested(nodes: int, make: MakeComposite, leaf: MakeLeaf) -> Behaviour:
    """A composite in a composite in a composite, each beside one leaf."""
    node = make("end", [leaf("last leaf")])
    for n in range(nodes // 2 - 1):
        node = make(f"level {n}", [leaf(f"leaf {n}"), node])
    return node


def wide(nodes: int, make: MakeComposite, leaf: MakeLeaf, arity: int = 10) -> Behaviour:
    """A tree with ten children at every composite."""
    count = 0

    def leaves(number: int) -> list[Behaviour]:
        nonlocal count
        count += number
        return [leaf(f"leaf {count - n}") for n in range(number)]

    level = leaves(max(1, nodes * (arity - 1) // arity))
    depth = 0
    while len(level) > 1:
        level = [make(f"node {depth} {n}", level[n : n + arity]) for n in range(0, len(level), arity)]
        depth += 1
    return level[0]


def node_count(root: Behaviour) -> int:
    return sum(1 for _ in root.iterate())


class Holds(Behaviour):
    """A condition over a key, as missions have them."""

    def __init__(self, name: str, keys: KeyStore, key: str) -> None:
        super().__init__(name)
        self._keys, self._key = keys, key

    def update(self) -> Status:
        return Status.SUCCESS if self._keys.read(self._key) else Status.FAILURE


def conditions(keys: KeyStore) -> MakeLeaf:
    """Makes conditions that hold, each over a key with the name of the leaf."""

    def make(name: str) -> Behaviour:
        keys.write(name, True)
        return Holds(name, keys, name)

    return make


def mission() -> Behaviour:
    """A mission of 40 nodes in plain py_trees: watch for trouble, look for the user in three rooms."""

    def step(name: str, ticks: int, end: Status = Status.SUCCESS) -> Behaviour:
        return behaviours.TickCounter(name, ticks, end)

    def trouble(name: str) -> Behaviour:
        return composites.Sequence(name, False, [behaviours.Failure(f"{name}?"), step(f"handle {name}", 3)])

    def search(room: str) -> Behaviour:
        look = composites.Sequence(f"look in {room}", True, [step("turn", 1), step("see", 1, Status.FAILURE)])
        drive = decorators.Retry(f"reach {room}", step(f"drive to {room}", 2), 2)
        return composites.Sequence(f"search {room}", True, [drive, decorators.FailureIsSuccess("fine", look)])

    fetch = composites.Sequence(
        "fetch",
        True,
        [
            *(search(room) for room in ("kitchen", "hall", "bath")),
            *(step(name, 1) for name in ("say so", "go home", "dock", "rest")),
        ],
    )
    watched = composites.Parallel(
        "watched",
        ParallelPolicy.SuccessOnSelected([fetch]),
        [
            fetch,
            behaviours.Running("keep the map"),
            decorators.SuccessIsRunning("log", behaviours.Success("write log")),
        ],
    )
    guards = [trouble("bumper"), trouble("battery"), trouble("cliff")]
    return composites.Selector("mission", False, [*guards, watched])
