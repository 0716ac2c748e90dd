"""Runs of skills that follow a script or a generator, for tests of missions."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Result, cancelled, failure, success
from florence_bt.core.skill import BaseRun, Event, Phase
from florence_bt.mission_testing.values import read_duration


@dataclass(frozen=True, slots=True)
class Step:
    """One run of a scripted skill.

    Attributes:
        result: How the run ends; None when it never ends by itself.
        after: Seconds from the start to the result. 0 means within the start.
        accept_after: Seconds from the start to the acceptance of the goal; a cancel takes effect only then.
        cancel_takes: Seconds from the cancel (after acceptance) to the end.
        feedback_at: What the run says about itself: seconds from the start and the text.
        error: An exception that the run raises instead of giving a result.
    """

    result: Result | None = field(default_factory=success)
    after: float = 0.0
    accept_after: float = 0.0
    cancel_takes: float = 0.0
    feedback_at: tuple[tuple[float, str], ...] = ()
    error: Exception | None = None


class MockRun(BaseRun):
    """A run of a mocked skill, without what it does.

    Args:
        clock: Drives the run.

    Attributes:
        cancelled: Whether it was cancelled before its end.
    """

    def __init__(self, clock: Clock) -> None:
        self.cancelled = False
        self._clock = clock
        super().__init__()
        self._timers: list[Timer] = []
        self._error: Exception | None = None

    @property
    def active(self) -> bool:
        """Tell whether the run has not ended."""
        return self.phase is not Phase.DONE

    def poll(self) -> Result | None:
        """Return the result once its time has come.

        Raises:
            Exception: The error of the mock, once its time has come.
        """
        if self._error is not None:
            raise self._error
        return self.result

    def _finish(self, result: Result | None) -> None:
        for timer in self._timers:
            timer.cancel()
        self.handle(Event.FINISHED, result)

    def _break(self, error: Exception) -> None:
        self._finish(failure("rejected", f"it broke: {error}"))
        self._error = error

    def _soon_or_later(self, seconds: float, callback: Callable[[], None]) -> None:
        if seconds <= 0.0:
            callback()
        else:
            self._timers.append(self._clock.call_at(self._clock.now() + seconds, callback))


class ScriptedRun(MockRun):
    """A run that follows one step of a script."""

    def __init__(self, clock: Clock, step: Step, inputs: Mapping[str, Any]) -> None:
        super().__init__(clock)
        self.inputs = inputs
        self._step = step
        for seconds, text in step.feedback_at:
            self._soon_or_later(seconds, partial(self.set_feedback, text))
        self._soon_or_later(step.accept_after, self._accept)
        if step.error is not None:
            self._soon_or_later(step.after, partial(self._break, step.error))
        elif step.result is not None:
            self._soon_or_later(step.after, partial(self._finish, step.result))

    def cancel(self) -> None:
        """End the run as soon as the server would."""
        self.cancelled = self.cancelled or self.active
        if self.handle(Event.CANCEL):
            self._stop()

    def _accept(self) -> None:
        if self.handle(Event.ACCEPTED):
            self._stop()

    def _stop(self) -> None:
        self._soon_or_later(self._step.cancel_takes, lambda: self._finish(cancelled()))


Routine = Generator[Any, None, Any]
"""A mock written as a generator: it yields how long something takes and returns how the run ends."""


class RoutineRun(MockRun):
    """A run that follows a generator.

    The generator yields durations (``"3 s"``, seconds) or pairs of a duration and what the run says
    meanwhile, and returns what a function mock may return. A cancel closes it at the ``yield`` where it
    stands.

    Args:
        clock: Drives the run.
        routine: The generator.
        settle: Turns what it returns into a step; raises an AssertionError when the skill cannot do that.
        problems: Where misuse is noted.
        caller: The node that started the skill, for messages.
    """

    def __init__(
        self,
        clock: Clock,
        routine: Routine,
        settle: Callable[[Any], Step],
        problems: list[str],
        caller: str,
    ) -> None:
        super().__init__(clock)
        self._routine = routine
        self._settle = settle
        self._problems = problems
        self._caller = caller
        self.handle(Event.ACCEPTED)
        self._go_on()

    def cancel(self) -> None:
        """Close the routine."""
        if self.active:
            self.cancelled = True
            self.handle(Event.CANCEL)
            self._routine.close()
            self._finish(cancelled())

    def _go_on(self) -> None:
        try:
            said = next(self._routine)
            duration, says = said if isinstance(said, tuple) and len(said) == 2 else (said, "")
            seconds = read_duration(duration)
        except StopIteration as end:
            self._end(end.value)
        except ConfigError as error:
            self._problems.append(f"a mock yielded what is not a duration: {error}")
            self._break(error)
        except Exception as error:
            self._problems.append(broken_function(self._caller, error))
            self._break(error)
        else:
            if says:
                self.set_feedback(str(says))
            self._timers.append(self._clock.call_at(self._clock.now() + seconds, self._go_on))

    def _end(self, answer: Any) -> None:
        try:
            step = self._settle(answer)
        except AssertionError as error:
            self._problems.append(str(error))
            self._break(error)
            return
        if step.error is not None:
            self._break(step.error)
        elif step.result is not None:
            self._soon_or_later(step.after, partial(self._finish, step.result))


def broken_function(caller: str, error: Exception) -> str:
    """Return the message for when the function or the generator of a mock raises something."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return (
        f"the mock of {caller} raised {type(error).__name__}: {error}{where}; "
        "for a skill that breaks let it return raises('...')"
    )
