"""Nodes about time: time-out, wait.

They use the clock of the context and wake the executor themselves, so a waiting tree needs no ticks. (The
timers of py_trees read the clock of the operating system and are not used.)
"""

from __future__ import annotations

from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours._wake_timer import WakeTimer, bad_duration
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import PreparedDecorator
from florence_bt.behaviours.keys import ValueProblem, resolve
from florence_bt.behaviours.watching import Spot
from florence_bt.core.outcome import Result, failure


class Wait(Behaviour):
    """Succeeds after a pause.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        duration: Seconds, or a value source that gives them.
        spot: Where it stands in a condition that is watched, or None: it does not wait again for nothing.
    """

    only_asks = True
    """In a condition it takes nothing away from the later nodes."""

    def __init__(self, name: str, context: TreeContext, duration: Any, spot: Spot | None = None) -> None:
        super().__init__(name)
        self.result: Result | None = None
        self._context = context
        self._duration = duration
        self._timer = WakeTimer(context)
        self._spot = spot
        self._waited = False

    def initialise(self) -> None:
        """Begin the pause."""
        self.feedback_message = ""
        self.result = None
        self._waited = self._spot is not None and self._spot.recall() is not None
        if self._waited:
            return
        try:
            duration = resolve(self._duration, self._context.keys)
        except ValueProblem as error:
            self.result = error.as_result()
            return
        self.result = bad_duration(duration)
        self._waited = duration == 0
        if self.result is None and not self._waited:
            self._timer.start(duration)

    def update(self) -> Status:
        """Return RUNNING until the pause is over."""
        if self.result is not None:
            self.feedback_message = self.result.reason
            return Status.FAILURE
        if not self._waited and not self._timer.fired:
            return Status.RUNNING
        if self._spot is not None:
            self._spot.keep(True)
        return Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Forget the timer."""
        self._timer.cancel()


class Timeout(PreparedDecorator):
    """Stops its child and fails when the child takes too long.

    Args:
        name: The name of the node in dumps.
        child: What is limited.
        context: What the tree shares.
        duration: Seconds, or a value source that gives them.
        spot: Where it stands in a condition that is watched, or None: what took too long is not tried again
            for nothing.
    """

    def __init__(
        self, name: str, child: Behaviour, context: TreeContext, duration: Any, spot: Spot | None = None
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self._duration = duration
        self._seconds = 0.0
        self._timer = WakeTimer(context)
        self._spot = spot

    def prepare(self) -> Result | None:
        """Look up the duration."""
        late: Result | None = self._spot.recall() if self._spot is not None else None
        if late is not None:
            return late
        self._seconds = resolve(self._duration, self._context.keys)
        return bad_duration(self._seconds)

    def initialise(self) -> None:
        """Start the timer."""
        self._timer.start(self._seconds)

    def update(self) -> Status:
        """Return the child's status, or FAILURE when the time is over and it still runs."""
        if self.decorated.status is Status.RUNNING and self._timer.fired:
            leaf = _running_leaf(self.decorated)
            doing = f"{leaf.name}: {leaf.feedback_message}" if leaf.feedback_message else leaf.name
            reason = f"{self.decorated.name} was not done within {self._seconds:g} s (it was at {doing})"
            self.result = failure("timed_out", reason)
            self.feedback_message = reason
            if self._spot is not None:
                self._spot.keep(self.result)
            return Status.FAILURE
        if self._spot is not None and self.decorated.status is not Status.RUNNING:
            self._spot.forget()
        return self.decorated.status

    def terminate(self, new_status: Status) -> None:
        """Forget the timer."""
        self._timer.cancel()


def _running_leaf(node: Behaviour) -> Behaviour:
    """Return what goes on; the tip of a parallel is its last branch, which may have ended."""
    while child := next((child for child in node.children if child.status is Status.RUNNING), None):
        node = child
    return node
