"""The names of topics have one home: elsewhere no text is one."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import florence_bt
from florence_bt.core import topic_names

PACKAGE = Path(florence_bt.__file__).parent
HOME = Path(topic_names.__file__)
TOPICS = {value for name, value in vars(topic_names).items() if name.isupper() and isinstance(value, str)}
ALSO_OTHERS = {
    "robot_description",
    "manual_override",
    "navigate_to_pose",
    "navigate_through_poses",
    "user_lying",
}
"""Names of a node, of a field and of skills, too."""
TELLING = {each for each in TOPICS if "/" in each or "_" in each} - ALSO_OTHERS
"""Those that are no words for anything else; ``map`` is also a frame, and ``zones`` a key of a file."""
PLACE_OF_NAME = {
    "Topic": 0,
    "pictures": 0,
    "count_publishers": 0,
    "count_subscribers": 0,
    "get_publishers_info_by_topic": 0,
    "get_subscriptions_info_by_topic": 0,
    "resolve_topic_name": 0,
    "create_subscription": 1,
    "create_publisher": 1,
    "subscribe": 1,
    "tellers_of": 1,
    "LatestMessages": 2,
}
"""Calls -> which of their arguments names a topic."""


def literals(source: str) -> Iterator[tuple[int, str]]:
    """Find the topics that are written as texts: line and text. A node's private ones are its own."""
    tree = ast.parse(source)
    documentation = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    named = {
        id(node.args[place])
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and (place := PLACE_OF_NAME.get(ast.unparse(node.func).rpartition(".")[2])) is not None
        and len(node.args) > place
    }
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Constant) and isinstance(node.value, str)) or id(node) in documentation:
            continue
        if node.value in TELLING or (id(node) in named and not node.value.startswith("~/")):
            yield node.lineno, node.value


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ('node.create_publisher(Bool, "lamp", RELIABLE)', ["lamp"]),
        ('self.create_subscription(Grid, "map", self._on_map, LATCHED)', ["map"]),
        ('LAMP = Topic("lamp", bool)', ["lamp"]),
        ('source = {"battery_state": 1}', ["battery_state"]),
        ('node.create_publisher(Bool, "~/lamp", RELIABLE)', []),
        ("node.create_publisher(Bool, LAMP, RELIABLE)", []),
        ('frame = "map"', []),
        ('"""battery_state"""', []),
    ],
)
def test_a_topic_that_is_written_as_a_text_is_found(line: str, found: list[str]) -> None:
    assert [text for _, text in literals(line)] == found


def test_each_topic_has_one_name() -> None:
    names = [(name, value) for name, value in vars(topic_names).items() if name.isupper()]
    assert len({value for _, value in names}) == len(names) > 50


def test_names_of_topics_stand_in_their_home_alone() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {text!r}"
        for path in sorted(PACKAGE.rglob("*.py"))
        if path != HOME
        for line, text in literals(path.read_text())
    ]
    assert not found, f"write the names of {HOME.name}:\n" + "\n".join(found)
