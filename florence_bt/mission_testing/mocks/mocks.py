"""Skills that follow a script, for tests of missions and for dry runs without a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES, Result, cancelled, failure, success
from florence_bt.core.skill import Event, Inputs, Phase, RunState


@dataclass(frozen=True, slots=True)
class Step:
    """One run of a scripted skill.

    Attributes:
        result: How the run ends; None when it never ends by itself.
        after: Seconds from the start to the result. 0 means within the start.
        accept_after: Seconds from the start to the acceptance of the goal; a cancel takes effect only then.
        cancel_takes: Seconds from the cancel (after acceptance) to the end.
        feedback: What the run says about itself.
        feedback_at: What it says later: seconds from the start and the text.
        error: An exception that the run raises instead of giving a result.
    """

    result: Result | None = field(default_factory=success)
    after: float = 0.0
    accept_after: float = 0.0
    cancel_takes: float = 0.0
    feedback: str = ""
    feedback_at: tuple[tuple[float, str], ...] = ()
    error: Exception | None = None


class ScriptedRun:
    """A run of :class:`ScriptedSkill`."""

    def __init__(self, clock: Clock, step: Step, inputs: Mapping[str, Any]) -> None:
        self.inputs = inputs
        self.cancelled = False
        self._clock = clock
        self._step = step
        self._state = RunState(step.feedback)
        self._timers: list[Timer] = []
        self._error: Exception | None = None
        for seconds, text in step.feedback_at:
            self._soon_or_later(seconds, partial(self._state.set_feedback, text))
        self._soon_or_later(step.accept_after, self._accept)
        if step.error is not None:
            self._soon_or_later(step.after, self._break)
        elif step.result is not None:
            self._soon_or_later(step.after, partial(self._finish, step.result))

    @property
    def feedback(self) -> str:
        """The step's feedback."""
        return self._state.feedback

    @property
    def result(self) -> Result | None:
        """The result once its time has come."""
        return self._state.result

    @property
    def active(self) -> bool:
        """Whether the run has not ended."""
        return self._state.phase is not Phase.DONE

    def poll(self) -> Result | None:
        """The result once its time has come.

        Raises:
            Exception: The error of the step, once its time has come.
        """
        if self._error is not None:
            raise self._error
        return self._state.result

    def cancel(self) -> None:
        """End the run as soon as the other side would."""
        self.cancelled = self.cancelled or self.active
        if self._state.handle(Event.CANCEL):
            self._stop()

    def on_change(self, callback: Any) -> None:
        """Remember whom to wake."""
        self._state.on_change(callback)

    def _accept(self) -> None:
        if self._state.handle(Event.ACCEPTED):
            self._stop()

    def _stop(self) -> None:
        if self._step.cancel_takes <= 0.0:
            self._finish(cancelled())
        else:
            self._later(self._step.cancel_takes, lambda: self._finish(cancelled()))

    def _finish(self, result: Result | None) -> None:
        for timer in self._timers:
            timer.cancel()
        self._state.handle(Event.FINISHED, result)

    def _break(self) -> None:
        error = self._step.error
        self._finish(failure("rejected", f"it broke: {error}"))
        self._error = error

    def _soon_or_later(self, seconds: float, callback: Callable[[], None]) -> None:
        if seconds <= 0.0:
            callback()
        else:
            self._later(seconds, callback)

    def _later(self, seconds: float, callback: Callable[[], None]) -> None:
        self._timers.append(self._clock.call_at(self._clock.now() + seconds, callback))


class ScriptedSkill:
    """A skill whose n-th run follows the n-th step of a script; the last step is used for every further run.

    Args:
        declaration: What the real skill says about itself; inputs and results are checked against it.
        clock: Drives the runs.
        script: The steps, at least one.

    Raises:
        AssertionError: A result has a code or an output that the skill does not declare.
    """

    def __init__(
        self, declaration: SkillDeclaration, clock: Clock, script: Sequence[Step] = (Step(),)
    ) -> None:
        if not script:
            raise ValueError("a script needs at least one step")
        for step in script:
            _check_result(declaration, step.result)
        self.declaration = declaration
        self.runs: list[ScriptedRun] = []
        self._clock = clock
        self._script = tuple(script)

    @property
    def calls(self) -> list[Mapping[str, Any]]:
        """The inputs of every run so far."""
        return [run.inputs for run in self.runs]

    @property
    def active(self) -> int:
        """How many runs have not ended."""
        return sum(run.active for run in self.runs)

    def start(self, inputs: Inputs) -> ScriptedRun:
        """Begin the next step.

        Raises:
            AssertionError: The inputs do not fit the declaration, or are not complete.
        """
        problems = self.declaration.problems_with(inputs)
        problems += [f"{name} was not filled in" for name in self.declaration.inputs if name not in inputs]
        if problems:
            raise AssertionError(
                f"{self.declaration.name} was started with bad inputs: {'; '.join(problems)}"
            )
        step = self._script[min(len(self.runs), len(self._script) - 1)]
        run = ScriptedRun(self._clock, step, dict(inputs))
        self.runs.append(run)
        return run


def _check_result(declaration: SkillDeclaration, result: Result | None) -> None:
    if result is None:
        return
    codes = {"ok", *declaration.failures, *COMMON_CODES}
    if result.code not in codes:
        raise AssertionError(f"{declaration.name} cannot end with {result.code!r}, only with {sorted(codes)}")
    for name in result.outputs:
        if name not in declaration.outputs:
            raise AssertionError(
                f"{declaration.name} has no output {name!r}, only {sorted(declaration.outputs)}"
            )
