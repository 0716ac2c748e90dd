"""Nodes of which one child counts at a time: what they have in common, ``if`` and ``switch``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.expressions import CompiledExpression, equal
from florence_bt.behaviours.keys import KeyReference, ValueProblem, readable, resolve
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.stepping import Stepping, Steps
from florence_bt.behaviours.watching import Watch
from florence_bt.core.outcome import Result, failure


class Branching(Stepping):
    """A composite that does one child and ends with its status."""

    def __init__(self, name: str, context: TreeContext, children: list[Behaviour]) -> None:
        super().__init__(name, children)
        self.result: Result | None = None
        self.branch: Behaviour | None = None
        self._context = context

    @property
    def cause(self) -> Behaviour | None:
        """The child that a failure comes from: the branch, never the question."""
        return self.branch

    @property
    def skipped(self) -> bool:
        """Tell whether the branch was skipped, and with it this node."""
        return was_skipped(self.branch)

    def begin(self) -> None:
        """Forget the last round."""
        self.halt_all()
        self.current_child = self.branch = self.result = None
        self.feedback_message = ""

    def branch_steps(self) -> Steps:
        """Tick the branch, and end with its status; nothing to do is a success."""
        self.current_child = self.branch
        if self.branch is None:
            return Status.SUCCESS
        yield self.branch
        return self.branch.status

    def give_up(self, result: Result) -> Status:
        """Fail on its own account; what runs below is stopped."""
        self.result = result
        self.feedback_message = result.reason
        self.branch = None
        self.halt_running()
        return Status.FAILURE


class If(Branching):
    """Does one of two branches.

    With memory the condition is asked once, at the start. Without memory it is asked again while the branch
    runs, and the branch that it leaves is stopped; while a condition that takes time is asked, it goes on.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        condition: An expression, or a node whose success means yes and whose failure means no.
        then: What is done when the condition holds.
        otherwise: What is done when it does not; None: nothing, which is a success.
        memory: Whether it is asked only once.
        watch: The watch of a condition that is a node, without memory.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        condition: CompiledExpression | Behaviour,
        then: Behaviour,
        otherwise: Behaviour | None = None,
        *,
        memory: bool = True,
        watch: Watch | None = None,
    ) -> None:
        asked = [condition] if isinstance(condition, Behaviour) else []
        rest = [otherwise] if otherwise is not None else []
        super().__init__(name, context, [*asked, then, *rest])
        self.memory = memory
        self._condition = condition
        self._then = then
        self._otherwise = otherwise
        self._asked = watch
        self._answer: bool | None = None
        self._end_watch: Callable[[], None] | None = None

    def steps(self) -> Steps:
        """Ask, unless that is settled, then do the branch."""
        if self.status is not Status.RUNNING:
            self.begin()
            self._answer = None
            self._watch()
        if self._answer is None or not self.memory:
            status = Status.INVALID
            if isinstance(self._condition, Behaviour):
                status = yield from self._ask(self._condition)
                if status is Status.RUNNING:
                    self.current_child = self._condition
                    return status
            problem = self._decide(status is Status.SUCCESS)
            if problem is not None:
                return self.give_up(problem)
        status = yield from self.branch_steps()
        if status is not Status.RUNNING:
            self.halt_running()
        return status

    def terminate(self, new_status: Status) -> None:
        """Stop watching."""
        if self._asked is not None:
            self._asked.end()
        if self._end_watch is not None:
            self._end_watch()
            self._end_watch = None

    @property
    def watched(self) -> tuple[Any, ...]:
        """The skills of the condition that are asked in the background."""
        return tuple(self._asked.skills) if self._asked is not None else ()

    def _ask(self, condition: Behaviour) -> Steps:
        """Tick a condition that is a node, and give the answer that stands."""
        if self._asked is None:
            yield condition
            return condition.status
        self._asked.look()
        yield from self._asked.steps(condition)
        return self._asked.answer or Status.RUNNING

    def _decide(self, answer: bool) -> Result | None:
        """Choose the branch and stop the other one; the failure when the condition has no value."""
        if not isinstance(self._condition, Behaviour):
            try:
                answer = self._condition.holds(self._context.keys)
            except ValueProblem as error:
                return error.as_result()
            values = self._condition.with_values(self._context.keys)
            self.feedback_message = ("holds" if answer else "does not hold") + (
                f" ({values})" if values else ""
            )
        if answer is not self._answer:
            self._answer = answer
            left = self._otherwise if answer else self._then
            if left is not None:
                self.halt(left)
            self.branch = self._then if answer else self._otherwise
        return None

    def _watch(self) -> None:
        if self._asked is not None:
            self._asked.begin()
        if not self.memory and isinstance(self._condition, CompiledExpression):
            self._end_watch = self._context.keys.watch(self._condition.keys, self._on_key)

    def _on_key(self, key: str) -> None:
        assert isinstance(self._condition, CompiledExpression)  # only then keys are watched
        try:
            other = self._condition.holds(self._context.keys) is not self._answer
        except ValueProblem:
            other = True
        if other:
            self._context.wake()


class Switch(Branching):
    """Does the branch whose case is equal to a value, which is looked up once, at the start.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        value: A value or a value source.
        cases: For each branch the values that choose it; several when the kind of the value is not known
            before it is there.
        default: What is done when no case fits; None: the node fails with ``no_case`` then.
        labels: The cases as written, for messages.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        value: Any,
        cases: Sequence[tuple[tuple[Any, ...], Behaviour]],
        default: Behaviour | None = None,
        labels: Sequence[str] = (),
    ) -> None:
        branches = [branch for _, branch in cases]
        super().__init__(name, context, [*branches, *([default] if default is not None else [])])
        self._value = value
        self._cases = tuple(cases)
        self._default = default
        self._labels = tuple(labels)

    def steps(self) -> Steps:
        """Choose the branch at the start, then do it."""
        if self.status is not Status.RUNNING:
            self.begin()
            problem = self._choose()
            if problem is not None:
                return self.give_up(problem)
        return (yield from self.branch_steps())

    def _shown(self, value: Any) -> str:
        if isinstance(self._value, KeyReference):
            return self._context.keys.shown(self._value.key, value)
        return readable(value)

    def _choose(self) -> Result | None:
        try:
            value = resolve(self._value, self._context.keys)
        except ValueProblem as error:
            return error.as_result()
        shown = self._shown(value)
        self.feedback_message = f"the value is {shown}"
        fitting = (branch for wanted, branch in self._cases if any(_fits(value, one) for one in wanted))
        self.branch = next(fitting, self._default)
        if self.branch is None:
            cases = ", ".join(self._labels) or "none"
            return failure("no_case", f"the value is {shown}; there are cases for: {cases}")
        return None


def _fits(value: Any, wanted: Any) -> bool:
    try:
        return equal(value, wanted)
    except TypeError:  # values of two kinds
        return False
