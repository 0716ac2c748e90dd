"""Decorators that remember earlier rounds: a cool-down after a success, and what is done only once."""

from __future__ import annotations

from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours._alarm import Alarm, bad_duration
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import PreparedDecorator
from florence_bt.behaviours.keys import resolve
from florence_bt.behaviours.reactive import Reactive
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.outcome import Outcome, Result, failure

COOLING_DOWN = "cooling_down"


class Cooldown(Reactive, PreparedDecorator):
    """Fails with ``cooling_down`` when it is started again too soon after its child has succeeded.

    The time is counted from the end of the child, for as long as the run of the mission lasts. When it is
    over the executor is woken, so that a selector without memory tries again.

    Args:
        name: The name of the node in dumps.
        child: What must not be done too often.
        context: What the tree shares.
        duration: Seconds, or a value source that gives them.
    """

    def __init__(self, name: str, child: Behaviour, context: TreeContext, duration: Any) -> None:
        super().__init__(name, child)
        self._context = context
        self._duration = duration
        self._seconds = 0.0
        self._alarm = Alarm(context, self.touch)
        self._last_success: float | None = None

    def settled(self) -> bool:
        """Also while it cools down: the end of that time touches it."""
        cooling = self.refused and self.result is not None and self.result.code == COOLING_DOWN
        return cooling or super().settled()

    def prepare(self) -> Result | None:
        """See whether enough time has passed."""
        self._seconds = resolve(self._duration, self._context.keys)
        problem = bad_duration(self._seconds)
        if problem is not None or self._last_success is None:
            return problem
        left = self._last_success + self._seconds - self._context.clock.now()
        if left <= 0.0:
            return None
        self._alarm.set(left)
        done = f"{self.decorated.name} succeeded less than {self._seconds:g} s ago"
        return failure(COOLING_DOWN, done)

    def update(self) -> Status:
        """The status of the child; a success is remembered."""
        if self.decorated.status is Status.SUCCESS:
            self._last_success = self._context.clock.now()
        return self.decorated.status

    def terminate(self, new_status: Status) -> None:
        """Wake nobody any more when the node is reset."""
        if new_status is Status.INVALID:
            self._alarm.clear()


class Once(Reactive, PreparedDecorator):
    """Does its child once; from then on it has the same result at once, success or failure alike.

    A child that was stopped before it was done is done again. The memory lasts as long as the run of the
    mission.
    """

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child)
        self._remembered: Result | None = None
        self._why: Why | None = None

    @property
    def kept(self) -> Why | None:
        """Why the child failed that time."""
        return self._why

    def settled(self) -> bool:
        """Also once it has been done: from then on the result stays."""
        return (self.refused and self._remembered is not None) or super().settled()

    def prepare(self) -> Result | None:
        """The result of the first time."""
        return self._remembered

    def update(self) -> Status:
        """The status of the child; the first result is remembered."""
        why = explain(self.decorated)
        if why is not None:
            self._why = why
            self._remembered = failure(why.code, why.reason)
        elif self.decorated.status is Status.SUCCESS:
            self._remembered = Result(Outcome.SUCCEEDED, reason="done before")
        return self.decorated.status
