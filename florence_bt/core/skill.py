"""The contract in the middle: a behaviour starts a skill and looks at its run. It cannot tell whether the
skill is a pure component in this process, a ROS action or service, or a mock.

The states of a run are one table (:data:`TRANSITIONS`); :class:`BaseRun` walks it. It is the base of the
implementations of ``SkillRun``, so a cancel is never lost, even before the server has accepted the
goal.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from florence_bt.core.outcome import Result, failure

Inputs = Mapping[str, Any]
"""The inputs of one run by name, in SI units, already checked against the skill's declaration."""


class SkillRun(Protocol):
    """One run of a skill, from its start to its result."""

    @property
    def feedback(self) -> str:
        """Say what the run does now, for people; steady while nothing new happens."""

    def poll(self) -> Result | None:
        """Return the result, or None while the run goes on. Never blocks."""

    def cancel(self) -> None:
        """Ask for the end. Idempotent, and takes effect in every state, also before acceptance."""

    def on_change(self, callback: Callable[[], None]) -> None:
        """Call back whenever ``poll`` or ``feedback`` may answer something new."""


class Skill(Protocol):
    """Something the robot can do."""

    def start(self, inputs: Inputs) -> SkillRun:
        """Begin a run. Never blocks; what goes wrong is in the run's result, not raised."""


class WakingSkill(Skill, Protocol):
    """A condition that reports changes of its answer, so that it needs no polling."""

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back whenever a run with these inputs may end differently than the last one.

        Args:
            inputs: The inputs of the runs.
            callback: Takes nothing; it should be called on the thread that starts the runs.

        Returns:
            A function that ends the watch.
        """


class Phase(enum.Enum):
    """The phases of a run between its start and its result."""

    PENDING = "pending"
    """The goal was sent; the server has not answered."""
    PENDING_CANCEL = "pending, cancel wanted"
    """As above, and a cancel will follow the acceptance at once."""
    ACTIVE = "active"
    CANCELLING = "cancelling"
    """The other side was asked to stop and has not reported the end."""
    DONE = "done"

    # Looked up at every step of a run; that of Enum is computed in Python.
    __hash__ = object.__hash__


class Event(enum.Enum):
    """The events of a run."""

    ACCEPTED = "accepted"
    CANCEL = "cancel"
    FINISHED = "finished"
    """A result, a rejection, a passed deadline or the loss of the server."""

    __hash__ = object.__hash__


TRANSITIONS: dict[tuple[Phase, Event], tuple[Phase, bool]] = {
    (Phase.PENDING, Event.ACCEPTED): (Phase.ACTIVE, False),
    (Phase.PENDING, Event.CANCEL): (Phase.PENDING_CANCEL, False),
    (Phase.PENDING, Event.FINISHED): (Phase.DONE, False),
    (Phase.PENDING_CANCEL, Event.ACCEPTED): (Phase.CANCELLING, True),
    (Phase.PENDING_CANCEL, Event.CANCEL): (Phase.PENDING_CANCEL, False),
    (Phase.PENDING_CANCEL, Event.FINISHED): (Phase.DONE, False),
    (Phase.ACTIVE, Event.ACCEPTED): (Phase.ACTIVE, False),
    (Phase.ACTIVE, Event.CANCEL): (Phase.CANCELLING, True),
    (Phase.ACTIVE, Event.FINISHED): (Phase.DONE, False),
    (Phase.CANCELLING, Event.ACCEPTED): (Phase.CANCELLING, False),
    (Phase.CANCELLING, Event.CANCEL): (Phase.CANCELLING, False),
    (Phase.CANCELLING, Event.FINISHED): (Phase.DONE, False),
    # A server that accepts after its deadline passed is cancelled: no goal is left running.
    (Phase.DONE, Event.ACCEPTED): (Phase.DONE, True),
    (Phase.DONE, Event.CANCEL): (Phase.DONE, False),
    (Phase.DONE, Event.FINISHED): (Phase.DONE, False),
}
"""(phase, event) -> (next phase, whether a cancel must be sent to the server now)."""


class BaseRun:
    """The life of one run: its phase, its result and its subscribers.

    An implementation adds ``cancel``. It calls :meth:`handle` with what happened and sends a cancel to the
    other side when that answers True. The first result stays; later ones are dropped.

    Args:
        feedback: What the run does at the start.

    Attributes:
        phase: Where the run stands.
        result: None while the run goes on.
    """

    def __init__(self, feedback: str = "") -> None:
        self.phase = Phase.PENDING
        self.result: Result | None = None
        self._feedback = feedback
        self._callbacks: list[Callable[[], None]] = []

    @property
    def feedback(self) -> str:
        """Say what the run does now."""
        return self._feedback

    def poll(self) -> Result | None:
        """Return the result, or None while the run goes on."""
        return self.result

    def set_feedback(self, text: str) -> None:
        """Change the feedback and notify the subscribers, if it is new."""
        if text != self._feedback and self.phase is not Phase.DONE:
            self._feedback = text
            self._changed()

    def on_change(self, callback: Callable[[], None]) -> None:
        """Subscribe a callback."""
        self._callbacks.append(callback)

    def handle(self, event: Event, result: Result | None = None) -> bool:
        """Take an event.

        Args:
            event: What happened.
            result: The result that comes with ``FINISHED``.

        Returns:
            Whether a cancel must be sent to the server now.

        Raises:
            ValueError: ``FINISHED`` came without a result.
        """
        if event is Event.FINISHED and result is None:
            raise ValueError("a run cannot finish without a result")
        before = self.phase
        self.phase, must_stop = TRANSITIONS[before, event]
        if self.phase is Phase.DONE and before is not Phase.DONE:
            self.result = result
        if self.phase is not before:
            self._changed()
        return must_stop

    def _changed(self) -> None:
        for callback in tuple(self._callbacks):
            callback()


class FinishedRun:
    """A run that was over before it began: an instant skill, or a goal that cannot be tried."""

    def __init__(self, result: Result) -> None:
        self._result = result

    @property
    def feedback(self) -> str:
        """The reason of the result."""
        return self._result.reason

    def poll(self) -> Result:
        """Return the result."""
        return self._result

    def cancel(self) -> None:
        """Do nothing: nothing is left to cancel."""

    def on_change(self, callback: Callable[[], None]) -> None:
        """Do nothing: nothing will change."""


class MissingSkill:
    """Stands for a skill that could not be made: every start fails with ``no_skill`` and the reason.

    Attributes:
        reason: Why it could not be made.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason

    def start(self, inputs: Inputs) -> FinishedRun:
        """Fail at once."""
        return FinishedRun(failure("no_skill", self.reason))


class InstantSkill:
    """A skill that answers at once: a plain function from inputs to a result."""

    def __init__(self, function: Callable[[Inputs], Result]) -> None:
        self._function = function

    def start(self, inputs: Inputs) -> FinishedRun:
        """Call the function."""
        return FinishedRun(self._function(inputs))
