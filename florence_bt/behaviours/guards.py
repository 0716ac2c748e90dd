"""Guards: what must hold before a node starts (``when``, ``unless``) and all along (``while``)."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import PreparedDecorator
from florence_bt.behaviours.expressions import Formula
from florence_bt.behaviours.keys import ValueProblem
from florence_bt.behaviours.reactive import Reactive
from florence_bt.core.outcome import Outcome, Result, failure

SKIPPED = "skipped"


class StartGuard(Reactive, PreparedDecorator):
    """Looks at conditions before its child starts, and at nothing afterwards.

    ``unless`` and ``when`` come first: when one of them is not met the child is skipped, which counts as
    success or as failure. ``while`` comes last: when it does not hold the node fails.

    Args:
        name: The name of the node in dumps.
        child: What is guarded.
        context: What the tree shares.
        when: What must hold, or None.
        unless: What must not hold, or None.
        holds: What must hold here too and is watched further down, or None.
        skipped_fails: Whether a skipped child counts as failure (below a selector) or as success.
    """

    def __init__(
        self,
        name: str,
        child: Behaviour,
        context: TreeContext,
        when: Formula | None = None,
        unless: Formula | None = None,
        holds: Formula | None = None,
        *,
        skipped_fails: bool = False,
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self._when = when
        self._unless = unless
        self._holds = holds
        self._skipped_fails = skipped_fails
        for formula in (when, unless, holds):
            if formula is not None:
                context.keys.watch(formula.keys, lambda key: self.touch())

    def settled(self) -> bool:
        """Also when it has refused its child: it would again, until a key changes."""
        return self.refused or super().settled()

    def prepare(self) -> Result | None:
        """Look at the conditions."""
        keys = self._context.keys
        if self._unless is not None and self._unless.holds(keys):
            return self._skipped(self._unless.denial(keys, wanted=False))
        if self._when is not None and not self._when.holds(keys):
            return self._skipped(self._when.denial(keys))
        if self._holds is not None and not self._holds.holds(keys):
            return _guard_failed(self._holds, self._context)
        return None

    def update(self) -> Status:
        """The status of the child."""
        return self.decorated.status

    def _skipped(self, why: str) -> Result:
        reason = f"skipped: {why}"
        return failure(SKIPPED, reason) if self._skipped_fails else Result(Outcome.SUCCEEDED, reason=reason)


class While(Reactive, PreparedDecorator):
    """Stops its child and fails with ``guard_failed`` as soon as a condition does not hold any more.

    A child that succeeds with the same step that ends the condition has succeeded.

    Args:
        name: The name of the node in dumps.
        child: What is guarded.
        context: What the tree shares.
        condition: What must hold at the start and all along.
    """

    def __init__(self, name: str, child: Behaviour, context: TreeContext, condition: Formula) -> None:
        super().__init__(name, child)
        self._context = context
        self._condition = condition
        self._end_watch: Callable[[], None] | None = None

    def prepare(self) -> Result | None:
        """Look at the condition before the start."""
        return self.problem()

    def initialise(self) -> None:
        """Begin to watch the keys of the condition."""
        self._end_watch = self._context.keys.watch(self._condition.keys, self._on_key)

    def gate(self) -> bool:
        """Look at the condition, with every tick."""
        if self.status is not Status.RUNNING:
            return super().gate()
        self.result = self.problem()
        if self.result is None:
            return True
        self.settle(self.result)
        return False

    def update(self) -> Status:
        """The status of the child, or FAILURE when its last step ended the condition and it goes on."""
        if self.decorated.status is Status.RUNNING:
            self.result = self.problem()
            if self.result is not None:
                self.feedback_message = self.result.reason
                return Status.FAILURE
        return self.decorated.status

    def terminate(self, new_status: Status) -> None:
        """Watch no more."""
        if self._end_watch is not None:
            self._end_watch()
            self._end_watch = None

    def problem(self) -> Result | None:
        """The failure when the condition does not hold now, or has no value."""
        try:
            if self._condition.holds(self._context.keys):
                return None
        except ValueProblem as error:
            return error.as_result()
        return _guard_failed(self._condition, self._context)

    def _on_key(self, key: str) -> None:
        self.touch()
        if self.problem() is not None:
            self._context.wake()


def _guard_failed(condition: Formula, context: TreeContext) -> Result:
    return failure("guard_failed", condition.denial(context.keys))
