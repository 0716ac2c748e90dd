"""The leaf that asks an expression over keys."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.expressions import Formula
from florence_bt.behaviours.keys import ValueProblem
from florence_bt.behaviours.reactive import AlwaysSettled
from florence_bt.core.outcome import Result, failure


class Condition(AlwaysSettled, Behaviour):
    """Succeeds when an expression holds, fails with ``not_so`` when it does not.

    A key that changes the answer wakes the executor, so that a composite without memory looks again.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        expression: What is asked.
    """

    def __init__(self, name: str, context: TreeContext, expression: Formula) -> None:
        super().__init__(name)
        self.result: Result | None = None
        self._context = context
        self._expression = expression
        context.keys.watch(expression.keys, self._on_key)

    def update(self) -> Status:
        """Ask."""
        keys = self._context.keys
        try:
            holds = self._expression.holds(keys)
        except ValueProblem as error:
            self.result = error.as_result()
        else:
            self.result = None if holds else failure("not_so", self._expression.denial(keys))
        if self.result is None:
            self.feedback_message = self._expression.with_values(keys)
            return Status.SUCCESS
        self.feedback_message = self.result.reason
        return Status.FAILURE

    def _on_key(self, key: str) -> None:
        self.touch()
        if self.status is not Status.INVALID and self._answer() is not self.status:
            self._context.wake()

    def _answer(self) -> Status:
        try:
            return Status.SUCCESS if self._expression.holds(self._context.keys) else Status.FAILURE
        except ValueProblem:
            return Status.FAILURE
