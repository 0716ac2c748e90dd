"""Names for people that show a value in place of ``$key``, once it is known. Name and path stay the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.keys import KeyStore, ValueProblem, ValueSource


@dataclass(frozen=True, slots=True)
class Title:
    """A value in a name.

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


def give_title(node: Behaviour, title: Title) -> None:
    """Let :func:`shown_name` show a value in the name of a node."""
    node.__dict__["title"] = title


def shown_name(node: Behaviour) -> str:
    """The name of a node for dumps: with the values of its keys when it has been started."""
    title = node.__dict__.get("title")
    if not isinstance(title, Title) or node.status is Status.INVALID:
        return node.name
    try:
        value = title.shown(title.value.resolve(title.keys))
    except (ValueProblem, TypeError, ValueError):
        return node.name
    return node.name.replace(title.written, value, 1)
