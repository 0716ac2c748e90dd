"""The tree of a run as text, put together from its events: when its process died, or is not asked.

Nodes appear where their first event puts them; nodes that were never reached are not known to the journal.
"""

from __future__ import annotations

from collections.abc import Iterable

from py_trees.common import Status

from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal.rows import JournaledEvent
from florence_bt.trees.drawings.ascii import MARKS, STOPPED


def tree_from_events(events: Iterable[JournaledEvent]) -> str:
    """Draw what the events of a run say about its nodes.

    Args:
        events: The events in order.

    Returns:
        One line per node that was reached: a mark, the name and what it said last; empty without events.
    """
    latest: dict[str, JournaledEvent] = {}
    stopped: set[str] = set()
    order: dict[str, int] = {}
    for event in events:
        if event.kind == EventKind.NODE.value:
            _note(event, latest, stopped)
        if event.node:
            order.setdefault(event.node, len(order))
    paths = _parents_first([path for path in order if path in latest], order)
    return "\n".join(_line(path, latest[path], path in stopped) for path in paths)


def _note(event: JournaledEvent, latest: dict[str, JournaledEvent], stopped: set[str]) -> None:
    """Note the last result of a node, or that it was stopped before its end."""
    if event.new != Status.INVALID.name:
        latest[event.node] = event
        stopped.discard(event.node)
    elif event.old == Status.RUNNING.name:
        stopped.add(event.node)


def _parents_first(paths: list[str], order: dict[str, int]) -> list[str]:
    """A parent before its children, siblings in the order in which they were reached."""
    known = set(paths)
    children: dict[str, list[str]] = {}
    for path in sorted(paths, key=order.__getitem__):
        children.setdefault(_parent(path, known), []).append(path)
    found: list[str] = []
    todo = list(reversed(children.get("", [])))
    while todo:
        path = todo.pop()
        found.append(path)
        todo.extend(reversed(children.get(path, [])))
    return found


def _parent(path: str, known: set[str]) -> str:
    """The nearest node above that is known; names may contain slashes themselves."""
    while "/" in path:
        path = path.rpartition("/")[0]
        if path in known:
            return path
    return ""


def _line(path: str, event: JournaledEvent, stopped: bool) -> str:
    depth = path.count("/")
    reason = f" -- {' '.join(event.reason.split())}" if event.reason else ""
    mark = STOPPED if stopped else MARKS[Status[event.new]]
    return f"{'    ' * depth}{mark} {path.rpartition('/')[2]}{reason}"
