"""Small leaves: succeed, fail with a reason, write keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import ValueProblem, readable, resolve
from florence_bt.behaviours.reactive import AlwaysSettled
from florence_bt.core.outcome import Result, failure


class Succeed(AlwaysSettled, Behaviour):
    """Succeeds at once."""

    def update(self) -> Status:
        """SUCCESS."""
        return Status.SUCCESS


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
