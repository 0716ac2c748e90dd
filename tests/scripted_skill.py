"""A skill that follows a script, for tests of trees and of the executor below the stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from florence_bt.core.clock import Clock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES, Result
from florence_bt.core.skill import Inputs
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step


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
