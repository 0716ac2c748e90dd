"""Leaves that stop other nodes in the middle of a tick: the ticker goes on as py_trees does."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import pytest
from py_trees import decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.ticking import Ticker
from tests.unit.behaviours.ticking import random_trees


class Meddles(random_trees.Scripted):
    """Stops a node somewhere in the tree, itself and those above it included, then answers."""

    def update(self) -> Any:
        root: Behaviour = self
        while root.parent is not None:
            root = root.parent
        if self._random.random() < 0.3:
            self._random.choice(list(root.iterate())).stop(Status.INVALID)
        return super().update()


class Script(random_trees.Script):
    """Every fifth leaf meddles."""

    def leaf(self) -> Behaviour:
        if self.random.random() < 0.2:
            return Meddles(self.name("meddles"), self.random.randrange(1 << 30), self.log, False)
        return super().leaf()


def play(seed: int, make_tick: Callable[[Behaviour], Callable[[], object]]) -> list[Any]:
    random_trees.blackboard.Blackboard.clear()
    script = Script(seed)
    root = script.tree(3)
    tick = make_tick(root)
    story: list[Any] = []
    for _ in range(10):
        try:
            tick()
        except (AssertionError, RuntimeError, ValueError) as error:
            return [*story, type(error)]
        story.append((random_trees.state_of(root), tuple(script.log)))
        script.log.clear()
    return story


@pytest.fixture
def restart_time(monkeypatch) -> Callable[[], None]:
    """The time-out of py_trees reads the clock of the operating system; here each look takes a second."""
    return lambda: monkeypatch.setattr(decorators.time, "monotonic", itertools.count().__next__)


def test_random_trees(restart_time):
    for seed in range(800):
        restart_time()
        stock = play(seed, lambda root: root.tick_once)
        restart_time()
        assert play(seed, lambda root: Ticker(root, record=True).tick) == stock, f"seed {seed}"
