"""The one adapter between a skill and a tree: starts it, looks at its run, cancels it when it is left."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.context import OpenRun, TreeContext
from florence_bt.behaviours.keys import ValueProblem, is_source, resolve
from florence_bt.behaviours.why import path_of
from florence_bt.core.errors import closest_first
from florence_bt.core.outcome import Outcome, Result, failure


class ResourceLock:
    """Waits until the resources of a skill are free.

    The skill holds them from its start until it has reported its end (``TreeContext.holder``).

    The check refuses missions whose branches want one resource at the same time. What is left are the moments
    in which a skill was cancelled and has not stopped yet, and clean-ups beside the tree.

    Args:
        context: What the tree shares.
        skill: The skill that wants to start.
    """

    def __init__(self, context: TreeContext, skill: str) -> None:
        self.feedback = ""
        self._context = context
        self._skill = skill
        self._timer = WakeTimer(context)
        self._waiting = False

    def acquire(self) -> bool:
        """Tell whether the skill may start now; else wait for its resources."""
        holder = self._context.holder(self._skill)
        if holder is None:
            self.release()
            return True
        if not self._waiting:
            self._waiting = True
            self._context.waiting.append(self._context.wake)
            self._timer.start(self._context.declarations[self._skill].deadline_s)
        needs = sorted(holder.resources & self._context.declarations[self._skill].resources)
        self.feedback = f"waits for the {' and the '.join(needs)}, which {holder.skill} at {holder.path} has"
        return False

    @property
    def timed_out(self) -> Result | None:
        """The failure when the wait has taken as long as the skill itself may take, else None."""
        if not self._timer.fired:
            return None
        deadline = self._context.declarations[self._skill].deadline_s
        return failure(
            "timed_out", f"{self._skill} could not start within {deadline:g} s: it {self.feedback}"
        )

    def release(self) -> None:
        """Stop waiting."""
        if self._waiting:
            self._waiting = False
            self._context.waiting.remove(self._context.wake)
        self._timer.cancel()


PAUSED = "cancelled for the pause"
"""Message of a node whose skill a pause has cancelled; it is started again afterwards."""


class RunSkill(Behaviour):
    """Runs a skill.

    RUNNING while the run goes on, SUCCESS with its outputs written to keys, FAILURE with the result in
    :attr:`result`. Nothing is started when an input is missing or outside what the skill declares, and not
    before every other skill of the run has left what this one needs for itself. A run that takes longer than
    the declaration allows is cancelled and fails with ``timed_out``.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        skill: The name of the skill, one of the context's declarations.
        inputs: Values in SI units or value sources, by input name.
        outputs: Output name -> key that receives it.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        outputs: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(name)
        self.skill = skill
        self.inputs = dict(inputs or {})
        self.outputs = dict(outputs or {})
        self.result: Result | None = None
        self._context = context
        self._declaration = context.declarations[skill]
        self._entry: OpenRun | None = None
        needs = self._declaration.resources
        self._lock = ResourceLock(context, skill) if needs else None
        self._waiting: dict[str, Any] | None = None
        self._literals: dict[str, Any] | None = None
        self._path = ""

    def initialise(self) -> None:
        """Check the inputs and start the skill."""
        self.result = None
        self.feedback_message = ""
        known = self._literals is not None and self.skill in self._context.skills
        self._waiting = dict(self._literals or {}) if known else self._complete_inputs()
        self._start_when_free()

    def update(self) -> Status:
        """Look at the run, or whether it can be started by now."""
        if self._entry is not None and self._entry.suspended and not self._start_again(self._entry):
            return Status.RUNNING
        if self._waiting is not None and self._lock is not None:
            self._start_when_free()
            if self._waiting is not None:
                self.result = self._lock.timed_out
                if self.result is None:
                    self.feedback_message = self._lock.feedback
                    return Status.RUNNING
        if self._entry is not None:
            result = self._context.poll(self._entry)
            if result is None and not self._entry.late:
                self.feedback_message = self._entry.run.feedback
                return Status.RUNNING
            self.result = self._timed_out() if result is None else self._checked(result)
        assert self.result is not None
        self.feedback_message = self.result.reason
        if self.result.outcome is not Outcome.SUCCEEDED:
            return Status.FAILURE
        for output, key in self.outputs.items():
            self._context.keys.write(key, self.result.outputs[output])
        return Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Leave no run behind, also when its goal was not accepted yet."""
        if self._lock is not None:
            self._lock.release()
        entry, self._entry, self._waiting = self._entry, None, None
        if entry is not None and entry in self._context.runs:
            self._context.leave(entry)

    def _start_again(self, entry: OpenRun) -> bool:
        """Start the skill once more after a pause; False while that has to wait.

        It waits for a condition above it that is still asked again; and, in a clean-up of a run that was
        stopped while it was paused, for the end of the run that was cancelled for the pause.
        """
        if not entry.end_reported:
            return False
        asked = [node.name for node in self._conditions_above() if node.is_asked_again]
        if asked:
            self.feedback_message = f"waits for what {' and '.join(asked)} will answer after the pause"
            return False
        self._entry, self._waiting, self.feedback_message = None, dict(entry.inputs or {}), ""
        self._context.drop(entry)
        self._start_when_free()
        return True

    def _on_suspend(self) -> None:
        """Say no longer what the skill does: it was cancelled for the pause."""
        self.feedback_message = PAUSED

    def _on_resume(self) -> None:
        """Start the skill again, unless something above is asked anew in the next tick, before this node."""
        if self._entry is not None and all(getattr(node, "memory", True) for node in self._above()):
            self._start_again(self._entry)

    def _conditions_above(self) -> Iterator[Any]:
        """Yield the conditions that composites above watch for what is below."""
        for node in self._above():
            yield from getattr(node, "watched", ())

    def _above(self) -> Iterator[Behaviour]:
        """Yield the nodes above this one; those of a clean-up beside the tree end with the clean-up."""
        node: Behaviour = self
        while node.parent is not None and node in node.parent.children:
            node = node.parent
            yield node

    def _start_when_free(self) -> None:
        if self._waiting is None or (self._lock is not None and not self._lock.acquire()):
            return
        inputs, self._waiting = self._waiting, None
        self._path = self._path or path_of(self)
        self._entry = self._context.start(self._path, self.skill, inputs)
        self._entry.on_suspend, self._entry.on_resume = self._on_suspend, self._on_resume

    def _complete_inputs(self) -> dict[str, Any] | None:
        """Return the skill's inputs; None when it cannot be started, with the reason in the result."""
        try:
            inputs = {name: resolve(value, self._context.keys) for name, value in self.inputs.items()}
        except ValueProblem as error:
            self.result = error.as_result()
            return None
        self.result = self._refusal(inputs)
        if self.result is not None:
            return None
        complete = self._declaration.complete(inputs)
        if not any(is_source(value) for value in self.inputs.values()):
            # All inputs are literals of the mission, so they are checked once.
            self._literals = dict(complete)
        return complete

    def _refusal(self, inputs: Mapping[str, Any]) -> Result | None:
        if self.skill not in self._context.skills:
            has = ", ".join(closest_first(self.skill, self._context.skills)) or "none"
            return failure("no_skill", f"this robot has no skill {self.skill} (it has: {has})")
        problems = self._declaration.problems_with(inputs)
        return failure("bad_input", "; ".join(problems)) if problems else None

    def _timed_out(self) -> Result:
        doing = f", at the end: {self.feedback_message}" if self.feedback_message else ""
        return failure(
            "timed_out", f"{self.skill} was not done within {self._declaration.deadline_s:g} s{doing}"
        )

    def _checked(self, result: Result) -> Result:
        """Make a result keep its promises: a code and a reason on failure, outputs on success."""
        outcome = result.outcome
        if outcome is Outcome.CANCELLED:
            return failure("cancelled", result.reason or f"{self.skill} was cancelled by its server")
        if outcome is not Outcome.SUCCEEDED:
            return (
                result if result.reason else failure(result.code, f"{self.skill} failed with {result.code}")
            )
        for output, key in self.outputs.items():
            port = self._declaration.outputs.get(output)
            if output not in result.outputs or port is None:
                return failure("bad_output", f"{self.skill} gave no output {output!r} although it succeeded")
            problem = port.problem_with(result.outputs[output])
            if problem:
                return failure("bad_output", f"the output {output!r} of {self.skill} is wrong: {problem}")
            try:
                self._context.keys.check(key, result.outputs[output])
            except ValueProblem as error:
                return error.as_result()
        return result
