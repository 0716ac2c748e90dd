"""Nodes that start what is below them again: retry, repeat, for_each."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.branching import Branching
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore, ValueProblem, readable, resolve
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.stepping import Steps
from florence_bt.behaviours.why import EARLIER, Why, explain, shortened
from florence_bt.core.outcome import Result, failure


class Loop(Branching):
    """A loop: a number of rounds, and the number of the round in a key."""

    def __init__(
        self,
        name: str,
        child: Behaviour,
        context: TreeContext,
        rounds: Any,
        round_key: str | None = None,
        between: Behaviour | None = None,
        own: KeyStore | None = None,
    ) -> None:
        super().__init__(name, context, [child, *([between] if between is not None else [])])
        self.child = child
        self.rounds: float = 0
        self.round = 0
        self._rounds = rounds
        self._round_key = round_key
        self._between = between
        self._own = context.keys if own is None else own

    def begin(self) -> None:
        """Forget the last time; the child starts anew by itself."""
        if self._between is not None:
            self.halt(self._between)
        self.branch, self.result, self.feedback_message = self.child, None, ""

    def prepare(self) -> Result | None:
        """Look up the number of rounds; a failure when there is none."""
        self.rounds = resolve(self._rounds, self._context.keys)
        whole = isinstance(self.rounds, int) and not isinstance(self.rounds, bool)
        if self.rounds != math.inf and (not whole or self.rounds < 1):
            return failure(
                "bad_input", f"{self.name} needs a whole number of at least 1, not {self.rounds!r}"
            )
        if self._round_key is not None:
            self._own.check(self._round_key, 1)
        return None

    def steps(self) -> Steps:
        """Do the round, and what comes between two rounds."""
        if self.status is not Status.RUNNING:
            self.begin()
            try:
                problem = self.prepare()
            except ValueProblem as error:
                problem = error.as_result()
            if problem is not None:
                return self.give_up(problem)
            self.enter(1)
        status = yield from self.branch_steps()
        if self.branch is self._between:
            if status is not Status.SUCCESS:
                return status
            self.branch = self.child
            self.enter(self.round + 1)
            status = yield from self.branch_steps()
        if status is Status.RUNNING or not self.goes_on(status):
            return status
        # The next round begins with the next tick, which the executor is asked for.
        if self._between is None:
            self.enter(self.round + 1)
        else:
            self.branch = self._between
        self._context.wake()
        return Status.RUNNING

    @abstractmethod
    def goes_on(self, status: Status) -> bool:
        """Tell whether another round follows after one that has ended with a status."""

    def _of_all(self, number: int) -> str:
        return str(number) if self.rounds == math.inf else f"{number} of {self.rounds}"

    def enter(self, number: int) -> None:
        """Begin a round."""
        self.round = number
        if self._round_key is not None:
            self._own.write(self._round_key, number)


class Retry(Loop):
    """Starts its child again when it fails.

    Args:
        name: The name of the node in dumps.
        child: What is tried.
        context: What the tree shares.
        attempts: How often at most, or a value source that says so; infinite: without end.
        on: The codes that are worth another attempt; every code when empty.
        attempt_key: The key that receives the number of the attempt, beginning with 1.
        between: What is done before each further attempt; when it fails, the node fails as it did.
        own: The keys as the attempts see them, where their number is written; None: those of the context.
    """

    def __init__(
        self,
        name: str,
        child: Behaviour,
        context: TreeContext,
        attempts: Any,
        on: Collection[str] = (),
        attempt_key: str | None = None,
        between: Behaviour | None = None,
        own: KeyStore | None = None,
    ) -> None:
        super().__init__(name, child, context, attempts, attempt_key, between, own)
        self._on = frozenset(on)
        self._last: Why | None = None
        self._exhausted = False

    def begin(self) -> None:
        """Begin with the first attempt."""
        super().begin()
        self._last, self._exhausted = None, False

    def goes_on(self, status: Status) -> bool:
        """Tell whether a failure is worth another attempt."""
        if status is Status.SUCCESS:
            if self.round > 1:
                self.feedback_message = f"attempt {self._of_all(self.round)} succeeded"
            return False
        if was_skipped(self.child):
            return False
        self._last = explain(self.child)
        assert self._last is not None  # the child's status is FAILURE
        if self._on and self._last.code not in self._on:
            return False
        self._exhausted = self.round >= self.rounds
        if self._exhausted:
            return False
        now = self._of_all(self.round + 1)
        self.feedback_message = f"attempt {now}; the last one failed: {self._last.reason}"
        return True

    def extend_reason(self, why: Why) -> Why:
        """Say how many attempts there were, when they were used up, or what came before what is between."""
        if self._exhausted:
            return replace(why, reason=f"{self.round} of {self.rounds} attempts failed; last: {why.reason}")
        if self.cause is self._between and self._last is not None:
            before = f"attempt {self._of_all(self.round)}: {shortened(self._last.reason)}"
            return replace(why, reason=f"{why.reason}{EARLIER}{before})")
        return why


class Repeat(Loop):
    """Starts its child again when it succeeds, until it has succeeded a number of times.

    Args:
        name: The name of the node in dumps.
        child: What is repeated.
        context: What the tree shares.
        rounds: How often, or a value source that says so; infinite: until it fails.
    """

    skipped = False
    """A round that is skipped is a round."""

    def goes_on(self, status: Status) -> bool:
        """Tell whether there is another round."""
        if status is not Status.SUCCESS or self.round >= self.rounds:
            return False
        self.feedback_message = f"round {self._of_all(self.round + 1)}"
        return True


class ForEach(Branching):
    """Does its child for one item of a list after the other.

    Args:
        name: The name of the node in dumps.
        child: What is done.
        context: What the tree shares.
        items: The list, or a value source that gives it; looked up once, at the start.
        item_key: The key that receives the item.
        index_key: The key that receives the number of the item, counted from 0.
        goes_on_over: The codes of failures after which the next item follows; None: all.
        first_success: Whether the first item that succeeds ends it.
        code: The code of the failure when that is so and no item succeeds.
        own: The keys as the child sees them, where the item is written; None: those of the context.
    """

    skipped = False
    """After an item that is skipped the next one follows."""

    def __init__(
        self,
        name: str,
        child: Behaviour,
        context: TreeContext,
        items: Any,
        item_key: str,
        index_key: str | None = None,
        *,
        goes_on_over: Collection[str] | None = (),
        first_success: bool = False,
        code: str = "none_worked",
        own: KeyStore | None = None,
    ) -> None:
        super().__init__(name, context, [child])
        self.child = child
        self._items = items
        self._item_key = item_key
        self._index_key = index_key
        self._goes_on_over = goes_on_over
        self._first_success = first_success
        self._code = code
        self._own = context.keys if own is None else own
        self._left: list[Any] = []
        self._done = 0
        self._last: Why | None = None

    def steps(self) -> Steps:
        """Do the item; the next one follows with the next tick."""
        if self.status is not Status.RUNNING:
            self.begin()
            self._last = None
            try:
                items = resolve(self._items, self._context.keys)
            except ValueProblem as error:
                return self.give_up(error.as_result())
            if not isinstance(items, tuple):
                return self.give_up(failure("bad_input", f"{self.name} needs a list, not {readable(items)}"))
            self._left, self._done = list(items), 0
            problem = self._next()
        else:
            problem = None
        if problem is None and self.branch is not None:
            status = yield from self.branch_steps()
            if not self._goes_on(status):
                return status
            problem = self._next()
        if problem is not None:
            return self.give_up(problem)
        if self.branch is not None:
            self._context.wake()
            return Status.RUNNING
        if self._first_success:
            return self.give_up(failure(self._code, self._none_worked()))
        return Status.SUCCESS

    def _goes_on(self, status: Status) -> bool:
        """Tell whether the next item follows."""
        if status is not Status.RUNNING and was_skipped(self.child):
            return True
        if status is Status.SUCCESS:
            return not self._first_success
        self._last = explain(self.child)
        if self._last is None:
            return False  # it runs
        return self._goes_on_over is None or self._last.code in self._goes_on_over

    def _next(self) -> Result | None:
        """Go to the next item; a failure when its keys cannot hold it."""
        self.branch = None
        if not self._left:
            return None
        item, index = self._left.pop(0), self._done
        self._done += 1
        try:
            self._own.write(self._item_key, item)
            if self._index_key is not None:
                self._own.write(self._index_key, index)
        except ValueProblem as error:
            return error.as_result()
        self.branch = self.child
        self.feedback_message = self._context.keys.shown(self._item_key, item)
        return None

    def _none_worked(self) -> str:
        if self._last is None:
            return "every item was skipped" if self._done else "the list is empty"
        return f"no item succeeded; the last one: {self._last.reason}"
