"""Small leaves: fail with a reason, write keys, ask an expression over keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import ValueProblem, readable, resolve
from florence_bt.core.outcome import Result, failure


class Fail(Behaviour):
    """Fails at once.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        reason: A text for people, or a value source that gives one.
        code: The code of the failure.
    """

    def __init__(self, name: str, context: TreeContext, reason: Any, code: str = "failed") -> None:
        super().__init__(name)
        self.result: Result | None = None
        self._context = context
        self._reason = reason
        self._code = code

    def update(self) -> Status:
        """FAILURE with the reason."""
        try:
            self.result = failure(self._code, readable(resolve(self._reason, self._context.keys)))
        except ValueProblem as error:
            self.result = error.as_result()
        self.feedback_message = self.result.reason
        return Status.FAILURE


class SetKey(Behaviour):
    """Writes keys: all of them, or none when a value cannot be found.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        values: Values or value sources by key.
    """

    def __init__(self, name: str, context: TreeContext, values: Mapping[str, Any]) -> None:
        super().__init__(name)
        self.result: Result | None = None
        self._context = context
        self._values = dict(values)

    def update(self) -> Status:
        """SUCCESS with the keys written."""
        keys = self._context.keys
        try:
            resolved = {key: resolve(value, keys) for key, value in self._values.items()}
            for key, value in resolved.items():
                keys.check(key, value)
        except ValueProblem as error:
            self.result = error.as_result()
            self.feedback_message = self.result.reason
            return Status.FAILURE
        self.result = None
        for key, value in resolved.items():
            keys.write(key, value)
        self.feedback_message = ", ".join(f"{key} = {readable(value)}" for key, value in resolved.items())
        return Status.SUCCESS


class Condition(Behaviour):
    """Succeeds when an expression holds, fails with ``not_so`` when it does not.

    A key that changes the answer wakes the executor, so that a composite without memory looks again.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        expression: What is asked.
    """

    def __init__(self, name: str, context: TreeContext, expression: CompiledExpression) -> None:
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
        if self.status is not Status.INVALID and self._answer() is not self.status:
            self._context.wake()

    def _answer(self) -> Status:
        try:
            return Status.SUCCESS if self._expression.holds(self._context.keys) else Status.FAILURE
        except ValueProblem:
            return Status.FAILURE
