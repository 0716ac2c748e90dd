"""Whole missions, ticked by py_trees and by us: all that can be seen is equal."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import explain
from tests.sweeps import sweep
from tests.unit.behaviours.ticking.random_missions import KEYS, Stage, write

CHUNK = 20
STEPS = 25
TICKS_AT_ONE_MOMENT = 6
Ticks = tuple[Callable[[], object], Callable[[], object]]


def by_py_trees(root: Behaviour) -> Ticks:
    return root.tick_once, lambda: root.stop(Status.INVALID)


def by_us(root: Behaviour) -> Ticks:
    ticker = Ticker(root, record=True)
    return ticker.tick, ticker.stop


def look(stage: Stage) -> list[Any]:
    """The tree, why it failed, the keys, the open runs and the timers."""
    nodes = []
    for node in stage.root.iterate():
        tip, result = node.tip(), getattr(node, "result", None)
        told = (node.feedback_message, result) if node.status is not Status.INVALID else None
        nodes.append((node.name, node.status, told, tip and tip.name))
    keys = stage.context.keys.as_dict()
    runs = [run.path for run in stage.context.runs]
    log = tuple(stage.log)
    stage.log.clear()
    return [nodes, explain(stage.root), keys, runs, stage.clock.next_time(), log]


def play(stage: Stage, seed: int, make: Callable[[Behaviour], Ticks]) -> list[Any]:
    tick, stop = make(stage.root)
    chance = random.Random(seed + 2)
    woken = stage.context.wake.take
    stage.tick(tick)
    story = [look(stage)]
    for _ in range(STEPS):
        for _ in range(chance.choice((0, 1, 1, 2))):
            stage.context.keys.write(chance.choice(KEYS), chance.randrange(4))
        dice, due = chance.random(), stage.clock.next_time()
        if dice < 0.5 and due is not None:
            stage.clock.advance_to(due)  # whatever ends at the same instant ends before the next tick
        elif dice < 0.65:
            stage.clock.advance(0.5)
        elif dice < 0.68:
            stop()
        asked = woken()
        story.append([asked])
        # Ticked when asked for, as an executor does, and sometimes when nothing is new.
        for _ in range(TICKS_AT_ONE_MOMENT if asked or chance.random() < 0.3 else 0):
            stage.tick(tick)
            story.append(look(stage))
            if not woken():
                break
    return story


@pytest.mark.parametrize("first", sweep(range(0, 80, CHUNK), every=4))
def test_random_missions(first, tmp_path: Path):
    for seed in range(first, first + CHUNK):
        library = write(seed, tmp_path)
        stock = play(Stage(library, seed), seed, by_py_trees)
        assert play(Stage(library, seed), seed, by_us) == stock, f"seed {seed}"


@pytest.mark.parametrize("first", sweep(range(0, 120, CHUNK), every=6))
def test_random_missions_with_watched_skills(first, tmp_path: Path):
    for seed in range(first, first + CHUNK):
        library = write(seed, tmp_path, asks=True)
        stock = play(Stage(library, seed), seed, by_py_trees)
        assert play(Stage(library, seed), seed, by_us) == stock, f"seed {seed}"


@pytest.mark.parametrize("asks", [False, True])
@pytest.mark.parametrize("first", sweep(range(0, 80, CHUNK), every=4))
def test_random_missions_that_deal_with_failures(first, asks, tmp_path: Path):
    for seed in range(first, first + CHUNK):
        library = write(seed, tmp_path, asks=asks, catches=True)
        stock = play(Stage(library, seed), seed, by_py_trees)
        assert play(Stage(library, seed), seed, by_us) == stock, f"seed {seed}"


@pytest.mark.parametrize("catches", [False, True])
@pytest.mark.parametrize("asks", [False, True])
@pytest.mark.parametrize("first", sweep(range(0, 60, CHUNK), every=3))
def test_random_missions_whose_branches_are_built_when_they_are_reached(first, asks, catches, tmp_path: Path):
    for seed in range(first, first + CHUNK):
        library = write(seed, tmp_path, asks=asks, catches=catches)
        stock = play(Stage(library, seed), seed, by_us)
        for make in (by_us, by_py_trees):
            assert play(Stage(library, seed, as_reached=True), seed, make) == stock, f"seed {seed}"
