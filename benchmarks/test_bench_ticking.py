"""What a tick costs, and how soon the next skill starts after the one before has ended."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import py_trees
import pytest
from py_trees import behaviours, composites
from py_trees.behaviour import Behaviour

from benchmarks import trees
from benchmarks.measure import seconds_per_call
from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import Event, RunState
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import Request, RunIds
from florence_bt.runtime.ticking import Ticker
from florence_bt.trees.language.loader import MissionLibrary

BRANCHES, LEAVES = 6, 5


class OpenRun(RunState):
    """A run that ends when the benchmark says so."""

    def __init__(self) -> None:
        super().__init__("working")
        self.handle(Event.ACCEPTED)

    def poll(self):
        return self.result

    def cancel(self) -> None:
        self.handle(Event.CANCEL)
        self.handle(Event.FINISHED, success())


class OpenSkill:
    """Starts runs and remembers them and when they began."""

    def __init__(self) -> None:
        self.runs: list[OpenRun] = []
        self.started = 0.0

    def start(self, inputs):
        self.started = time.perf_counter()
        self.runs.append(OpenRun())
        return self.runs[-1]


def executor_with(tmp_path: Path, body: str) -> tuple[Executor, OpenSkill, ManualClock]:
    (tmp_path / "bench.yaml").write_text(f"mission: bench\ndescription: for the benchmark\ntree:\n{body}")
    clock, skill = ManualClock(), OpenSkill()
    executor = Executor(
        MissionLibrary.load([tmp_path], built_in=False),
        {"work": skill},
        {"work": SkillDeclaration("work", "Work", deadline_s=1e9)},
        clock,
        RunIds("bench"),
    )
    executor.add_listener(lambda run, event: None)
    return executor, skill, clock


def mission_body() -> str:
    """37 nodes: leaves that all run, below parallels."""
    lines = ["  parallel:"]
    for _ in range(BRANCHES):
        lines.append("    - parallel:")
        lines += ["        - work:"] * LEAVES
    return "\n".join(lines) + "\n"


def plain_tree() -> py_trees.trees.BehaviourTree:
    """The same shape in plain py_trees."""
    branches = [
        trees.parallel(f"branch {n}", [trees.Busy(f"leaf {n} {m}") for m in range(LEAVES)])
        for n in range(BRANCHES)
    ]
    return py_trees.trees.BehaviourTree(trees.parallel("root", branches))


def compare(make: Callable[[], Behaviour]) -> Comparison:
    """Tick the same tree in four ways, side by side."""
    visited = sum(1 for _ in make().tick())
    times = seconds_per_call(
        py_trees.trees.BehaviourTree(make()).tick,
        make().tick_once,
        Ticker(make()).tick,
        Ticker(make(), record=True).tick,
    )
    return Comparison(*(seconds / visited * 1e6 for seconds in times))


@dataclass(frozen=True)
class Comparison:
    """Microseconds per visited node."""

    tree_tick: float
    tick_once: float
    ours: float
    recorded: float


@pytest.mark.parametrize("shape", ["chain", "wide"])
@pytest.mark.parametrize("nodes", [10, 100, 1000, 10_000])
def test_tick_against_py_trees(benchmark, figures, shape, nodes):
    found = [
        compare(partial(getattr(trees, shape), nodes, composite, leaf))
        for composite in (trees.sequence, trees.sequence_with_memory, trees.selector, trees.parallel)
        for leaf in trees.LEAVES.values()
        if nodes < 10_000 or composite in (trees.sequence, trees.parallel)
    ]
    benchmark.pedantic(Ticker(getattr(trees, shape)(nodes, trees.parallel, trees.Busy)).tick, rounds=20)
    bare = [each.tree_tick / each.ours for each in found]
    recorded = [each.tree_tick / each.recorded for each in found]
    once = [each.tick_once / each.ours for each in found]
    times = sorted(each.ours for each in found)
    name = {"chain": "one composite", "wide": "ten-ary tree"}[shape]
    figures.add(
        f"full tick of {nodes} nodes, {name}: times faster than `BehaviourTree.tick` of py_trees",
        f"{min(bare):.1f} bare, {min(recorded):.1f} recorded",
        f"the least of {len(found)} trees, median {statistics.median(bare):.0f} and "
        f"{statistics.median(recorded):.0f}; against `root.tick_once()` {min(once):.1f}, median "
        f"{statistics.median(once):.0f}; {statistics.median(times):.2f} us per visited node",
    )
    if nodes >= 100:
        assert min(bare) >= 8.0 and min(recorded) >= 5.0


def test_a_nested_chain(benchmark, figures):
    """200 levels: py_trees hands every visited node up through all of them."""
    make = partial(trees.nested, 400, trees.sequence, behaviours.Success)
    found = compare(make)
    benchmark.pedantic(Ticker(make()).tick, rounds=20)
    figures.add(
        "full tick of 400 nodes, 200 levels deep: times faster than `BehaviourTree.tick` of py_trees",
        f"{found.tree_tick / found.ours:.0f} bare, {found.tree_tick / found.recorded:.0f} recorded",
        f"{found.ours:.2f} us per visited node, py_trees {found.tree_tick:.1f} us",
    )
    assert found.tree_tick / found.ours >= 8.0 and found.tree_tick / found.recorded >= 5.0


def test_a_mission_of_forty_nodes(benchmark, figures):
    assert trees.node_count(trees.mission()) == 40
    found = seconds_per_call(
        py_trees.trees.BehaviourTree(trees.mission()).tick,
        trees.mission().tick_once,
        Ticker(trees.mission()).tick,
        Ticker(trees.mission(), record=True).tick,
    )
    benchmark.pedantic(Ticker(trees.mission()).tick, rounds=200)
    tree_tick, once, ours, recorded = (seconds * 1e6 for seconds in found)
    figures.add(
        "mission of 40 nodes: times faster than `BehaviourTree.tick` of py_trees",
        f"{tree_tick / ours:.1f} bare, {tree_tick / recorded:.1f} recorded",
        f"{ours:.1f} and {recorded:.1f} us a tick; py_trees {tree_tick:.0f} us, its `root.tick_once()` "
        f"{once:.0f} us",
    )
    assert tree_tick / ours >= 3.0 and tree_tick / recorded >= 2.0


def changing(tick: Callable[[], object], keys: KeyStore, key: str, values: Iterator[object]):
    """A call that writes a key and ticks."""

    def change_and_tick() -> None:
        keys.write(key, next(values))
        tick()

    return change_and_tick


@pytest.mark.parametrize("shape", ["chain", "wide"])
@pytest.mark.parametrize("composite", [trees.sequence, trees.parallel])
def test_reaction_to_a_key_in_a_reactive_tree(benchmark, figures, shape, composite):
    """10,000 nodes, all of them conditions that hold, and one leaf that works; one key changes."""

    def grow() -> tuple[KeyStore, Behaviour, list[str]]:
        keys = KeyStore()
        tree = getattr(trees, shape)(10_000, composite, trees.conditions(keys))
        return keys, trees.sequence("root", [tree, trees.Works("works")]), list(keys)

    _, stock, _ = grow()
    _, ours, _ = grow()
    keys, reactive, names = grow()
    tick = Ticker(reactive, record=True, incremental=True).tick
    same = changing(tick, keys, names[len(names) // 2], itertools.count(1))
    flip = changing(tick, keys, names[-1], itertools.cycle((False, True)))
    tree_tick, full, same_s, flip_s = seconds_per_call(
        py_trees.trees.BehaviourTree(stock).tick, Ticker(ours).tick, same, flip
    )
    benchmark.pedantic(same, rounds=100)
    name = {"chain": "one", "wide": "ten-ary"}[shape] + f" {composite.__name__}"
    figures.add(
        f"one key changes below 10,000 reactive nodes ({name}): incremental tick",
        f"{same_s * 1e6:.1f} us, {flip_s * 1e6:.1f} us when the answer changes",
        f"full tick {full * 1e3:.1f} ms, `BehaviourTree.tick` of py_trees {tree_tick * 1e3:.0f} ms",
    )
    assert same_s < 1e-4 and flip_s < 1e-4


def test_reaction_below_many_levels(benchmark, figures):
    """400 sequences, one in the other, each behind 24 conditions; the innermost of 10,000 nodes changes."""
    levels, width = 400, 24

    def grow() -> tuple[KeyStore, Behaviour]:
        keys = KeyStore()
        make = trees.conditions(keys)
        node = trees.sequence("end", [make("bottom"), trees.Works("works")])
        for level in range(levels - 1):
            asked = [make(f"leaf {level} {n}") for n in range(width)]
            node = trees.sequence(f"level {level}", [*asked, node])
        guarded = composites.Selector("root", False, [node, trees.Works("otherwise")])
        return keys, guarded

    _, stock = grow()
    keys, reactive = grow()
    ticker = Ticker(reactive, record=True, incremental=True)
    same = changing(ticker.tick, keys, "bottom", itertools.count(1))
    flip = changing(ticker.tick, keys, "bottom", itertools.cycle((False, True)))
    tree_tick, same_s, flip_s = seconds_per_call(py_trees.trees.BehaviourTree(stock).tick, same, flip)
    benchmark.pedantic(same, rounds=100)
    figures.add(
        "one key changes below 400 levels, 10,000 reactive nodes: incremental tick",
        f"{same_s * 1e6:.0f} us, {flip_s * 1e6:.0f} us when the status of all 400 changes with it",
        f"`BehaviourTree.tick` of py_trees {tree_tick * 1e3:.0f} ms",
    )
    assert same_s < 1e-4 and flip_s < 3e-6 * levels


def test_tick_of_the_executor(benchmark, figures, tmp_path):
    """Ticks in which nothing is new: what the executor adds to the tree."""
    executor, _skill, clock = executor_with(tmp_path, mission_body())
    run = executor.trigger(Request("bench"))
    clock.advance(0.0)

    def tick():
        clock.advance(0.001)
        executor.wake()
        clock.advance(0.0)

    before = run.ticks
    benchmark(tick)
    assert run.ticks > before
    tree = plain_tree()
    tree.tick()
    plain_us = seconds_per_call(tree.tick)[0] * 1e6
    figures.add(
        "tick of the executor, nothing new, 37 nodes",
        f"{benchmark.stats.stats.median * 1e6:.1f} us",
        f"with the clock and the wake-up; `BehaviourTree.tick` of py_trees alone {plain_us:.0f} us",
    )


def test_reaction_in_process(benchmark, figures, tmp_path):
    executor, skill, clock = executor_with(
        tmp_path, "  repeat: 1000000\n  do:\n    sequence:\n      - work:\n"
    )
    executor.trigger(Request("bench"))
    clock.advance(0.0)
    reactions = []

    def react():
        clock.advance(0.001)
        begin = time.perf_counter()
        skill.runs[-1].handle(Event.FINISHED, success())
        clock.advance(0.0)
        reactions.append(skill.started - begin)

    benchmark.pedantic(react, rounds=2000, warmup_rounds=20)
    reactions.sort()
    median, late = statistics.median(reactions) * 1e6, reactions[int(0.99 * len(reactions))] * 1e6
    figures.add(
        "from a skill's end to the next skill's start, in process",
        f"{median:.0f} us",
        f"99th percentile {late:.0f} us; at most 100 us",
    )
    assert median < 100.0
