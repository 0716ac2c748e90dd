"""How sequences and selectors are ticked: py_trees' own rules, on the children as they stand at each tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from florence_bt.behaviours.composites import Selector as OwnSelector
from florence_bt.runtime.ticking._leaves import FAILURE, INVALID, RUNNING, SUCCESS, overrides
from florence_bt.runtime.ticking._table import Functions, Table

Stop = Callable[[Any, Status], None]

LONG = 16
"""With more children than this the place of the current one is remembered instead of looked for."""


def make_stop(table: Table, example: Behaviour) -> Stop:
    """``Composite.stop``: with INVALID the children are stopped first, otherwise only the node ends."""
    note, halts = table.note, table.halts
    ends = overrides(example, "terminate")

    def stop(node: Any, new: Status) -> None:
        if new is INVALID:
            node.current_child = None
            for child in node.children:
                if child.status is not INVALID:
                    try:
                        halt = halts[child.__class__]
                    except KeyError:
                        halt = table.halt_of(child)
                    halt(child)
        if ends:
            node.terminate(new)
        if node.status is not new:
            if note is not None:
                note((node, node.status, new))
            node.status = new

    return stop


def halt_from(table: Table, children: list[Behaviour], first: int) -> None:
    """Stop the children from an index on, except those that stand at INVALID."""
    halts = table.halts
    rest: Any = iter(children)
    rest.__setstate__(first)  # begins there without passing over, or copying, what stands before
    for child in rest:
        if child.status is not INVALID:
            try:
                halt = halts[child.__class__]
            except KeyError:
                halt = table.halt_of(child)
            halt(child)


def begin(table: Table, node: Composite) -> None:
    """Call the ``initialise`` of a composite, which may stop children in its own way."""
    table.watch(node.children, node.initialise)


def place_of_current(table: Table, node: Any) -> int:
    """The index of the current child."""
    children = node.children
    if len(children) > LONG:
        index = table.places.get(id(node), 0)
        if index < len(children) and children[index] is node.current_child:
            return index
    place: int = children.index(node.current_child)
    return place


def make_sequence(table: Table, example: Behaviour) -> Functions:
    """``py_trees.composites.Sequence`` and its subclasses that tick and stop as it does."""
    note, visit, ticks = table.note, table.visit, table.ticks
    begins, stop = overrides(example, "initialise"), make_stop(table, example)

    def tick(node: Any) -> Status:
        children = node.children
        index = 0
        if node.status is not RUNNING:
            node.current_child = children[0] if children else None
            halt_from(table, children, 0)
            if begins:
                begin(table, node)
                children = node.children
        elif node.memory and node.current_child is not None:
            index = place_of_current(table, node)
        elif not children:
            node.current_child = None
        new = SUCCESS
        while index < len(children):
            child = node.current_child = children[index]
            try:
                tick_child = ticks[child.__class__]
            except KeyError:
                tick_child = table.tick_of(child)
            new = tick_child(child)
            if new is not SUCCESS:
                if not node.memory:
                    halt_from(table, children, index + 1)
                break
            index += 1
        if new is not RUNNING:
            stop(node, new)
        else:
            if index > LONG and node.memory:
                table.places[id(node)] = index
            if node.status is not RUNNING:
                if note is not None:
                    note((node, node.status, RUNNING))
                node.status = RUNNING
        if visit is not None:
            visit(node)
        return new

    return tick, lambda node: stop(node, INVALID)


def starts_with_reset(node: Any) -> bool:
    """Whether a selector is our own one, with the ``initialise`` that resets the children."""
    return getattr(node.initialise, "__func__", None) is OwnSelector.initialise


def _make_selector_start(table: Table, example: Behaviour) -> Callable[[Any], None]:
    begins, resets = overrides(example, "initialise"), starts_with_reset(example)

    def start(node: Any) -> None:
        children = node.children
        node.current_child = children[0] if children else None
        if resets:
            halt_from(table, children, 0)
        elif begins:
            begin(table, node)

    return start


def _resume_selector(table: Table, node: Any) -> int:
    """Where a selector with memory goes on; the children before are reset, as py_trees does."""
    assert node.current_child is not None  # as in py_trees: the running child was taken away
    index = place_of_current(table, node)
    for early in node.children[:index]:
        if early.status is not INVALID:
            table.halt_of(early)(early)
    return index


def make_selector(table: Table, example: Behaviour) -> Functions:
    """``py_trees.composites.Selector`` and its subclasses that tick and stop as it does."""
    note, visit, ticks = table.note, table.visit, table.ticks
    start, stop = _make_selector_start(table, example), make_stop(table, example)

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            start(node)
        children = node.children
        index = 0
        if not children:
            node.current_child = None
        elif node.memory:
            index = _resume_selector(table, node)
        previous = node.current_child
        new = FAILURE
        while index < len(children):
            child = children[index]
            try:
                tick_child = ticks[child.__class__]
            except KeyError:
                tick_child = table.tick_of(child)
            new = tick_child(child)
            if new is RUNNING or new is SUCCESS:
                node.current_child = child
                if previous is not child:
                    halt_from(table, children, index + 1)
                break
            index += 1
        else:
            new = FAILURE
        if new is not RUNNING:
            stop(node, new)
            if new is FAILURE and children:
                node.current_child = children[-1]
        else:
            if index > LONG and node.memory:
                table.places[id(node)] = index
            if node.status is not RUNNING:
                if note is not None:
                    note((node, node.status, RUNNING))
                node.status = RUNNING
        if visit is not None:
            visit(node)
        return new

    return tick, lambda node: stop(node, INVALID)
