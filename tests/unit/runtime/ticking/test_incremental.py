"""Incremental ticking against full ticks of py_trees: the same outcome, and only what is new is looked at."""

from __future__ import annotations

import itertools

import pytest
from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.reactive import Reactive, takes_part
from florence_bt.runtime.ticking import Ticker
from tests.unit.runtime.ticking import random_reactive, random_trees
from tests.unit.runtime.ticking.random_reactive import Asks, Job

CHUNK = 250


def by_py_trees(root: Behaviour):
    return root.tick_once, lambda node: None


def by_us(root: Behaviour):
    ticker = Ticker(root, incremental=True)
    return ticker.tick, lambda node: ticker.rebuild() if node is None else ticker.touch(node)


@pytest.mark.parametrize("quiet", [True, False])
@pytest.mark.parametrize("first", range(0, 500, CHUNK))
def test_random_trees(first, quiet, monkeypatch):
    asked_full = asked = 0
    for seed in range(first, first + CHUNK):
        monkeypatch.setattr(decorators.time, "monotonic", itertools.count().__next__)
        stock, count_full = random_reactive.play(seed, by_py_trees, 3, quiet)
        monkeypatch.setattr(decorators.time, "monotonic", itertools.count().__next__)
        ours, count = random_reactive.play(seed, by_us, 3, quiet)
        assert ours == stock, f"seed {seed}, quiet {quiet}"
        assert count <= count_full
        asked_full, asked = asked_full + count_full, asked + count
    assert asked < 0.95 * asked_full


def test_full_ticks_of_our_own_nodes():
    def by_full_ticker(root: Behaviour):
        return Ticker(root).tick, lambda node: None

    for seed in range(3000, 3250):
        stock, _ = random_reactive.play(seed, by_py_trees, 3, True)
        assert random_reactive.play(seed, by_full_ticker, 3, True)[0] == stock, f"seed {seed}"


def conditions_of(keys: KeyStore, number: int, limit: int = 0) -> list[Asks]:
    return [Asks(f"asks {n}", keys, f"key {n}", limit) for n in range(number)]


def ten_by_ten(keys: KeyStore) -> tuple[Behaviour, list[list[Asks]], list[Job]]:
    """A selector of ten sequences of nine conditions and a job each; all reactive."""
    log: list = []
    rows, jobs, branches = [], [], []
    for n in range(10):
        row = [Asks(f"asks {n}.{m}", keys, f"key {n}.{m}", 0) for m in range(9)]
        jobs.append(Job(f"job {n}", log))
        rows.append(row)
        branches.append(composites.Sequence(f"sequence {n}", False, [*row, jobs[-1]]))
    return composites.Selector("root", False, branches), rows, jobs


def test_only_what_depends_on_a_key_is_asked_again():
    keys = KeyStore({f"key {n}.{m}": int(m != 4) for n in range(10) for m in range(9)})
    root, rows, jobs = ten_by_ten(keys)
    visited: list[str] = []
    ticker = Ticker(root, incremental=True, visit=lambda node: visited.append(node.name))
    assert ticker.tick() is Status.FAILURE  # in each row the fifth condition does not hold
    asked = [condition.asked for row in rows for condition in row]
    for _ in range(3):
        visited.clear()
        ticker.tick()
        assert not visited
    assert [condition.asked for row in rows for condition in row] == asked
    keys.write("key 7.4", 1)
    visited.clear()
    assert ticker.tick() is Status.RUNNING and jobs[7].status is Status.RUNNING
    assert visited == [f"asks 7.{m}" for m in (4, 5, 6, 7, 8)] + ["job 7", "sequence 7", "root"]
    keys.write("key 2.0", 1)  # it is 1 already: no change
    keys.write("key 9.4", 1)  # behind the branch that runs: not asked
    visited.clear()
    assert ticker.tick() is Status.RUNNING and "asks 9.4" not in visited
    keys.write("key 2.4", 2)  # a branch of higher priority takes over
    visited.clear()
    assert ticker.tick() is Status.RUNNING
    assert (jobs[2].status, jobs[7].status) == (Status.RUNNING, Status.INVALID)
    assert {name for name in visited if name.startswith("asks")} == {f"asks 2.{m}" for m in range(4, 9)}


@pytest.mark.parametrize("size", [100, 5000])
def test_a_long_chain_is_not_walked(size):
    keys = KeyStore({f"key {n}": 1 for n in range(size)})
    conditions = conditions_of(keys, size)
    job = Job("job", [])
    root = composites.Sequence("root", False, [*conditions, job])
    ticker = Ticker(root, incremental=True)
    assert ticker.tick() is Status.RUNNING
    keys.write("key 3", 2)
    keys.write("key 1", 2)
    assert ticker.tick() is Status.RUNNING
    assert sum(condition.asked for condition in conditions) == size + 2
    keys.write("key 5", 0)
    assert ticker.tick() is Status.FAILURE and job.status is Status.INVALID
    assert sum(condition.asked for condition in conditions) == size + 3


def test_a_key_that_is_written_in_the_middle_of_a_tick():
    # tick 1: later FAILURE. tick 2: what is written makes later hold at once, earlier fail in tick 3.
    keys = KeyStore({"go": 0, "earlier": 1, "later": 0})

    class Copies(Behaviour):
        def update(self) -> Status:
            keys.write("later", keys.read("go"))
            keys.write("earlier", 1 - keys.read("go"))
            return Status.SUCCESS

    earlier, later = Asks("earlier", keys, "earlier", 0), Asks("later", keys, "later", 0)
    root = composites.Parallel(
        "root",
        ParallelPolicy.SuccessOnAll(synchronise=False),
        [
            behaviours.Running("always"),
            decorators.FailureIsRunning("f", earlier),
            Copies("copies"),
            decorators.FailureIsRunning("g", later),
        ],
    )
    ticker = Ticker(root, incremental=True)
    ticker.tick()
    assert (earlier.status, later.status) == (Status.SUCCESS, Status.FAILURE)
    keys.write("go", 1)
    ticker.tick()
    assert (earlier.status, later.status) == (Status.SUCCESS, Status.SUCCESS)
    ticker.tick()
    assert (earlier.status, later.status) == (Status.FAILURE, Status.SUCCESS)


def test_unknown_leaves_are_ticked_every_time():
    leaf = behaviours.TickCounter("counter", 3, Status.SUCCESS)
    ticker = Ticker(composites.Sequence("root", False, [behaviours.Success("s"), leaf]), incremental=True)
    assert [ticker.tick() for _ in range(4)] == [Status.RUNNING] * 3 + [Status.SUCCESS]


def test_a_subclass_has_to_answer_for_what_it_changes():
    class Polls(Asks):
        def update(self) -> Status:
            return super().update()

    class Named(Asks):
        def hello(self) -> str:
            return self.name

    class Answers(Polls):
        def settled(self) -> bool:
            return True

    class ByItself(Reactive, Behaviour):
        def update(self) -> Status:
            return Status.RUNNING

    class Changed(ByItself):
        def terminate(self, new_status: Status) -> None:
            """Does something."""

    keys = KeyStore({"a": 1})
    assert [takes_part(cls("n", keys, "a", 0)) for cls in (Asks, Polls, Named, Answers)] == [
        True, False, True, True,
    ]  # fmt: skip
    assert takes_part(ByItself("n")) and not takes_part(Changed("n"))
    assert not takes_part(behaviours.Success("n"))
    polls = Polls("polls", keys, "a", 0)
    ticker = Ticker(composites.Sequence("root", False, [polls, behaviours.Running("r")]), incremental=True)
    for _ in range(3):
        ticker.tick()
    assert polls.asked == 3


def test_after_an_exception_everything_is_looked_at_again():
    class Breaks(Behaviour):
        broken = True

        def update(self) -> Status:
            if self.broken:
                raise RuntimeError("a bug")
            return Status.RUNNING

    keys = KeyStore({"a": 1, "b": 1})
    first, breaks = Asks("first", keys, "a", 0), Breaks("breaks")
    ticker = Ticker(composites.Sequence("root", False, [first, breaks]), incremental=True)
    with pytest.raises(RuntimeError):
        ticker.tick()
    keys.write("a", 0)
    breaks.broken = False
    assert ticker.tick() is Status.FAILURE
    keys.write("a", 2)
    assert ticker.tick() is Status.RUNNING


def test_what_comes_in_the_middle_of_its_own_tick_is_not_lost():
    class Hears(Reactive, Behaviour):
        updates = 0

        def update(self) -> Status:
            self.updates += 1
            if self.updates == 1:
                self.touch()  # it has looked already, and now there is something new
                return Status.RUNNING
            return Status.SUCCESS

    ticker = Ticker(Hears("hears"), incremental=True)
    assert [ticker.tick(), ticker.tick()] == [Status.RUNNING, Status.SUCCESS]


def test_what_a_reset_by_the_parent_would_clear_is_not_settled():
    # tick 1: a and b fail, c runs. tick 2: a holds, b still shows FAILURE, c is stopped. tick 3: the root
    # starts anew and resets everything, so b is INVALID.
    def tree(keys: KeyStore) -> Behaviour:
        first = composites.Selector("first", False, [Asks("a", keys, "a", 0), Asks("b", keys, "b", 0)])
        return Selector("root", False, [first, Job("c", [])])

    stock_keys, keys = KeyStore({"a": 0, "b": 0}), KeyStore({"a": 0, "b": 0})
    stock, ours = tree(stock_keys), tree(keys)
    ticker = Ticker(ours, incremental=True)
    seen = []
    for _ in range(3):
        stock.tick_once()
        ticker.tick()
        assert random_trees.state_of(ours) == random_trees.state_of(stock)
        seen.append(stock.children[0].children[1].status)
        stock_keys.write("a", 1)
        keys.write("a", 1)
    assert seen == [Status.FAILURE, Status.FAILURE, Status.INVALID]
