"""How our own kinds of nodes are ticked: decorators with a gate, and composites that say their steps."""

from __future__ import annotations

from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.runtime.ticking._decorators import make_decorator
from florence_bt.runtime.ticking._leaves import INVALID, RUNNING
from florence_bt.runtime.ticking._table import Functions, Table


def make_gated(table: Table, example: Behaviour) -> Functions:
    """``behaviours.decorators.PreparedDecorator``: its gate may end it before the child is ticked."""
    through, halt = make_decorator(table, example)
    note, visit = table.note, table.visit

    def halt_child(child: Behaviour) -> None:
        table.halt_of(child)(child)

    def tick(node: Any) -> Status:
        before = node.status
        node.on_halt = halt_child
        try:
            may = node.gate()
        finally:
            node.on_halt = None
        if may:
            return through(node)
        new: Status = node.status
        if note is not None and new is not before:
            note((node, before, new))
        if visit is not None:
            visit(node)
        return new

    return tick, halt


def make_stepping(table: Table, example: Behaviour) -> Functions:
    """``behaviours.stepping.Stepping``: ticks the children that the node names."""
    note, visit, ticks = table.note, table.visit, table.ticks

    def halt_child(child: Behaviour) -> None:
        table.halt_of(child)(child)

    def take_steps(node: Any) -> Status:
        steps = node.steps()
        while True:
            try:
                child = next(steps)
            except StopIteration as end:
                new: Status = end.value
                return new
            try:
                tick_child = ticks[child.__class__]
            except KeyError:
                tick_child = table.tick_of(child)
            tick_child(child)

    def tick(node: Any) -> Status:
        node.on_halt = halt_child
        try:
            new = take_steps(node)
            before = node.status
            if new is INVALID:
                table.watch(node.children, lambda: node.stop(INVALID))
            elif new is not RUNNING:
                node.stop(new)
        finally:
            node.on_halt = None  # a stop from outside is not for this table
        node.status = new
        if note is not None and before is not new:
            note((node, before, new))
        if visit is not None:
            visit(node)
        return new

    def halt(node: Any) -> None:
        table.watch((node,), lambda: node.stop(INVALID))

    return tick, halt
