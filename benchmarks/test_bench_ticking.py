"""What a tick costs, and how soon the next skill starts after the one before has ended."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import py_trees
from py_trees.common import Status

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import Event, RunState
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import Request, RunIds
from florence_bt.trees.loader import MissionLibrary

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
    """40 nodes: selectors whose leaves all run, under one parallel."""
    lines = ["  parallel:"]
    for _ in range(BRANCHES):
        lines.append("    - parallel:")
        lines += ["        - work:"] * LEAVES
    return "\n".join(lines) + "\n"


def count_visited(root: py_trees.behaviour.Behaviour) -> int:
    return sum(1 for _ in root.tick())


class Busy(py_trees.behaviour.Behaviour):
    """A leaf of plain py_trees that keeps running."""

    def update(self) -> Status:
        return Status.RUNNING


def plain_tree() -> py_trees.trees.BehaviourTree:
    """The same shape in plain py_trees."""
    policy = py_trees.common.ParallelPolicy.SuccessOnAll()
    root = py_trees.composites.Parallel("root", policy)
    for branch in range(BRANCHES):
        inner = py_trees.composites.Parallel(f"branch {branch}", policy)
        inner.add_children([Busy(f"leaf {branch} {leaf}") for leaf in range(LEAVES)])
        root.add_child(inner)
    return py_trees.trees.BehaviourTree(root)


def test_tick_per_visited_node(benchmark, figures, tmp_path):
    executor, _skill, clock = executor_with(tmp_path, mission_body())
    executor.trigger(Request("bench"))
    clock.advance(0.0)
    visited = count_visited(executor._tree.root)

    def tick():
        clock.advance(0.001)
        executor.wake()
        clock.advance(0.0)

    benchmark(tick)
    plain = plain_tree()
    plain.tick()
    plain_times = []
    for _ in range(2000):
        begin = time.perf_counter()
        plain.tick()
        plain_times.append(time.perf_counter() - begin)
    plain_us = statistics.median(plain_times) / visited * 1e6
    ours_us = benchmark.stats.stats.median / visited * 1e6
    figures.add(
        "tick of the executor, per visited node",
        f"{ours_us:.2f} us",
        f"{visited} nodes visited; plain py_trees in this run {plain_us:.2f} us",
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
    figures.add(
        "from a skill's end to the next skill's start, in process",
        f"{statistics.median(reactions) * 1e6:.0f} us",
        f"99th percentile {reactions[int(0.99 * len(reactions))] * 1e6:.0f} us",
    )
