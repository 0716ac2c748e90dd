"""Nodes that go on until something is so: ``until``, ``interrupted_by``, ``wait_until``."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.branching import Branching
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.looping import ForEach, Loop
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.stepping import Steps
from florence_bt.behaviours.watched_skill import EVERY_S
from florence_bt.behaviours.watching import Watch
from florence_bt.behaviours.why import explain
from florence_bt.core.outcome import LASTING_CODES, failure


class Question:
    """A node that is asked until it succeeds.

    What only asks is watched, and so asked again when its answer may have changed. What acts is started again
    after a failure, at the earliest a second after it was started the last time.

    Args:
        context: What the tree shares.
        node: The node.
        watch: Its watch when it only asks, or None.
    """

    def __init__(self, context: TreeContext, node: Behaviour, watch: Watch | None) -> None:
        self.node = node
        self.watch = watch
        self._context = context
        self._timer = WakeTimer(context)
        self._began = 0.0
        self._rests = False

    @property
    def skills(self) -> tuple[Any, ...]:
        """The skills that are asked in the background."""
        return tuple(self.watch.skills) if self.watch is not None else ()

    def begin(self) -> None:
        """Begin anew."""
        self._rests = False
        if self.watch is not None:
            self.watch.begin()

    def end(self) -> None:
        """Ask no more."""
        self._timer.cancel()
        if self.watch is not None:
            self.watch.end()

    def steps(self, *, once_more: bool = False) -> Generator[Behaviour, None, Status]:
        """Ask, when it is time to.

        Args:
            once_more: Whether it was asked in this tick already: what has failed in it does not start again.

        Returns:
            SUCCESS, RUNNING as long as there may be another answer, FAILURE when there will be none.
        """
        if self.watch is not None:
            self.watch.look()
            yield from self.watch.steps(self.node)
            status = self.watch.answer or Status.RUNNING
        elif self._rests and (once_more or not self._is_due):
            return Status.RUNNING
        else:
            if self.node.status is not Status.RUNNING:
                self._began, self._rests = self._context.clock.now(), False
            yield self.node
            status = self.node.status
        if status is not Status.FAILURE:
            return status
        why = explain(self.node)
        if why is not None and why.code in LASTING_CODES:
            return Status.FAILURE
        if self.watch is None:
            self._rests = True
            self._timer.start(max(0.0, self._began + EVERY_S - self._context.clock.now()))
        return Status.RUNNING

    @property
    def _is_due(self) -> bool:
        """Tell whether what has failed may start again; a tick that something else asked for counts, too."""
        return self._timer.fired or self._context.clock.now() >= self._began + EVERY_S


class Until(Branching):
    """Does its body until a question is answered with success: that is its success.

    It fails when the body fails, and with a code of its own when the body is done before that.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        body: What is done meanwhile.
        question: What ends it.
        code: The code of the failure when the body is done first.

    Attributes:
        memory: False where the question is watched, as of a composite that asks its conditions again.
    """

    def __init__(
        self, name: str, context: TreeContext, body: Behaviour, question: Question, code: str
    ) -> None:
        super().__init__(name, context, [body, question.node])
        self._body = body
        self._question = question
        self._code = code
        self.memory = question.watch is None

    @property
    def watched(self) -> tuple[Any, ...]:
        """The skills of the question that are asked in the background."""
        return self._question.skills

    def steps(self) -> Steps:
        """Ask, then go on with the body."""
        if self.status is not Status.RUNNING:
            self.begin()
            self._question.begin()
        if (answer := (yield from self._question.steps())) is not Status.RUNNING:
            return self._answered(answer)
        self.branch = self._body
        status = yield from self.branch_steps()
        if status is Status.SUCCESS and not was_skipped(self._body):
            # Its last step may have been what the question asks for.
            if (answer := (yield from self._question.steps(once_more=True))) is not Status.RUNNING:
                return self._answered(answer)
            reason = f"{self._body.name} was done before {self._question.node.name}"
            return self.give_up(failure(self._code, reason))
        if status is not Status.RUNNING:
            self.halt_running()
        return status

    def _answered(self, answer: Status) -> Status:
        self.branch = self._question.node
        self.halt_running()
        return answer

    def terminate(self, new_status: Status) -> None:
        """Ask no more."""
        self._question.end()


class Interruptible(Branching):
    """Does its body, and something else first whenever a question is answered with success.

    What of the body runs then is stopped. A body that does one thing after the other keeps its place, and
    begins the thing again that was interrupted; every other body begins again as a whole. The question is
    not asked during the interruption, and anew after it.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        body: What is done.
        question: What interrupts it.
        interruption: What is done then.

    Attributes:
        memory: False where the question is watched, as of a composite that asks its conditions again.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        body: Behaviour,
        question: Question,
        interruption: Behaviour,
    ) -> None:
        super().__init__(name, context, [body, question.node, interruption])
        self._body = body
        self._question = question
        self._interruption = interruption
        self._times = 0
        self._goes_on = False
        self.memory = question.watch is None

    @property
    def watched(self) -> tuple[Any, ...]:
        """The skills of the question that are asked in the background."""
        return self._question.skills

    def steps(self) -> Steps:
        """Go on with the body, then ask; or go on with the interruption."""
        if self.status is not Status.RUNNING:
            self.begin()
            self._times, self._goes_on = 0, False
            self._question.begin()
        if self.branch is not self._interruption:
            self.branch = self._body
            # What ends in this step has ended, and does not begin again.
            if self._goes_on and (status := (yield from self.branch_steps())) is not Status.RUNNING:
                return self._ended(status)
            answer = yield from self._question.steps()
            if answer is Status.FAILURE:
                self.branch = self._question.node
                return self._ended(answer)
            if answer is Status.SUCCESS:
                self._interrupt()
            elif self._goes_on:
                return answer
            self._goes_on = answer is Status.RUNNING
        status = yield from self.branch_steps()
        if self.branch is self._interruption and status is Status.SUCCESS:
            self.branch = self._body
            self._question.begin()
            self._context.wake()
            return Status.RUNNING
        return self._ended(status)

    def _ended(self, status: Status) -> Status:
        if status is not Status.RUNNING:
            self.halt_running()
        return status

    def _interrupt(self) -> None:
        self._question.end()
        self.halt(self._question.node)
        self._halt_step(self._body)
        self.branch = self._interruption
        self._times += 1
        self.feedback_message = f"interrupted {self._times} time{'s' if self._times > 1 else ''}"

    def _halt_step(self, body: Behaviour) -> None:
        """Stop what runs of the body; a body that does one thing after the other keeps its place."""
        in_turn = isinstance(body, Loop | ForEach) or (isinstance(body, Sequence | Selector) and body.memory)
        for each in body.children if in_turn else [body]:
            if each.status is Status.RUNNING:
                self.halt(each)

    def terminate(self, new_status: Status) -> None:
        """Ask no more."""
        self._question.end()


class WaitUntil(Branching):
    """Does nothing until a question is answered with success.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        question: What is waited for.

    Attributes:
        memory: False, as of a composite that asks its conditions again.
    """

    memory = False

    def __init__(self, name: str, context: TreeContext, question: Question) -> None:
        super().__init__(name, context, [question.node])
        self._question = question

    @property
    def watched(self) -> tuple[Any, ...]:
        """The skills of the question that are asked in the background."""
        return self._question.skills

    def steps(self) -> Steps:
        """Ask."""
        if self.status is not Status.RUNNING:
            self.begin()
            self.branch = self._question.node
            self._question.begin()
        return (yield from self._question.steps())

    def terminate(self, new_status: Status) -> None:
        """Ask no more."""
        self._question.end()
