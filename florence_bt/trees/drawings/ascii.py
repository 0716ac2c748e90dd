"""A tree as plain text: where every node stands, and why. No time stamps: equal trees give equal texts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Parallel, Selector, Sequence
from py_trees.decorators import Decorator

from florence_bt.behaviours.annotations import shown_name
from florence_bt.behaviours.catching import OnFailure
from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.decorators import CallMission
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.until import Interruptible, Until
from florence_bt.behaviours.why import EARLIER, Why, explain

MARKS = {Status.SUCCESS: "[+]", Status.FAILURE: "[x]", Status.RUNNING: "[>]", Status.INVALID: "[ ]"}
"""Succeeded, failed, running, not reached."""
STOPPED = "[-]"
"""Stopped before its end."""
_INDENT = "    "

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
    (CountingParallel, "parallel"),
    (Finally, "finally"),
    (OnFailure, "on_failure"),
    (Until, "until"),
    (Interruptible, "interrupted_by"),
)
_KIND_BEHIND = re.compile(rf" \((?:{'|'.join(word for _, word in _KINDS)})\)$")


class LastStatus(NamedTuple):
    """The state of a node when the nodes above it went on without it.

    Attributes:
        status: Its last status; RUNNING when it was stopped before its end.
        message: What it said.
        why: Why it failed, or None.
    """

    status: Status
    message: str
    why: Why | None


LastStatuses = Callable[[Behaviour], LastStatus | None]
"""Tells where a node stood that stands at INVALID now; None when it was not reached."""


class TreeRow(NamedTuple):
    """One node of a dump.

    Attributes:
        depth: How far below the root, 0 for the root itself.
        status: Where the node stands, or stood when it was left.
        title: Its name, and the kind of composites.
        says: What it says about itself, on one line; empty when it says nothing.
        seconds: How long it took, or has been running; None when it was not started or nobody knows.
        left: Whether the nodes above it have gone on without it.
        call: Whether it calls another mission, whose nodes stand below it.
    """

    depth: int
    status: Status
    title: str
    says: str
    seconds: float | None = None
    left: bool = False
    call: bool = False

    @property
    def name(self) -> str:
        """Its name, without the kind of composites."""
        return _KIND_BEHIND.sub("", self.title)

    @property
    def running(self) -> bool:
        """Tell whether it has not ended; with :attr:`left` it was stopped before its end."""
        return self.status is Status.RUNNING

    @property
    def mark(self) -> str:
        """One of :data:`MARKS`, or :data:`STOPPED`."""
        return STOPPED if self.left and self.running else MARKS[self.status]


def tree_rows(
    root: Behaviour, durations: Callable[[Behaviour], float | None], left: LastStatuses
) -> tuple[TreeRow, ...]:
    """Return the nodes of a tree as they stand now, in the order of a dump; to be drawn later.

    Args:
        root: The tree.
        durations: Gives the seconds that a node took, or has been running.
        left: Tells where nodes stood that were left.
    """
    rows = []
    known: dict[Behaviour, Why] = {}
    todo = [(root, 0, True)]
    while todo:
        node, depth, timed = todo.pop()
        status, says = node.status, ""
        stood = left(node) if status is Status.INVALID else None
        if stood is not None:
            status, says = stood.status, _message(node, stood.why, stood.message, known, left)
        elif status is not Status.INVALID:
            says = _message(node, explain(node, known), node.feedback_message, known, left)
        title = f"{shown_name(node)}{_kind(node)}"
        was_left, call = stood is not None, isinstance(node, CallMission)
        rows.append(TreeRow(depth, status, title, says, durations(node) if timed else None, was_left, call))
        if isinstance(node, Finally):
            # How long the nodes of a clean-up beside the tree took, nobody notes.
            todo += [(child, depth + 1, timed and child in node.children) for child in reversed(node.shown)]
        else:
            todo += [(child, depth + 1, timed) for child in reversed(node.children)]
    return tuple(rows)


def draw_rows(
    rows: Iterable[TreeRow],
    *,
    colour: bool = False,
    visited_only: bool = False,
    durations: bool = False,
) -> str:
    """Draw the nodes of a tree as text.

    Args:
        rows: The nodes.
        colour: Whether to colour the marks for a terminal.
        visited_only: Whether to leave out nodes that were not reached.
        durations: Whether to show how long nodes took; without it equal trees give equal texts.

    Returns:
        One line per node: a mark, the name, the kind of composites, and what the node says about itself.
    """
    lines = []
    hidden_below: int | None = None
    for row in rows:
        if hidden_below is not None and row.depth > hidden_below:
            continue
        hidden_below = None
        if visited_only and row.status is Status.INVALID:
            hidden_below = row.depth
            continue
        lines.append(_line(row, colour, durations))
    return "\n".join(lines)


def _line(row: TreeRow, colour: bool, durations: bool) -> str:
    mark = row.mark
    took = f" ({row.seconds:.1f} s)" if durations and row.seconds is not None else ""
    indent = _INDENT * row.depth
    if colour:
        mark = f"{_COLOURS[row.status]}{mark}{_PLAIN}"
    return f"{indent}{mark} {row.title}{took}{f' -- {row.says}' if row.says else ''}"


def _kind(node: Behaviour) -> str:
    word = _word_for(type(node))
    return f" ({word})" if word and node.name != word else ""


@cache
def _word_for(kind: type[Behaviour]) -> str:
    """Return the word for a class of composites, empty for every other."""
    return next((word for known, word in _KINDS if issubclass(kind, known)), "")


def _message(
    node: Behaviour, why: Why | None, says: str, known: dict[Behaviour, Why], left: LastStatuses
) -> str:
    """Return what a node says; the reason of a failure only where it begins or changes."""
    if why is None:
        return _one_line(says)
    if isinstance(node, (Composite, Decorator)):
        below = (_why(child, known, left) for child in node.children)
        if _is_repeated(why.reason, {each.reason for each in below if each is not None}):
            return ""
    return _one_line(why.reason)


def _why(node: Behaviour, known: dict[Behaviour, Why], left: LastStatuses) -> Why | None:
    """Tell why a node failed, also one that was left; None when it has not failed."""
    stood = left(node) if node.status is Status.INVALID else None
    return explain(node, known) if stood is None else stood.why


def _is_repeated(reason: str, below: Iterable[str]) -> bool:
    """Tell whether the lines below say it; each branch of a selector does, so its summary adds nothing."""
    return any(reason == said or reason.startswith(f"{said}{EARLIER}") for said in below)


def _one_line(text: str) -> str:
    return " ".join(text.split())
