"""How leaves and decorators are ticked and stopped, and nodes with a ``tick`` or ``stop`` of their own.

Each maker gives the two functions for one class. They do what the ``tick`` and ``stop`` of py_trees do, in
the same order, without debug texts, generators and a search through the list of all statuses.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees import decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.runtime.ticking._table import INVALID, RUNNING, Halt, Tick, TickTable


def checked(node: Behaviour, answer: object) -> Status:
    """What ``update`` returned, or INVALID with py_trees' error message when that is not a status."""
    for status in Status:
        if answer == status:
            return status
    node.logger.error(f"A behaviour returned an invalid status, setting to INVALID [{answer}][{node.name}]")
    return INVALID


def make_leaf(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """A leaf that keeps ``Behaviour.tick`` and ``stop``."""
    change = table.change

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.initialise()
        new: Status = node.update()
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            node.terminate(new)
        if node.status is not new:
            change(node, new)
        return new

    def halt(node: Any) -> None:
        node.terminate(INVALID)
        if node.status is not INVALID:
            change(node, INVALID)

    return tick, halt


def make_decorator(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """A decorator that keeps ``Decorator.tick`` and ``stop``."""
    ticks, halts, change = table.ticks, table.halts, table.change
    watched = table.record and _may_stop_its_child(cls)

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.initialise()
        child = node.decorated
        ticks[child.__class__](child)
        new: Status = table.watch((child,), node.update) if watched else node.update()
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    def stop(node: Any, new: Status) -> None:
        node.terminate(new)
        child = node.decorated
        if new is INVALID:
            halts[child.__class__](child)
        if child.status is RUNNING:
            halts[child.__class__](child)
        if node.status is not new:
            change(node, new)

    return tick, lambda node: stop(node, INVALID)


def _may_stop_its_child(cls: Any) -> bool:
    """Whether ``update`` of a decorator may stop the child: that of ``Timeout`` does, and a user's may."""
    module = cls.update.__module__
    known = module == decorators.__name__ or module.startswith("florence_bt.behaviours.")
    return not known or issubclass(cls, decorators.Timeout)


def make_prepared_decorator(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """``behaviours.decorators.PreparedDecorator``: its gate may end it before the child is ticked."""
    tick_child, halt = make_decorator(table, cls)

    def tick(node: Any) -> Status:
        before = node.status
        node.on_halt = halt_child
        try:
            may_tick_child = node.gate()
        finally:
            node.on_halt = None
        if may_tick_child:
            return tick_child(node)
        new: Status = node.status
        if new is not before and table.record:
            table.changes.append((node, before, new))
        return new

    def halt_child(child: Behaviour) -> None:
        table.halts[child.__class__](child)

    return tick, halt


def make_own(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """A class with a ``tick`` or ``stop`` of its own: these run, for the node and everything below it."""

    def run(node: Behaviour) -> None:
        for visited in node.tick():
            if table.visit is not None:
                table.visit(visited)

    def tick(node: Any) -> Status:
        table.watch((node,), lambda: run(node))
        status: Status = node.status
        return status

    def halt(node: Any) -> None:
        table.watch((node,), lambda: node.stop(INVALID))

    return tick, halt


def visited(tick: Tick, visit: Callable[[Behaviour], None]) -> Tick:
    """A function that ticks a node and then visits it."""

    def tick_and_visit(node: Any) -> Status:
        new = tick(node)
        visit(node)
        return new

    return tick_and_visit
