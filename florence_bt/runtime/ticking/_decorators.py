"""How decorators are ticked: those of py_trees, and others that keep ``Decorator.tick`` and ``stop``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees import decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.runtime.ticking._composites import Stop
from florence_bt.runtime.ticking._leaves import FAILURE, INVALID, RUNNING, SUCCESS, checked, overrides
from florence_bt.runtime.ticking._table import Functions, Table, Tick

Answer = Callable[[Any], Any]


def make_decorator(table: Table, example: Behaviour) -> Functions:
    """A decorator with any ``initialise``, ``update`` and ``terminate``."""
    note, visit, ticks = table.note, table.visit, table.ticks
    begins, stop = overrides(example, "initialise"), make_decorator_stop(table, example)
    answer = answer_of(table, example)

    def tick(node: Any) -> Status:
        if begins and node.status is not RUNNING:
            node.initialise()
        child = node.decorated
        try:
            tick_child = ticks[child.__class__]
        except KeyError:
            tick_child = table.tick_of(child)
        tick_child(child)
        new: Status = answer(node)
        if new is not RUNNING:
            if new.__class__ is not Status:
                new = checked(node, new)
            if new is not RUNNING:
                stop(node, new)
        if node.status is not new:
            if note is not None:
                note((node, node.status, new))
            node.status = new
        if visit is not None:
            visit(node)
        return new

    return tick, lambda node: stop(node, INVALID)


def make_bounce(table: Table, example: Behaviour) -> Tick:
    """A decorator that leaves its child alone: the ``tick`` of a leaf with the ``stop`` of a decorator."""
    visit = table.visit
    begins, stop = overrides(example, "initialise"), make_decorator_stop(table, example)

    def tick(node: Any) -> Status:
        if begins and node.status is not RUNNING:
            node.initialise()
        new = checked(node, node.update())
        if new is not RUNNING:
            stop(node, new)
        elif node.status is not new:
            table.change(node, new)
        if visit is not None:
            visit(node)
        return new

    return tick


def make_one_shot(table: Table, example: Behaviour) -> Functions:
    """``py_trees.decorators.OneShot``: bounces once its child has finished."""
    through, halt = make_decorator(table, example)
    bounce = make_bounce(table, example)
    return lambda node: bounce(node) if node.final_status else through(node), halt


def make_eternal_guard(table: Table, example: Behaviour) -> Functions:
    """``py_trees.decorators.EternalGuard``: asks its condition before every tick."""
    through, halt = make_decorator(table, example)
    visit, stop = table.visit, make_decorator_stop(table, example)

    def tick(node: Any) -> Status:
        answer = node.condition()
        if isinstance(answer, Status):
            answer = answer is not FAILURE
        elif not isinstance(answer, bool):
            problem = f"conditional check must return 'bool' or 'common.Status' [{type(answer)}]"
            node.logger.error(f"The {problem}")
            raise RuntimeError(problem)
        if answer:
            return through(node)
        stop(node, FAILURE)
        if visit is not None:
            visit(node)
        return FAILURE

    return tick, halt


def make_decorator_stop(table: Table, example: Behaviour) -> Stop:
    """``Decorator.stop``: ends the node, then the child where it must not go on."""
    note, halts = table.note, table.halts
    ends, counts = overrides(example, "terminate"), _is(example, "terminate", decorators.Count)

    def stop(node: Any, new: Status) -> None:
        if counts:
            _count_end(node, new)
        elif ends:
            node.terminate(new)
        child = node.decorated
        if new is INVALID or child.status is RUNNING:
            try:
                halt = halts[child.__class__]
            except KeyError:
                halt = table.halt_of(child)
            halt(child)
            if new is INVALID and child.status is RUNNING:
                halt(child)
        if node.status is not new:
            if note is not None:
                note((node, node.status, new))
            node.status = new

    return stop


def _is(node: Any, method: str, owner: type) -> bool:
    """Whether a method of a node is that of a class of py_trees."""
    return getattr(getattr(node, method), "__func__", None) is getattr(owner, method)


def answer_of(table: Table, example: Any) -> Answer:
    """``update`` of a decorator; for those of py_trees that only map a status, the same without detours."""
    for owner, (trigger, result, message) in MAPPINGS.items():
        if _is(example, "update", owner):
            return _mapping(trigger, result, message, owner is not decorators.SuccessIsRunning)
    for owner, answer in ANSWERS.items():
        if _is(example, "update", owner):
            return answer
    if _is(example, "update", decorators.Timeout):
        return _time_out(table)
    if table.note is None or _leaves_its_child_alone(example):
        return lambda node: node.update()
    return _watched_update(table)


def _leaves_its_child_alone(example: Any) -> bool:
    """Whether ``update`` is known not to stop the child by itself."""
    update = getattr(example.update, "__func__", None)
    module = getattr(update, "__module__", "")
    return module == decorators.__name__ or module.startswith("florence_bt.behaviours.")


def _watched_update(table: Table) -> Answer:
    """An ``update`` that may stop the child by itself."""

    def answer(node: Any) -> Any:
        child = node.decorated
        if child.children:
            return table.watch((child,), node.update)
        before = child.status
        try:
            return node.update()
        finally:
            if child.status is not before and table.note is not None:
                table.note((child, before, child.status))

    return answer


def _time_out(table: Table) -> Answer:
    """The time-out of py_trees, with its clock; it stops the child by itself."""

    def answer(node: Any) -> Status:
        now = decorators.time.monotonic()
        child = node.decorated
        status: Status = child.status
        if status is not RUNNING:
            node.feedback_message = "child finished before timeout triggered"
        elif now > node.finish_time:
            node.feedback_message = "timed out"
            table.halt_of(child)(child)
            return FAILURE
        else:
            node.feedback_message = f"time still ticking ... [remaining: {node.finish_time - now}s]"
        return status

    return answer


MAPPINGS: dict[type, tuple[Status, Status, str]] = {
    decorators.RunningIsFailure: (RUNNING, FAILURE, "running is failure"),
    decorators.RunningIsSuccess: (RUNNING, SUCCESS, "running is success"),
    decorators.FailureIsSuccess: (FAILURE, SUCCESS, "failure is success"),
    decorators.FailureIsRunning: (FAILURE, RUNNING, "failure is running"),
    decorators.SuccessIsFailure: (SUCCESS, FAILURE, "success is failure"),
    decorators.SuccessIsRunning: (SUCCESS, RUNNING, "success is running"),
}
"""The decorators of py_trees that change one status: which, into what, and what they say about it."""


def _mapping(trigger: Status, result: Status, text: str, brief: bool) -> Answer:
    def answer(node: Any) -> Status:
        child = node.decorated
        message = child.feedback_message
        status: Status = child.status
        if status is not trigger:
            node.feedback_message = message
            return status
        node.feedback_message = text if brief and not message else f"{text} [{message}]"
        return result

    return answer


def _invert(node: Any) -> Status:
    child = node.decorated
    status: Status = child.status
    if status is SUCCESS:
        node.feedback_message = "success -> failure"
        return FAILURE
    if status is FAILURE:
        node.feedback_message = "failure -> success"
        return SUCCESS
    node.feedback_message = child.feedback_message
    return status


def _pass_through(node: Any) -> Any:
    return node.decorated.status


def _count(node: Any) -> Any:
    node.total_tick_count += 1
    status = node.decorated.status
    if status is RUNNING:
        node.running_count += 1
    return status


def _count_end(node: Any, new: Status) -> None:
    """``Count.terminate``."""
    if new is INVALID:
        node.interrupt_count += 1
    elif new is SUCCESS:
        node.success_count += 1
    elif new is FAILURE:
        node.failure_count += 1
    done = f"S: {node.success_count}, F: {node.failure_count}, T: {node.total_tick_count}"
    node.feedback_message = f"R: {node.running_count}, {done}"


ANSWERS: dict[type, Answer] = {
    decorators.Count: _count,
    decorators.Inverter: _invert,
    decorators.PassThrough: _pass_through,
}
