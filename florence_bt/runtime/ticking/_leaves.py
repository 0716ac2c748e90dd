"""How leaves are ticked: any leaf that keeps py_trees' own ``tick`` and ``stop``, and nodes of unknown ways.

What a leaf of py_trees does per tick beside its ``update`` (debug texts, a search through the list of all
statuses, a fresh generator at every stop) is left out or done once.
"""

from __future__ import annotations

from typing import Any

from py_trees import behaviours, composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.runtime.ticking._table import Functions, Table

RUNNING, SUCCESS, FAILURE, INVALID = Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID

CONSTANTS: dict[Any, tuple[Status, str]] = {
    behaviours.Success.update: (SUCCESS, "success"),
    behaviours.Failure.update: (FAILURE, "failure"),
    behaviours.Running.update: (RUNNING, "running"),
    behaviours.Dummy.update: (RUNNING, "crash test dummy"),
}
"""The ``update`` of the leaves of py_trees that always answer the same: the status and the message."""
CONSTANT_TERMINATES = frozenset(
    cls.terminate for cls in (behaviours.Success, behaviours.Failure, behaviours.Running, behaviours.Dummy)
)
"""Their ``terminate``: it clears the feedback message on INVALID."""


def overrides(node: Behaviour, name: str) -> bool:
    """Whether a node, or its class, has a method of its own in place of the one of ``Behaviour``."""
    return getattr(getattr(node, name), "__func__", None) is not getattr(Behaviour, name)


def checked(node: Behaviour, answer: object) -> Status:
    """What ``update`` answered, or INVALID with py_trees' error message when that is no status."""
    for status in Status:
        if answer == status:
            return status
    node.logger.error(f"A behaviour returned an invalid status, setting to INVALID [{answer}][{node.name}]")
    return INVALID


def make_leaf(table: Table, example: Behaviour) -> Functions:
    """A leaf with any ``initialise``, ``update`` and ``terminate``."""
    note, visit = table.note, table.visit
    begins, ends = overrides(example, "initialise"), overrides(example, "terminate")

    def tick(node: Any) -> Status:
        if begins and node.status is not RUNNING:
            node.initialise()
        new: Status = node.update()
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            if ends and new is not RUNNING:
                node.terminate(new)
        if node.status is not new:
            if note is not None:
                note((node, node.status, new))
            node.status = new
        if visit is not None:
            visit(node)
        return new

    def halt(node: Any) -> None:
        if ends:
            node.terminate(INVALID)
        if node.status is not INVALID:
            if note is not None:
                note((node, node.status, INVALID))
            node.status = INVALID

    return tick, halt


def make_constant(table: Table, example: Behaviour) -> Functions:
    """A leaf of py_trees that always answers the same."""
    note, visit = table.note, table.visit
    new, message = CONSTANTS[type(example).update]

    def tick(node: Any) -> Status:
        node.feedback_message = message
        if node.status is not new:
            if note is not None:
                note((node, node.status, new))
            node.status = new
        if visit is not None:
            visit(node)
        return new

    def halt(node: Any) -> None:
        node.feedback_message = ""
        if node.status is not INVALID:
            if note is not None:
                note((node, node.status, INVALID))
            node.status = INVALID

    return tick, halt


def make_unknown(table: Table, example: Behaviour) -> Functions:
    """A node that says itself how it and everything below it is ticked or stopped."""
    visit, abandoned = table.visit, table.abandoned

    def run(node: Any) -> Status:
        enough, otherwise = _what_the_parent_waits_for(table, node)
        steps = node.tick()
        for visited in steps:
            if visit is not None:
                visit(visited)
            if visited is node and node.status in enough:
                abandoned.append(steps)
                break
        else:
            return otherwise or node.status
        status: Status = node.status
        return status

    def tick(node: Any) -> Status:
        status: Status = table.watch((node,), lambda: run(node))
        return status

    def halt(node: Any) -> None:
        table.watch((node,), lambda: node.stop(INVALID))

    return tick, halt


def _what_the_parent_waits_for(table: Table, node: Behaviour) -> tuple[tuple[Status, ...], Status | None]:
    """When the parent, in py_trees, would not ask the generator of a node for more, and what the answer of
    the node counts as when that never came.

    What a ``tick`` of one's own does behind its last ``yield`` is seen only when it is asked for more.
    """
    if node is not table.root:
        way = getattr(type(node.parent), "tick", None)
        if way is composites.Sequence.tick:
            return (RUNNING, FAILURE, INVALID), SUCCESS
        if way is composites.Selector.tick:
            return (RUNNING, SUCCESS), FAILURE
    return (), None
