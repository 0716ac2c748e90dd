"""Every pair of modifiers on every kind of node, and random missions: the engine does what the page says."""

from __future__ import annotations

import itertools
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from florence_bt.trees.kinds.words import NODE_KINDS
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.vocabulary import ANYWHERE
from tests.sweeps import examples, sweep
from tests.unit.trees.interpreted import Writer, by_the_engine, by_the_page, file_of
from tests.unit.trees.interpreter import MODIFIERS, Node, World

TASK: Node = {"task": {"name": "body"}}
DO: Node = {"sequence": [{"append": {"l": "$x"}}, TASK]}
BRANCHES = [{"name": "one", **TASK}, {"name": "two", "wait": "2 s"}]
KINDS: dict[str, tuple[Node, Node]] = {
    "sequence": ({"sequence": [{"condition": "$a < 3"}, TASK]}, {"memory": False}),
    "selector": ({"selector": [{"condition": "$a > 2"}, TASK]}, {"memory": False}),
    "parallel": ({"parallel": BRANCHES}, {"policy": ["one"]}),
    "parallel of any": ({"parallel": BRANCHES}, {"policy": "any"}),
    "parallel that counts": ({"parallel": BRANCHES}, {"policy": {"succeed": 1, "fail": 1}}),
    "if": ({"if": "$a < 2", "then": TASK}, {"else": {"wait": "1 s"}, "memory": False}),
    "switch": ({"switch": "$a", "cases": {1: TASK}}, {"default": TASK}),
    "for_each": (
        {"for_each": [1, 2], "as": "x", "do": DO},
        {"index": "y", "go_on_over": ["broken"], "first_success": True, "code": "own"},
    ),
    "retry": (
        {"retry": 3, "do": DO},
        {"on": ["out_of_order"], "attempt": "x", "between": {"wait": "0.5 s"}},
    ),
    "repeat": ({"repeat": 3, "do": DO}, {}),
    "timeout": ({"timeout": "2 s", "do": TASK}, {}),
    "once": ({"once": TASK}, {}),
    "invert": ({"invert": TASK}, {"code": "own"}),
    "succeed": ({"succeed": TASK}, {}),
    "condition": ({"condition": "$a == 1"}, {"code": "own"}),
    "fail": ({"fail": "no"}, {"code": "own"}),
    "wait": ({"wait": "2 s"}, {}),
    "wait_until": ({"wait_until": "$a == 2"}, {"timeout": "0.5 s"}),
    "set": ({"set": {"a": "$b", "b": "$a"}}, {}),
    "add": ({"add": {"a": 1}}, {}),
    "append": ({"append": {"l": 1}}, {}),
    "run": ({"run": "sub"}, {"with": {"x": "$a"}, "out": {"y": "b"}}),
    "skill": (TASK, {"out": {"n": "a"}}),
}
"""Kinds of nodes, each with what only that kind can have."""
GENERAL: dict[str, list[object]] = {
    "name": ["a name"],
    "when": ["$a == 1", "$a == 2"],
    "ensure": ["$a == 2"],
    "while": ["$a < 2", "$a < 1"],
    "interrupted_by": [
        {"if": "$a == 2", "do": {"sequence": [{"task": {"name": "first"}}, {"set": {"a": 1}}]}},
        {"if": {"task": {"name": "calls"}}, "do": {"task": {"name": "first"}, "when": "$a < 3"}},
    ],
    "until": ["$a == 2", {"task": {"name": "goal"}}],
    "on_failure": [
        {"any": {"task": {"name": "mends"}}},
        {
            "broken": {"task": {"name": "mends"}, "when": "$a == 1"},
            "guard_failed": {"fail": "no", "code": "other"},
        },
    ],
    "because": ["a reason"],
    "finally": [{"sequence": [{"wait": "0.5 s"}, {"task": {"name": "tidy"}}]}],
    "code": ["own"],
}
"""What every node can have, and ``code``, each with some values."""
OWNS_CODE = ("for_each", "invert", "condition", "fail")
ENDS = {
    "after a second": (1.0, None, 2),
    "at once": (0.0, None, 2),
    "broken": (1.5, "broken", 0),
    "odd, at once": (0.0, "odd", 0),
}
"""How the body ends."""


def modified(kind: str) -> list[Node]:
    """The nodes of a kind with every pair of modifiers."""
    plain, own = KINDS[kind]
    values = {**GENERAL, **{modifier: [each] for modifier, each in own.items()}}
    return [
        {**plain, one: first, other: second}
        for one, other in itertools.combinations(values, 2)
        for first, second in itertools.product(values[one], values[other])
    ]


def is_refused(node: Node) -> bool:
    """Whether it is not clear, or not so, that the node has a failure of its own that ``code`` names."""
    if "code" not in node:
        return False
    guards = [word for word in ("while", "until", "ensure") if word in node]
    owns = any(kind in node for kind in OWNS_CODE)
    if "for_each" in node and guards and "first_success" not in node:
        owns = False  # it has none: the code is that of the guard
    return len(guards) + owns != 1


def mission_of(node: Node) -> Node:
    """The node, then a task; beside it a key changes after a second."""
    changes = {"sequence": [{"wait": "1 s"}, {"set": {"a": 2}}, {"wait": "1 s"}, {"set": {"a": 3}}]}
    return {"parallel": [{"sequence": [node, {"task": {"name": "next"}}]}, changes]}


def test_the_modifiers_and_kinds_of_the_language_are_all_here():
    assert set(MODIFIERS) == set(ANYWHERE) and set(ANYWHERE) <= set(GENERAL)
    assert {key for plain, _ in KINDS.values() for key in plain} >= set(NODE_KINDS)


@pytest.mark.parametrize(("kind", "end"), sweep(itertools.product(KINDS, ENDS), every=3))
def test_every_pair_of_modifiers(tmp_path: Path, kind: str, end: str):
    tasks = World(
        {
            "body": [ENDS[end], (1.0, None, 3)],
            "goal": [(0.5, "broken", 0), (0.5, None, 0)],
            "calls": [(0.5, None, 0), (0.5, "broken", 0), (0.5, None, 0), (100.0, None, 0)],
            "first": [(0.5, None, 0), (0.5, None, 0), (0.5, "odd", 0)],
            **{name: [(1.0, None, 0)] for name in ("next", "mends", "tidy", "sub")},
        }
    )
    for number, node in enumerate(modified(kind)):
        if is_refused(node):
            continue
        tree = mission_of(node)
        stop_at = (None, None, 1.25, 2.25)[number % 4]
        assert by_the_engine(tmp_path, tree, tasks, stop_at) == by_the_page(tree, tasks, stop_at), node


@pytest.mark.parametrize("kind", KINDS)
def test_a_pair_that_means_nothing_or_two_things_is_refused_and_no_other(tmp_path: Path, kind: str):
    for node in modified(kind):
        (tmp_path / "m.yaml").write_text(file_of(mission_of(node)))
        mission = MissionLibrary.load([tmp_path], built_in=False).get("m")
        assert bool(mission.findings) is is_refused(node), (node, mission.findings)


def compare(folder: Path, writer: Writer) -> None:
    tree = writer.node(writer.pick((1, 2, 2, 3)))
    stop_at = writer.pick((None, None, 0.25, 1.25, 2.25))
    tasks = World(writer.tasks)
    assert by_the_engine(folder, tree, tasks, stop_at) == by_the_page(tree, tasks, stop_at), tree


@pytest.mark.parametrize("first", sweep(range(0, 3000, 250), every=6))
def test_random_missions(tmp_path: Path, first: int):
    for seed in range(first, first + 250):
        compare(tmp_path, Writer(random.Random(seed).choice))


@settings(max_examples=examples(200), suppress_health_check=list(HealthCheck), deadline=None)
@given(st.data())
def test_small_missions_of_hypothesis(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject):
    folder = tmp_path_factory.getbasetemp()
    compare(folder, Writer(lambda options: data.draw(st.sampled_from(list(options)))))
