"""How parallels are ticked: every child at every tick, then the policy decides."""

from __future__ import annotations

from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel

from florence_bt.runtime.ticking._composites import Stop, begin, halt_from, make_stop
from florence_bt.runtime.ticking._leaves import FAILURE, INVALID, RUNNING, SUCCESS, overrides
from florence_bt.runtime.ticking._table import Functions, Table


def verdict(node: Parallel) -> tuple[Status, Behaviour]:
    """What the policy says about the statuses of the children, and the child that stands for it.

    Raises:
        RuntimeError: The policy is none of py_trees' own; the same message as there.
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


def make_parallel_stop(table: Table, example: Behaviour) -> Stop:
    """``Parallel.stop``: running children are stopped, then the node ends as every composite does."""
    stop_composite, halts = make_stop(table, example), table.halts

    def stop(node: Any, new: Status) -> None:
        for child in node.children:
            if child.status is RUNNING:
                try:
                    halt = halts[child.__class__]
                except KeyError:
                    halt = table.halt_of(child)
                halt(child)
        stop_composite(node, new)

    return stop


def validates_always(example: Any) -> bool:
    """Whether a node has its own way to look at its policy; py_trees' own only looks at a selection."""
    own = getattr(example.validate_policy_configuration, "__func__", None)
    return own is not Parallel.validate_policy_configuration


def make_parallel(table: Table, example: Behaviour) -> Functions:
    """``py_trees.composites.Parallel`` and its subclasses that tick and stop as it does."""
    note, visit, ticks = table.note, table.visit, table.ticks
    begins, stop = overrides(example, "initialise"), make_parallel_stop(table, example)
    validates = validates_always(example)

    def tick(node: Any) -> Status:
        policy = node.policy
        if validates or isinstance(policy, SELECTED):
            node.validate_policy_configuration()
        if node.status is not RUNNING:
            halt_from(table, node.children, 0)
            node.current_child = None
            if begins:
                begin(table, node)
        children = node.children
        if children:
            synchronise, busy = policy.synchronise, True
            for child in children:
                if synchronise and child.status is SUCCESS:
                    busy = False
                    continue
                try:
                    tick_child = ticks[child.__class__]
                except KeyError:
                    tick_child = table.tick_of(child)
                if tick_child(child) is not RUNNING:
                    busy = False
            if busy and policy.__class__ in POLICIES:
                new, node.current_child = RUNNING, children[-1]
            else:
                new, node.current_child = verdict(node)
        else:
            new, node.current_child = SUCCESS, None
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not RUNNING:
            if note is not None:
                note((node, node.status, RUNNING))
            node.status = RUNNING
        if visit is not None:
            visit(node)
        return new

    return tick, lambda node: stop(node, INVALID)


SELECTED = ParallelPolicy.SuccessOnSelected
POLICIES = (ParallelPolicy.SuccessOnAll, ParallelPolicy.SuccessOnOne, SELECTED)
