"""A mock written as a generator: it yields how long something takes and returns how the run ends."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Result, cancelled, failure
from florence_bt.core.skill import Event, Phase, RunState
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.mission_testing.values import read_duration

Routine = Generator[Any, None, Any]


class RoutineRun:
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
        self._caller = caller
        self.cancelled = False
        self._clock = clock
        self._routine = routine
        self._settle = settle
        self._problems = problems
        self._state = RunState()
        self._state.handle(Event.ACCEPTED)
        self._timer: Timer | None = None
        self._error: Exception | None = None
        self._go_on()

    @property
    def feedback(self) -> str:
        """What the routine said last."""
        return self._state.feedback

    @property
    def result(self) -> Result | None:
        """The result once there is one."""
        return self._state.result

    def poll(self) -> Result | None:
        """The result once the routine has returned.

        Raises:
            Exception: What came out of the routine.
        """
        if self._error is not None:
            raise self._error
        return self._state.result

    def cancel(self) -> None:
        """Close the routine."""
        if self._state.phase is Phase.DONE:
            return
        self.cancelled = True
        self._state.handle(Event.CANCEL)
        self._routine.close()
        self._finish(cancelled())

    def on_change(self, callback: Callable[[], None]) -> None:
        """Remember whom to wake."""
        self._state.on_change(callback)

    def _go_on(self) -> None:
        try:
            seconds, says = _pause(next(self._routine))
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
                self._state.set_feedback(says)
            self._timer = self._clock.call_at(self._clock.now() + seconds, self._go_on)

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
            result = step.result
            self._timer = self._clock.call_at(self._clock.now() + step.after, lambda: self._finish(result))
            if step.after <= 0.0:
                self._finish(result)

    def _break(self, error: Exception) -> None:
        self._finish(failure("rejected", f"it broke: {error}"))
        self._error = error

    def _finish(self, result: Result) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._state.handle(Event.FINISHED, result)


def broken_function(caller: str, error: Exception) -> str:
    """What is told when the function or the generator of a mock raises something."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return (
        f"the mock of {caller} raised {type(error).__name__}: {error}{where}; "
        "for a skill that breaks let it return raises('...')"
    )


def _pause(said: Any) -> tuple[float, str]:
    if isinstance(said, tuple) and len(said) == 2:
        return read_duration(said[0]), str(said[1])
    return read_duration(said), ""
