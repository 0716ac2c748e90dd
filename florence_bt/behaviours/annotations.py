"""Annotations of the nodes of a tree, whatever their class: the one place for such values.

The nodes are those of py_trees and of other packages too, so they need no base class for this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.keys import KeyStore, ValueProblem, ValueSource

if TYPE_CHECKING:
    from florence_bt.behaviours.why import Because, Why


@dataclass(frozen=True, slots=True)
class Title:
    """A value in the name of a node.

    Attributes:
        written: How it stands in the name, such as ``$looks``.
        value: Where it is found.
        keys: The keys that it is found with.
        shown: How it is written for people.
    """

    written: str
    value: ValueSource
    keys: KeyStore
    shown: Callable[[Any], str]


@dataclass(slots=True)
class Annotations:
    """The notes on one node.

    Attributes:
        origin: What it was built from; None for a part of what a node of a mission became.
        title: The value in its name, or None.
        because: The author's words for its failures, or None.
        failed_with: Why it failed in this round, kept when its selector resets it; else None.
    """

    origin: object = None
    title: Title | None = None
    because: Because | None = None
    failed_with: Why | None = None


def annotations_of(node: Behaviour) -> Annotations:
    """Return the annotations of a node, to be read and written; empty at first."""
    found: Annotations | None = node.__dict__.get("annotations")
    if found is None:
        found = node.__dict__["annotations"] = Annotations()
    return found


def shown_name(node: Behaviour) -> str:
    """Return the name of a node for dumps: with the value of its key when it has been started."""
    return node.name if node.status is Status.INVALID else name_with_value(node)


def name_with_value(node: Behaviour) -> str:
    """Return the name of a node with the value that its key has now, if it has one."""
    title = annotations_of(node).title
    if title is None:
        return node.name
    try:
        value = title.shown(title.value.resolve(title.keys))
    except (ValueProblem, TypeError, ValueError):
        return node.name
    return node.name.replace(title.written, value, 1)


def numbered(siblings: list[Behaviour]) -> list[Behaviour]:
    """Give numbers to siblings with equal names, so that every path is unique."""
    if len({behaviour.name for behaviour in siblings}) == len(siblings):
        return siblings
    taken: set[str] = set()
    counts: dict[str, int] = {}
    for behaviour in siblings:
        name = behaviour.name
        count = counts.get(name, 1)
        while behaviour.name in taken:
            count += 1
            behaviour.name = f"{name} ({count})"
        counts[name] = count
        taken.add(behaviour.name)
    return siblings
