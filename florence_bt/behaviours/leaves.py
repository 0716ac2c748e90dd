"""Small leaves: fail with a reason, write keys, ask an expression over keys."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from operator import is_
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
        """Return FAILURE with the reason."""
        try:
            self.result = failure(self._code, readable(resolve(self._reason, self._context.keys)))
        except ValueProblem as error:
            self.result = error.as_result()
        self.feedback_message = self.result.reason
        return Status.FAILURE


class KeyWriter(Behaviour):
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
        """Return SUCCESS with the keys written."""
        keys = self._context.keys
        try:
            given = {key: resolve(value, keys) for key, value in self._values.items()}
            new = {key: self.written(key, value) for key, value in given.items()}
            for key, value in new.items():
                keys.check(key, value)
        except ValueProblem as error:
            self.result = error.as_result()
            self.feedback_message = self.result.reason
            return Status.FAILURE
        self.result = None
        for key, value in new.items():
            keys.write(key, value)
        self.feedback_message = ", ".join(self.shown(key, value) for key, value in given.items())
        return Status.SUCCESS

    @abstractmethod
    def written(self, key: str, given: Any) -> Any:
        """Return what is written to a key that is given a value."""

    @abstractmethod
    def shown(self, key: str, given: Any) -> str:
        """Say what was done to a key."""


class SetKey(KeyWriter):
    """Sets keys to values."""

    def written(self, key: str, given: Any) -> Any:
        """Return the value."""
        return given

    def shown(self, key: str, given: Any) -> str:
        """Write it, such as ``distance = 1 m``."""
        return f"{key} = {self._context.keys.shown(key, given)}"


class AppendToKeys(KeyWriter):
    """Adds values to keys that hold a text or a list."""

    def written(self, key: str, given: Any) -> Any:
        """Return what the key holds, with the value at the end."""
        held = self._context.keys.read(key)
        return (*held, given) if isinstance(held, tuple) else held + readable(given)

    def shown(self, key: str, given: Any) -> str:
        """Write it, such as ``rooms + hall``."""
        return f"{key} + {readable(given)}"


class Condition(Behaviour):
    """Succeeds when an expression holds, fails when it does not.

    A key that changes the answer wakes the executor, so that a composite without memory looks again.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        expression: What is asked.
        code: The code of the failure.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        expression: CompiledExpression,
        code: str = "condition_false",
    ) -> None:
        self._message: str | None = ""
        self._values: tuple[Any, ...] | None = None
        super().__init__(name)
        self.result: Result | None = None
        self._context = context
        self._expression = expression
        self._code = code
        context.keys.watch(expression.keys, self._on_key)

    @property
    def feedback_message(self) -> str:
        """The values that decided; written out when somebody reads it."""
        if self._message is None:
            self._message = self._expression.text_of(self._values or ())
        return self._message

    @feedback_message.setter
    def feedback_message(self, text: str) -> None:
        self._message = text

    def update(self) -> Status:
        """Ask; while its keys hold the very same values, the answer stands."""
        values = self._context.keys.peek(self._expression.keys)
        if self._values is None or not all(map(is_, values, self._values)):
            self._values = values
            self._ask()
        return Status.SUCCESS if self.result is None else Status.FAILURE

    def _ask(self) -> None:
        keys = self._context.keys
        try:
            holds = self._expression.holds(keys)
        except ValueProblem as error:
            self.result = error.as_result()
        else:
            self.result = None if holds else failure(self._code, self._expression.denial(keys))
        self._message = None if self.result is None else self.result.reason

    def _on_key(self, key: str) -> None:
        if self.status is not Status.INVALID and self._answer() is not self.status:
            self._context.wake()

    def _answer(self) -> Status:
        try:
            return Status.SUCCESS if self._expression.holds(self._context.keys) else Status.FAILURE
        except ValueProblem:
            return Status.FAILURE
