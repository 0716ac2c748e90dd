"""What a tick costs, and how soon the next skill starts after the one before has ended."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path

import py_trees
import pytest
from py_trees import behaviours
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from benchmarks import trees
from benchmarks.measure import seconds_per_call, size
from benchmarks.mocks import succeeding
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.ticking import Ticker
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import BaseRun, Event
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRequest, RunIds
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import make_context

BRANCHES, LEAVES = 6, 5
NODES, LARGE, LEVELS = size([10, 100, 1000, 10_000], [10, 100]), size(10_000, 100), size(200, 10)
"""Nodes of the trees that are compared, of a large reactive one, and levels of a nested one."""
KINDS_OF_LEAF = size(list(trees.LEAVES.values()), list(trees.LEAVES.values())[:1])
THOUSANDS = size(3, 1)
"""Conditions of a mission; a file of 100 kB holds no more."""
RUNS, IDLE_TICKS, ROUNDS = size((30, 200, 20), (1, 2, 1))
EXECUTOR_TICKS, REACTIONS = size((2000, 2000), (5, 5))
BARE, RECORDED = 4.0, 2.0
"""How much faster a full tick of a large tree is at least, without and with a record."""


class OpenRun(BaseRun):
    """A run that ends when the benchmark says so."""

    def __init__(self) -> None:
        super().__init__("working")
        self.handle(Event.ACCEPTED)

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
    """Microseconds, per visited node or per tick."""

    tree_tick: float
    tick_once: float
    ours: float
    recorded: float


@pytest.mark.parametrize("shape", ["chain", "wide"])
@pytest.mark.parametrize("nodes", NODES)
def test_tick_against_py_trees(benchmark, figures, shape, nodes):
    found = [
        compare(partial(getattr(trees, shape), nodes, composite, leaf))
        for composite in (trees.sequence, trees.sequence_with_memory, trees.selector, trees.parallel)
        for leaf in KINDS_OF_LEAF
        if nodes < 10_000 or composite in (trees.sequence, trees.parallel)
    ]
    benchmark.pedantic(Ticker(getattr(trees, shape)(nodes, trees.parallel, trees.Busy)).tick, rounds=ROUNDS)
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
        figures.limit(min(bare), least=BARE)
        figures.limit(min(recorded), least=RECORDED)


def test_a_nested_chain(benchmark, figures):
    """Many levels: py_trees hands every visited node up through all of them."""
    make = partial(trees.nested, 2 * LEVELS, trees.sequence, behaviours.Success)
    found = compare(make)
    benchmark.pedantic(Ticker(make()).tick, rounds=ROUNDS)
    figures.add(
        f"full tick of {2 * LEVELS} nodes, {LEVELS} levels deep: times faster than `BehaviourTree.tick` of "
        "py_trees",
        f"{found.tree_tick / found.ours:.0f} bare, {found.tree_tick / found.recorded:.0f} recorded",
        f"{found.ours:.2f} us per visited node, py_trees {found.tree_tick:.1f} us",
    )
    figures.limit(found.tree_tick / found.ours, least=BARE)
    figures.limit(found.tree_tick / found.recorded, least=RECORDED)


def test_a_mission_of_forty_nodes(benchmark, figures):
    assert trees.node_count(trees.mission()) == 40
    found = seconds_per_call(
        py_trees.trees.BehaviourTree(trees.mission()).tick,
        trees.mission().tick_once,
        Ticker(trees.mission()).tick,
        Ticker(trees.mission(), record=True).tick,
    )
    benchmark.pedantic(Ticker(trees.mission()).tick, rounds=10 * ROUNDS)
    tree_tick, once, ours, recorded = (seconds * 1e6 for seconds in found)
    figures.add(
        "mission of 40 nodes in plain py_trees: times faster than `BehaviourTree.tick` of py_trees",
        f"{tree_tick / ours:.1f} bare, {tree_tick / recorded:.1f} recorded",
        f"{ours:.1f} and {recorded:.1f} us a tick; py_trees {tree_tick:.0f} us, its `root.tick_once()` "
        f"{once:.0f} us",
    )
    figures.limit(tree_tick / ours, least=3.0)
    figures.limit(tree_tick / recorded, least=2.0)


ENGINES: dict[str, Callable[[Behaviour], Callable[[], object]]] = {
    "tree_tick": lambda root: py_trees.trees.BehaviourTree(root).tick,
    "tick_once": lambda root: root.tick_once,
    "ours": lambda root: Ticker(root).tick,
    "recorded": lambda root: Ticker(root, record=True).tick,
}
"""What ticks a tree, by the field of a :class:`Comparison`."""
SHIPPED: dict[str, dict[str, str]] = {
    "goto_user": {},
    "detect_user": {},
    "approach_user": {"user": "{x: 1 m, y: 2 m, yaw: 90 deg}"},
    "goto_room": {"room": "kitchen"},
}
"""The shipped missions with inputs that they need."""
DECLARATIONS, LIBRARY = collect_declarations(), MissionLibrary.load([])


class Shipped:
    """A shipped mission whose skills all succeed, after a second when they take time."""

    def __init__(self, name: str) -> None:
        self.clock = ManualClock()
        skills = {skill: succeeding(each, self.clock) for skill, each in DECLARATIONS.items()}
        self.context = make_context(self.clock, skills, DECLARATIONS)
        mission = LIBRARY.get(name)
        inputs = parse_inputs(mission, SHIPPED[name])
        self.root = compile_mission(mission, LIBRARY, inputs, self.context).root

    def seconds(self, tick: Callable[[], object]) -> float:
        """How long a tick takes on average, from the first one to the end of the mission."""
        ticks, spent = 0, 0.0
        while not ticks or self.root.status is Status.RUNNING:
            begin = time.perf_counter()
            tick()
            spent += time.perf_counter() - begin
            ticks += 1
            while not self.context.wake.take() and self.root.status is Status.RUNNING:
                assert self.clock.run_next()
        assert self.root.status is Status.SUCCESS
        return spent / ticks

    def seconds_idle(self, tick: Callable[[], object]) -> float:
        """How long a tick takes in which nothing is new."""
        for _ in range(3):
            tick()
        begin = time.perf_counter()
        for _ in range(IDLE_TICKS):
            tick()
        return (time.perf_counter() - begin) / IDLE_TICKS


def best(name: str, measure: Callable[[Shipped, Callable[[], object]], float]) -> Comparison:
    """Microseconds per tick: the best of many runs with a tree of their own, the engines side by side."""
    found = dict.fromkeys(ENGINES, float("inf"))
    for _ in range(RUNS):
        for engine, make_tick in ENGINES.items():
            shipped = Shipped(name)
            found[engine] = min(found[engine], measure(shipped, make_tick(shipped.root)) * 1e6)
    return Comparison(**found)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_mission(benchmark, figures, name):
    nodes = trees.node_count(Shipped(name).root)
    run, idle = best(name, Shipped.seconds), best(name, Shipped.seconds_idle)
    benchmark.pedantic(Ticker(Shipped(name).root, record=True).tick, rounds=1)
    figures.add(
        f"tick of `{name}`, {nodes} nodes, recorded: mean of a run",
        f"{run.recorded:.0f} us",
        f"bare {run.ours:.0f} us; `root.tick_once()` of py_trees {run.tick_once:.0f} us, its "
        f"`BehaviourTree.tick` {run.tree_tick:.0f} us; with the starts of the skills",
    )
    figures.add(
        f"tick of `{name}`, {nodes} nodes, recorded: nothing is new",
        f"{idle.recorded:.1f} us",
        f"bare {idle.ours:.1f} us; `root.tick_once()` of py_trees {idle.tick_once:.1f} us, its "
        f"`BehaviourTree.tick` {idle.tree_tick:.1f} us",
    )
    figures.limit(run.recorded, most=run.tick_once)
    figures.limit(idle.recorded, most=idle.tick_once / 2)


@pytest.mark.parametrize("composite", [trees.sequence, trees.parallel])
def test_a_large_reactive_tree(benchmark, figures, composite):
    """Conditions that hold and one leaf that works: every tick asks all of them."""
    keys = [KeyStore(), KeyStore()]
    stock, ours = (
        trees.sequence(
            "root", [trees.wide(LARGE, composite, trees.conditions(store)), behaviours.Running("works")]
        )
        for store in keys
    )
    tick = Ticker(ours, record=True).tick
    tree_tick, recorded = seconds_per_call(py_trees.trees.BehaviourTree(stock).tick, tick)
    benchmark.pedantic(tick, rounds=ROUNDS)
    figures.add(
        f"tick of {LARGE:,} reactive nodes (ten-ary {composite.__name__})",
        f"{recorded * 1e3:.1f} ms",
        f"`BehaviourTree.tick` of py_trees {tree_tick * 1e3:.0f} ms",
    )
    figures.limit(tree_tick / recorded, least=RECORDED)


def conditions(depth: int) -> str:
    """10 to the power of ``depth`` nodes `condition` below sequences without memory, as YAML."""
    if depth == 0:
        return '{"condition": "$n >= 0"}'
    return f'{{"memory": false, "sequence": [{", ".join([conditions(depth - 1)] * 10)}]}}'


def test_conditions_of_a_mission(benchmark, figures, tmp_path):
    """The same in the mission language: conditions over one key, below a step that works."""
    many = ", ".join([conditions(3)] * THOUSANDS)
    (tmp_path / "bench.yaml").write_text(
        "mission: bench\nkeys: {n: {type: integer, default: 0}}\n"
        f'tree: {{"memory": false, "sequence": [{many}, {{"wait": "1 s"}}]}}\n'
    )
    library = MissionLibrary.load([tmp_path], built_in=False)
    context = make_context(ManualClock(), {}, {})
    tree = compile_mission(library.get("bench"), library, {}, context)
    tick, numbers = Ticker(tree.root, record=True).tick, count(1)

    def change_and_tick() -> None:
        tree.keys.write("n", next(numbers))
        tick()

    idle, changed = seconds_per_call(tick, change_and_tick)
    benchmark.pedantic(tick, rounds=ROUNDS)
    assert tree.root.status is Status.RUNNING
    figures.add(
        f"tick of {1000 * THOUSANDS:,} nodes `condition` of a mission, no key has changed",
        f"{idle * 1e3:.0f} ms",
        f"{changed * 1e3:.0f} ms when a key has changed that all of them read",
    )
    figures.limit(idle, most=changed)


def test_tick_of_the_executor(benchmark, figures, tmp_path):
    """Ticks in which nothing is new: what the executor adds to the tree."""
    executor, _skill, clock = executor_with(tmp_path, mission_body())
    run = executor.trigger(MissionRequest("bench"))
    clock.advance(0.0)

    def tick():
        clock.advance(0.001)
        executor.wake()
        clock.advance(0.0)

    before = run.ticks
    benchmark.pedantic(tick, rounds=EXECUTOR_TICKS)
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
    executor.trigger(MissionRequest("bench"))
    clock.advance(0.0)
    reactions = []

    def react():
        clock.advance(0.001)
        begin = time.perf_counter()
        skill.runs[-1].handle(Event.FINISHED, success())
        clock.advance(0.0)
        reactions.append(skill.started - begin)

    benchmark.pedantic(react, rounds=REACTIONS, warmup_rounds=ROUNDS)
    reactions.sort()
    median, late = statistics.median(reactions) * 1e6, reactions[int(0.99 * len(reactions))] * 1e6
    figures.add(
        "from a skill's end to the next skill's start, in process",
        f"{median:.0f} us",
        f"99th percentile {late:.0f} us; at most 100 us",
    )
    figures.limit(median, most=100.0)
