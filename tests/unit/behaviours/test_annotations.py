"""What is written on nodes of a tree, whatever their class."""

from __future__ import annotations

from py_trees.behaviours import Running, Success

from florence_bt.behaviours.annotations import Title, annotations_of, shown_name
from florence_bt.behaviours.keys import KeyReference, KeyStore


def test_annotations_stay_with_their_node() -> None:
    one, other = Success("one"), Success("other")
    annotations_of(one).origin = "file"
    one.tick_once()
    assert annotations_of(one).origin == "file"
    assert annotations_of(other).origin is None


def test_a_name_shows_the_value_of_its_key_once_the_node_was_started() -> None:
    keys = KeyStore({"looks": 3})
    node = Running("retry up to $looks times")
    annotations_of(node).title = Title("$looks", KeyReference("looks"), keys, lambda value: f"{value}")
    assert shown_name(node) == "retry up to $looks times"
    node.tick_once()
    assert shown_name(node) == "retry up to 3 times" and node.name == "retry up to $looks times"
    annotations_of(node).title = Title("$looks", KeyReference("gone"), keys, lambda value: f"{value}")
    assert shown_name(node) == "retry up to $looks times"
