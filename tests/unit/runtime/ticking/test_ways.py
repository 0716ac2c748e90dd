"""Where an incremental tick begins: below everything for which nothing is new, however deep that is."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from typing import Any

import pytest
from py_trees import behaviours, composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.keys import KeyStore
from florence_bt.runtime.ticking import Ticker
from tests.unit.runtime.ticking import random_touches, random_trees
from tests.unit.runtime.ticking.random_reactive import Asks, Job

CHUNK = 40


def by_py_trees(root: Behaviour) -> random_touches.Ticks:
    return root.tick_once, lambda: root.stop(Status.INVALID), lambda node: None


def by_us(root: Behaviour) -> random_touches.Ticks:
    ticker = Ticker(root, record=True, incremental=True)
    known = {node: node.status for node in root.iterate()}

    def follow() -> None:
        for node, old, new in ticker.changes:
            assert known[node] is old and old is not new
            known[node] = new
        assert known == {node: node.status for node in root.iterate()}

    def tick() -> None:
        ticker.tick()
        follow()

    def stop() -> None:
        ticker.stop()
        follow()

    def tell(node: Behaviour) -> None:
        ticker.touch(node)
        known.update({each: each.status for each in root.iterate()})

    return tick, stop, tell


@pytest.mark.parametrize("first", range(0, 160, CHUNK))
def test_random_trees_with_one_touch_at_a_time(first):
    asked_full = asked = 0
    for seed in range(first, first + CHUNK):
        stock, count_full = random_touches.play(seed, by_py_trees)
        ours, count = random_touches.play(seed, by_us)
        assert ours == stock, f"seed {seed}"
        asked_full, asked = asked_full + count_full, asked + count
    assert asked < asked_full


def nested(depth: int, keys: KeyStore, job: Job) -> Behaviour:
    """Sequences in sequences, each behind a condition of its own."""
    node: Behaviour = composites.Sequence("end", False, [Asks("bottom", keys, "bottom", 0), job])
    for level in range(depth):
        asks = Asks(f"asks {level}", keys, f"key {level}", 0)
        node = composites.Sequence(f"level {level}", False, [asks, node])
    return node


def calls_of(action: Callable[[], object]) -> int:
    """How many Python functions are called."""
    calls = 0

    def count(frame: Any, event: str, argument: Any) -> None:
        nonlocal calls
        calls += event == "call"

    before = sys.getprofile()
    gc.disable()  # what else would be called is none of our business
    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(before)
        gc.enable()
    return calls


def keys_for(depth: int) -> KeyStore:
    return KeyStore({"bottom": 1} | {f"key {level}": 1 for level in range(depth)})


def test_the_levels_above_a_leaf_cost_nothing_when_its_status_stays():
    found = []
    for depth in (5, 90):
        keys, job = keys_for(depth), Job("job", [])
        ticker = Ticker(nested(depth, keys, job), record=True, incremental=True)
        ticker.tick()
        keys.write("bottom", 2)
        alone = calls_of(ticker.tick)
        keys.write("bottom", 3)
        keys.write("key 0", 2)
        found.append((alone, calls_of(ticker.tick)))
    assert found[0] == found[1]  # not one call more for 85 more levels


def test_a_leaf_whose_status_changes_is_followed_as_far_as_something_changes():
    keys, job = keys_for(50), Job("job", [])
    inner = nested(50, keys, job)
    aside = Job("aside", [])
    root = composites.Selector("root", False, [inner, aside])
    ticker = Ticker(root, record=True, incremental=True)
    assert ticker.tick() is Status.RUNNING
    keys.write("bottom", 0)
    assert ticker.tick() is Status.RUNNING
    assert (inner.status, job.status, aside.status) == (Status.FAILURE, Status.INVALID, Status.RUNNING)
    assert len(ticker.changes) == 50 + 4  # every level, the end, both jobs, the condition
    assert root.tip() is aside
    keys.write("bottom", 1)
    assert ticker.tick() is Status.RUNNING
    assert (inner.status, job.status, aside.status) == (Status.RUNNING, Status.RUNNING, Status.INVALID)


def test_what_is_touched_where_nobody_looks_now_is_looked_at_later():
    # The sequence has passed its first branch; its condition is asked again only in the next round.
    keys = KeyStore({"a": 1})
    job = Job("job", [])
    asks = Asks("asks", keys, "a", 0)
    first = composites.Sequence("first", False, [asks, behaviours.Success("done")])
    root = composites.Sequence("root", True, [first, job])
    ticker = Ticker(root, incremental=True)
    ticker.tick()
    keys.write("a", 0)
    assert ticker.tick() is Status.RUNNING and asks.asked == 1
    job.finish(Status.SUCCESS)
    assert ticker.tick() is Status.SUCCESS and asks.asked == 1
    assert ticker.tick() is Status.FAILURE and asks.asked == 2
    assert first.status is Status.FAILURE


def test_after_an_exception_far_below_everything_is_looked_at_again():
    class Breaks(Asks):
        def update(self) -> Status:
            if self._keys.read(self._key) == 7:
                raise RuntimeError("a bug")
            return super().update()

    keys = keys_for(20)
    inner = nested(20, keys, Job("job", []))
    root = composites.Sequence("root", False, [inner, behaviours.Running("never")])
    end = next(node for node in root.iterate() if node.name == "end")
    end.insert_child(Breaks("breaks", keys, "bottom", 0), 0)
    ticker = Ticker(root, incremental=True)
    assert ticker.tick() is Status.RUNNING
    keys.write("bottom", 7)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="a bug"):
            ticker.tick()
    keys.write("bottom", 0)
    assert ticker.tick() is Status.FAILURE


def test_a_node_that_has_left_the_tree_touches_nobody():
    keys = KeyStore({"a": 1, "b": 1})
    leaving = composites.Sequence("leaving", False, [Asks("a", keys, "a", 0)])
    root = composites.Sequence("root", False, [leaving, Asks("b", keys, "b", 0), Job("job", [])])
    ticker = Ticker(root, incremental=True)
    ticker.tick()
    root.remove_child(leaving)
    ticker.rebuild()
    ticker.tick()
    before = random_trees.state_of(root)
    keys.write("a", 0)
    assert ticker.tick() is Status.RUNNING and random_trees.state_of(root) == before
    assert leaving.children[0].asked == 1
    keys.write("a", 1)
    keys.write("b", 0)
    assert ticker.tick() is Status.FAILURE
