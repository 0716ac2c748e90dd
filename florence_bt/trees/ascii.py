"""A tree as plain text: where every node stands, and why. No time stamps: equal trees give equal texts."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Parallel, Selector, Sequence
from py_trees.decorators import Decorator

from florence_bt.behaviours.composites import Finally
from florence_bt.behaviours.why import explain

MARKS = {Status.SUCCESS: "[+]", Status.FAILURE: "[x]", Status.RUNNING: "[>]", Status.INVALID: "[ ]"}
"""Succeeded, failed, running, not reached."""

_COLOURS = {
    Status.SUCCESS: "\x1b[32m",
    Status.FAILURE: "\x1b[31m",
    Status.RUNNING: "\x1b[33m",
    Status.INVALID: "\x1b[2m",
}
_PLAIN = "\x1b[0m"
_KINDS: tuple[tuple[type[Behaviour], str], ...] = (
    (Sequence, "sequence"),
    (Selector, "selector"),
    (Parallel, "parallel"),
    (Finally, "finally"),
)


def ascii_tree(root: Behaviour, *, colour: bool = False, visited_only: bool = False) -> str:
    """Draw a tree as text.

    Args:
        root: The tree.
        colour: Whether to colour the marks for a terminal.
        visited_only: Whether to leave out nodes that were not reached.

    Returns:
        One line per node: a mark, the name, the kind of composites, and what the node says about itself.
    """
    return "\n".join(_lines(root, 0, colour, visited_only))


def _lines(node: Behaviour, depth: int, colour: bool, visited_only: bool) -> Iterator[str]:
    if visited_only and node.status is Status.INVALID:
        return
    mark = MARKS[node.status]
    if colour:
        mark = f"{_COLOURS[node.status]}{mark}{_PLAIN}"
    says = _says(node)
    yield f"{'    ' * depth}{mark} {node.name}{_kind(node)}{f' -- {says}' if says else ''}"
    for child in node.children:
        yield from _lines(child, depth + 1, colour, visited_only)


def _kind(node: Behaviour) -> str:
    for kind, word in _KINDS:
        if isinstance(node, kind):
            return f" ({word})" if node.name != word else ""
    return ""


def _says(node: Behaviour) -> str:
    """What a node says; the reason of a failure only where it begins or is told anew."""
    if node.status is Status.INVALID:
        return ""
    if node.status is not Status.FAILURE:
        return _one_line(node.feedback_message)
    why = explain(node)
    assert why is not None  # the status is FAILURE
    told_below = {below.reason for child in node.children if (below := explain(child)) is not None}
    inner = isinstance(node, (Composite, Decorator))
    return "" if inner and why.reason in told_below else _one_line(why.reason)


def _one_line(text: str) -> str:
    return " ".join(text.split())
