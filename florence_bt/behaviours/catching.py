"""The node behind ``on_failure``: what is done about a failure instead of failing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.branching import Branching
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore, ValueProblem
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.stepping import Steps
from florence_bt.behaviours.why import EARLIER, FAILURE_CODE, FAILURE_REASON, Why, explain, shortened


class OnFailure(Branching):
    """Does its body, and when that fails what is there for the code of the failure; then that counts.

    A handler that is skipped leaves the failure as it was; a body that is skipped has not failed.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        body: What is done first.
        handlers: What is done about failures, in the order of the file.
        by_code: Code -> the handler for it.
        otherwise: The handler for every other code, or None: such a failure stands.
        own: The keys as the handlers see them, where the failure is written; None: those of the context.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        body: Behaviour,
        handlers: list[Behaviour],
        by_code: Mapping[str, Behaviour],
        otherwise: Behaviour | None = None,
        own: KeyStore | None = None,
    ) -> None:
        super().__init__(name, context, [body, *handlers])
        self._body = body
        self._by_code = dict(by_code)
        self._otherwise = otherwise
        self._own = context.keys if own is None else own
        self._caught: Why | None = None

    def steps(self) -> Steps:
        """Do the body, then perhaps a handler."""
        if self.status is not Status.RUNNING:
            self.begin()
            self.branch, self._caught = self._body, None
        status = yield from self.branch_steps()
        if self.branch is not self._body:
            return self._handled(status)
        if status is not Status.FAILURE or was_skipped(self._body):
            return status
        why = explain(self._body)
        assert why is not None  # the status of the body is FAILURE
        handler = self._by_code.get(why.code, self._otherwise)
        if handler is None:
            return status
        try:
            self._own.write(FAILURE_CODE, why.code)
            self._own.write(FAILURE_REASON, why.reason)
        except ValueProblem as error:
            return self.give_up(error.as_result())
        self.branch, self._caught = handler, why
        self.feedback_message = f"{why.code}: {why.reason}"
        return self._handled((yield from self.branch_steps()))

    def _handled(self, status: Status) -> Status:
        """Return how all of it ends when a handler has a status."""
        if status is Status.FAILURE and was_skipped(self.branch):
            self.branch, self._caught, self.feedback_message = self._body, None, ""
        return status

    @property
    def skipped(self) -> bool:
        """Tell whether the body was skipped."""
        return self._caught is None and self.branch is self._body and was_skipped(self._body)

    def extend_reason(self, why: Why) -> Why:
        """Extend the failure of a handler by the one that it was to deal with."""
        if self._caught is None or self._caught.reason in why.reason:
            return why
        return replace(why, reason=f"{why.reason}{EARLIER}{shortened(self._caught.reason)})")
