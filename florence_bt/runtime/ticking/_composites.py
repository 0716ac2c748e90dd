"""How composites are ticked and stopped: py_trees' own rules, on the children as they are at each tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel

from florence_bt.runtime.ticking._table import FAILURE, INVALID, RUNNING, SUCCESS, Halt, Tick, TickTable


def make_stop(table: TickTable) -> Callable[[Any, Status], None]:
    """``Composite.stop``: with INVALID the children are stopped first, otherwise only the node ends."""
    change, halt_from = table.change, table.halt_from

    def stop(node: Any, new: Status) -> None:
        if new is INVALID:
            node.current_child = None
            halt_from(node.children, 0)
        node.terminate(new)
        if node.status is not new:
            change(node, new)

    return stop


def make_initialise(table: TickTable, cls: Any) -> Callable[[Any], None]:
    """``initialise`` of a class of composites; one that is overridden may stop children itself."""
    if cls.initialise is Behaviour.initialise:
        return cls.initialise
    return lambda node: table.watch(node.children, node.initialise)


def make_sequence(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """``py_trees.composites.Sequence``, and subclasses that tick and stop as it does."""
    initialise, stop = make_initialise(table, cls), make_stop(table)
    ticks, change, halt_from = table.ticks, table.change, table.halt_from

    def tick(node: Any) -> Status:
        index = 0
        if node.status is not RUNNING:
            node.current_child = node.children[0] if node.children else None
            halt_from(node.children, 0)
            initialise(node)
        elif node.memory and node.current_child is not None:
            index = node.children.index(node.current_child)
        elif not node.children:
            node.current_child = None
        children = node.children
        new = SUCCESS
        while index < len(children):
            child = node.current_child = children[index]
            new = ticks[child.__class__](child)
            if new is not SUCCESS:
                if not node.memory:
                    halt_from(children, index + 1)
                break
            index += 1
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    return tick, lambda node: stop(node, INVALID)


def make_selector(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """``py_trees.composites.Selector``, and subclasses that tick and stop as it does."""
    initialise, stop = make_initialise(table, cls), make_stop(table)
    ticks, change, halt_from = table.ticks, table.change, table.halt_from

    def first_child(node: Any) -> int:
        """Where a selector begins; with memory py_trees stops the children before."""
        if not node.children or not node.memory:
            return 0
        assert node.current_child is not None  # as in py_trees: the running child was removed
        index: int = node.children.index(node.current_child)
        for earlier in node.children[:index]:
            if earlier.status is not INVALID:
                table.halts[earlier.__class__](earlier)
        return index

    def tick(node: Any) -> Status:
        if node.status is not RUNNING:
            node.current_child = node.children[0] if node.children else None
            initialise(node)
        children = node.children
        index = first_child(node)
        previous = node.current_child
        new = FAILURE
        while index < len(children):
            child = children[index]
            new = ticks[child.__class__](child)
            if new is RUNNING or new is SUCCESS:
                node.current_child = child
                if previous is not child:
                    halt_from(children, index + 1)
                break
            index += 1
        else:
            new = FAILURE
        if new is not RUNNING:
            stop(node, new)
            if new is FAILURE:
                node.current_child = children[-1] if children else None
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    return tick, lambda node: stop(node, INVALID)


def make_parallel(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """``py_trees.composites.Parallel``, and subclasses that tick and stop as it does."""
    initialise, stop_alone = make_initialise(table, cls), make_stop(table)
    ticks, halts, change, halt_from = table.ticks, table.halts, table.change, table.halt_from

    def tick(node: Any) -> Status:
        node.validate_policy_configuration()
        if node.status is not RUNNING:
            halt_from(node.children, 0)
            node.current_child = None
            initialise(node)
        children = node.children
        synchronise, all_run = node.policy.synchronise, True
        for child in children:
            done = synchronise and child.status is SUCCESS
            if done or ticks[child.__class__](child) is not RUNNING:
                all_run = False
        if not children:
            new, node.current_child = SUCCESS, None
        elif all_run:
            new, node.current_child = RUNNING, children[-1]
        else:
            new, node.current_child = _decision(node)
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not RUNNING:
            change(node, RUNNING)
        return new

    def stop(node: Any, new: Status) -> None:
        for child in node.children:
            if child.status is RUNNING:
                halts[child.__class__](child)
        stop_alone(node, new)

    return tick, lambda node: stop(node, INVALID)


def _decision(node: Parallel) -> tuple[Status, Behaviour]:
    """What the policy says about the statuses of the children, and the child that decides.

    Raises:
        RuntimeError: The policy is none of py_trees; the message is that of py_trees.
    """
    children, policy = node.children, node.policy
    for child in children:
        if child.status is FAILURE:
            return FAILURE, child
    if isinstance(policy, ParallelPolicy.SuccessOnAll):
        if all(child.status is SUCCESS for child in children):
            return SUCCESS, children[-1]
    elif isinstance(policy, ParallelPolicy.SuccessOnOne):
        for child in reversed(children):
            if child.status is SUCCESS:
                return SUCCESS, child
    elif isinstance(policy, ParallelPolicy.SuccessOnSelected):
        if all(child.status is SUCCESS for child in policy.children):
            return SUCCESS, policy.children[-1]
    else:
        raise RuntimeError(f"this parallel has been configured with an unrecognised policy [{type(policy)}]")
    return RUNNING, children[-1]


def make_stepping(table: TickTable, cls: Any) -> tuple[Tick, Halt]:
    """``behaviours.stepping.Stepping``: ticks the children that the node names; any ``stop``."""
    ticks = table.ticks

    def halt_child(child: Behaviour) -> None:
        table.halts[child.__class__](child)

    def take_steps(node: Any) -> Status:
        steps = node.steps()
        while True:
            try:
                child = next(steps)
            except StopIteration as end:
                new: Status = end.value
                return new
            ticks[child.__class__](child)

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
        if before is not new and table.record:
            table.changes.append((node, before, new))
        return new

    def halt(node: Any) -> None:
        table.watch((node,), lambda: node.stop(INVALID))

    return tick, halt
