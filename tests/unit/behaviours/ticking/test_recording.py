"""The record of changes: following it gives the status of every node after every tick."""

from __future__ import annotations

import itertools

import pytest
from py_trees import behaviours, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.composites import ReactiveSequence
from florence_bt.behaviours.ticking import Ticker
from tests.unit.behaviours.ticking import random_reactive, random_trees


class Follower:
    """Ticks with a recording ticker and keeps the statuses by the record alone."""

    def __init__(self, root: Behaviour) -> None:
        self.root = root
        self.ticker = Ticker(root, record=True)
        self.known = {node: node.status for node in root.iterate()}

    def tick(self) -> None:
        self.ticker.tick()
        self.follow()

    def follow(self) -> None:
        for node, old, new in self.ticker.changes:
            assert old is not new
            assert self.known.get(node, Status.INVALID) is old, node.name
            self.known[node] = new
        for node in self.root.iterate():
            assert self.known.get(node, Status.INVALID) is node.status, node.name


def test_random_trees_with_nodes_of_every_kind(monkeypatch):
    for seed in range(200):
        monkeypatch.setattr(decorators.time, "monotonic", itertools.count().__next__)
        random_trees.blackboard.Blackboard.clear()
        script = random_reactive.ReactiveScript(seed, quiet=False)
        follower = Follower(script.tree(3))
        for _ in range(15):
            follower.tick()
            script.clock.advance(0.3)
            script.keys.write(script.random.choice(random_reactive.KEYS), script.random.randrange(4))
            for job in script.jobs[::2]:
                job.finish(script.random.choice(random_trees.ENDS))
            if script.random.random() < 0.1:
                follower.ticker.stop()
                follower.follow()


def test_changes_come_in_their_order_and_only_for_one_tick():
    # tick 1: a SUCCESS, b RUNNING. tick 2: nothing. tick 3: b SUCCESS, the root too. tick 4: all anew.
    counter = behaviours.TickCounter("b", 2, Status.SUCCESS)
    root = composites.Sequence("root", True, [behaviours.Success("a"), counter])
    ticker = Ticker(root, record=True)

    def told() -> list[tuple[str, str, str]]:
        ticker.tick()
        return [(node.name, old.name, new.name) for node, old, new in ticker.changes]

    assert told() == [
        ("a", "INVALID", "SUCCESS"),
        ("b", "INVALID", "RUNNING"),
        ("root", "INVALID", "RUNNING"),
    ]
    assert told() == []
    assert told() == [("b", "RUNNING", "SUCCESS"), ("root", "RUNNING", "SUCCESS")]
    assert told() == [
        ("a", "SUCCESS", "INVALID"),
        ("b", "SUCCESS", "INVALID"),
        ("a", "INVALID", "SUCCESS"),
        ("b", "INVALID", "RUNNING"),
        ("root", "SUCCESS", "RUNNING"),
    ]


def test_the_record_is_a_sequence():
    root = composites.Sequence("root", True, [behaviours.Success("a"), behaviours.Running("b")])
    ticker = Ticker(root, record=True)
    ticker.tick()
    changes = ticker.changes
    assert len(changes) == 3 and changes[-1] == (root, Status.INVALID, Status.RUNNING)
    assert changes[0] == (root.children[0], Status.INVALID, Status.SUCCESS)
    with pytest.raises(IndexError):
        changes[3]
    ticker.tick()
    assert len(ticker.changes) == 0 and len(changes) == 3  # those of an earlier tick stay as they are
    plain = Ticker(root)
    plain.stop()
    assert not plain.changes


def test_a_composite_that_stops_children_when_it_begins():
    class Fresh(composites.Selector):
        def initialise(self) -> None:
            for child in self.children:
                child.stop(Status.INVALID)

    # tick 1: a fails, b succeeds. tick 2: both are reset first; a runs, b stays INVALID.
    fails = behaviours.StatusQueue("a", [Status.FAILURE, Status.RUNNING], Status.RUNNING)
    follower = Follower(Fresh("fresh", False, [fails, behaviours.Success("b")]))
    follower.tick()
    follower.tick()
    assert [child.status for child in follower.root.children] == [Status.RUNNING, Status.INVALID]


def test_what_a_node_of_ours_stops_is_stopped_by_the_ticker(monkeypatch):
    """``stop`` of py_trees makes debug texts and generators, for every node below."""
    inner = ReactiveSequence("inner", [behaviours.Success("a"), behaviours.Success("b")], [None, None])
    asked = ReactiveSequence("asked", [inner, behaviours.Success("c")], [None, None])
    root = ReactiveSequence("root", [asked, behaviours.Running("works")], [None, None])
    follower = Follower(root)
    follower.tick()
    follower.tick()
    stopped = []
    monkeypatch.setattr(Behaviour, "stop", lambda self, new=Status.INVALID: stopped.append(self.name))
    follower.tick()
    assert stopped == []
    assert [(node.name, new.name) for node, _, new in follower.ticker.changes] == [
        *((name, "INVALID") for name in ("a", "b", "inner", "c")),
        *((name, "SUCCESS") for name in ("a", "b", "inner", "c")),
    ]
