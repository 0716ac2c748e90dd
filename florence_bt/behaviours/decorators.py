"""Decorators: what they have in common, results, guards, what is done only once, and calls of missions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from florence_bt.behaviours.branch import Branch
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyStore, ValueProblem, resolve
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.declaration import Port
from florence_bt.core.outcome import Outcome, Result, failure


class PreparedDecorator(Decorator):
    """A decorator that looks up what it needs before its child begins, and fails when it cannot.

    The child is not ticked at all when :meth:`prepare` has a result already: then that is the node's own.

    Args:
        name: The name of the node in dumps.
        child: The child, or what builds it when it is to be ticked for the first time.
    """

    on_halt: Callable[[Behaviour], None] | None = None
    """Set by a ticker that wants to stop the child itself."""

    def __init__(self, name: str, child: Behaviour | Branch) -> None:
        self._branch: Branch | None = None
        if isinstance(child, Branch):
            self._branch, child = child, child.stand_in
            above = child.parent
            super().__init__(name, child)
            child.parent = above  # it stays a part of its own tree
        else:
            super().__init__(name, child)
        self.result: Result | None = None

    @property
    def reached(self) -> bool:
        """Tell whether the child is built; until then a stand-in is shown in its place."""
        return self._branch is None

    @property
    def skipped(self) -> bool:
        """Tell whether the child was skipped, and with it this node."""
        return self.result is None and was_skipped(self.decorated)

    def prepare(self) -> Result | None:
        """Look up what is needed for a new round; a failure, or a success, that needs no child."""
        return None

    def tick(self) -> Iterator[Behaviour]:
        """Prepare, then tick as every decorator does."""
        if self.gate():
            yield from super().tick()
        else:
            yield self

    def gate(self) -> bool:
        """Tell whether the child may be ticked now; when not, the node has ended with a result of its own."""
        if self.status is Status.RUNNING:
            return True
        self.feedback_message = ""
        try:
            self.result = self.prepare()
        except ValueProblem as error:
            self.result = error.as_result()
        if self.result is None:
            if self._branch is not None:
                self._build(self._branch)
            return True
        self.settle(self.result)
        return False

    def _build(self, branch: Branch) -> None:
        self._branch = None
        self.decorated = self.children[0] = branch.grow()
        self.decorated.parent = self

    def settle(self, result: Result) -> None:
        """End with a result that the child has no part in."""
        self.feedback_message = result.reason
        if self.decorated.status is not Status.INVALID:
            if self.on_halt is None:
                self.decorated.stop(Status.INVALID)
            else:
                self.on_halt(self.decorated)
        self.stop(Status.SUCCESS if result.succeeded else Status.FAILURE)


class Invert(PreparedDecorator):
    """Turns success into failure and failure into success.

    Args:
        name: The name of the node in dumps.
        child: What is turned round.
        code: The code of the failure when the child has succeeded.
    """

    def __init__(self, name: str, child: Behaviour, code: str = "unexpected_success") -> None:
        super().__init__(name, child)
        self._code = code

    def update(self) -> Status:
        """Return the opposite of the child's status; what was skipped stays so."""
        if was_skipped(self.decorated):
            return self.decorated.status
        if self.decorated.status is Status.FAILURE:
            return Status.SUCCESS
        if self.decorated.status is Status.SUCCESS:
            self.result = failure(self._code, f"{self.decorated.name} succeeded, but the opposite was wanted")
            self.feedback_message = self.result.reason
            return Status.FAILURE
        return self.decorated.status


class ForceSuccess(Decorator):
    """Succeeds when its child is done, whichever way."""

    def update(self) -> Status:
        """Return RUNNING as long as the child is, then SUCCESS."""
        return Status.RUNNING if self.decorated.status is Status.RUNNING else Status.SUCCESS


class CallMission(PreparedDecorator):
    """Runs the tree of another mission with keys of its own.

    Args:
        name: The name of the node in dumps.
        child: The tree of the called mission, built on the called keys, or what builds it.
        context: The context of the caller.
        called_keys: The keys of the called mission.
        ports: The inputs that the called mission declares.
        inputs: Values or value sources (in the caller's keys) by input.
        outputs: Output of the called mission -> key of the caller.
        watched: Whether the call is a condition that is watched: with the same inputs it keeps the keys that
            the called mission has written.
    """

    def __init__(
        self,
        name: str,
        child: Behaviour | Branch,
        context: TreeContext,
        called_keys: KeyStore,
        ports: Mapping[str, Port],
        inputs: Mapping[str, Any],
        outputs: Mapping[str, str],
        *,
        watched: bool = False,
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self.called_keys = called_keys
        self._ports = ports
        self._inputs = dict(inputs)
        self._outputs = dict(outputs)
        self._watched = watched
        self._handed: Mapping[str, Any] | None = None

    skipped = False
    """A skip in another mission is that mission's own business."""

    def prepare(self) -> Result | None:
        """Hand the inputs over."""
        given = {name: resolve(value, self._context.keys) for name, value in self._inputs.items()}
        values = {name: given.get(name, port.default) for name, port in self._ports.items()}
        problems = [
            f"{name}: {text}"
            for name, port in self._ports.items()
            if (text := port.problem_with(values[name]))
        ]
        if problems:
            return failure("bad_input", "; ".join(problems))
        if not self._watched or self.decorated.status is Status.INVALID or values != self._handed:
            self.called_keys.reset(values)
            self._handed = values
        return None

    def update(self) -> Status:
        """Return the status of the called mission; on success its outputs are copied."""
        if self.decorated.status is Status.SUCCESS:
            try:
                for output, key in self._outputs.items():
                    self._context.keys.write(key, self.called_keys.read(output))
            except ValueProblem as error:
                self.result = error.as_result()
                self.feedback_message = self.result.reason
                return Status.FAILURE
        return self.decorated.status


SKIPPED = "skipped"
GUARD_FAILED = "guard_failed"


class StartGuard(PreparedDecorator):
    """Looks at conditions before its child starts, and at nothing afterwards.

    ``when`` comes first: when it does not hold the child is skipped, which counts as success or as failure
    (:mod:`.skipping`). ``while`` comes last: when it does not hold the node fails.

    Args:
        name: The name of the node in dumps.
        child: What is guarded, or what builds it.
        context: What the tree shares.
        when: What must hold, or None.
        holds: What must hold here too and is watched further down, or None.
        code: The code of the failure when that does not hold.
        skipped_fails: Whether a skipped child counts as failure (where another one is tried) or as success.
    """

    def __init__(
        self,
        name: str,
        child: Behaviour | Branch,
        context: TreeContext,
        when: CompiledExpression | None = None,
        holds: CompiledExpression | None = None,
        *,
        code: str = GUARD_FAILED,
        skipped_fails: bool = False,
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self._when = when
        self._holds = holds
        self._code = code
        self._skipped_fails = skipped_fails
        self._skips = False

    @property
    def skipped(self) -> bool:
        """Tell whether the child was skipped, or what is below it."""
        return self._skips or super().skipped

    def prepare(self) -> Result | None:
        """Look at the conditions."""
        self._skips = False
        keys = self._context.keys
        if self._when is not None and not self._when.holds(keys):
            return self._skipped(self._when.denial(keys))
        if self._holds is not None and not self._holds.holds(keys):
            return failure(self._code, self._holds.denial(keys))
        return None

    def update(self) -> Status:
        """Return the status of the child."""
        return self.decorated.status

    def _skipped(self, why: str) -> Result:
        self._skips = True
        reason = f"skipped: {why}"
        return failure(SKIPPED, reason) if self._skipped_fails else Result(Outcome.SUCCEEDED, reason=reason)


class While(PreparedDecorator):
    """Stops its child and fails as soon as a condition does not hold any more.

    A child that succeeds with the same step that ends the condition has succeeded.

    Args:
        name: The name of the node in dumps.
        child: What is guarded.
        context: What the tree shares.
        condition: What must hold at the start and all along.
        code: The code of the failure.

    Attributes:
        memory: False, as of a composite that asks its conditions with every tick.
    """

    memory = False

    def __init__(
        self,
        name: str,
        child: Behaviour,
        context: TreeContext,
        condition: CompiledExpression,
        code: str = GUARD_FAILED,
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self._condition = condition
        self._code = code
        self._end_watch: Callable[[], None] | None = None

    def prepare(self) -> Result | None:
        """Look at the condition before the start."""
        return self.problem()

    def initialise(self) -> None:
        """Begin to watch the keys of the condition."""
        self._end_watch = self._context.keys.watch(self._condition.keys, self._on_key)

    def gate(self) -> bool:
        """Look at the condition, with every tick."""
        if self.status is not Status.RUNNING:
            return super().gate()
        self.result = self.problem()
        if self.result is None:
            return True
        self.settle(self.result)
        return False

    def update(self) -> Status:
        """Return the child's status, or FAILURE if its last step ended the condition and it goes on."""
        if self.decorated.status is Status.RUNNING:
            self.result = self.problem()
            if self.result is not None:
                self.feedback_message = self.result.reason
                return Status.FAILURE
        return self.decorated.status

    def terminate(self, new_status: Status) -> None:
        """Stop watching."""
        if self._end_watch is not None:
            self._end_watch()
            self._end_watch = None

    def problem(self) -> Result | None:
        """Return the failure when the condition does not hold now, or has no value."""
        try:
            if self._condition.holds(self._context.keys):
                return None
        except ValueProblem as error:
            return error.as_result()
        return failure(self._code, self._condition.denial(self._context.keys))

    def _on_key(self, key: str) -> None:
        if self.problem() is not None:
            self._context.wake()


class Once(PreparedDecorator):
    """Does its child once; from then on it has the same result at once, success or failure alike.

    A child that was skipped, or stopped before it was done, is done again. The memory lasts as long as the
    run of the mission.
    """

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child)
        self._remembered: Result | None = None
        self._why: Why | None = None

    @property
    def kept(self) -> Why | None:
        """Tell why the child failed that time."""
        return self._why

    def prepare(self) -> Result | None:
        """Return the result of the first time."""
        return self._remembered

    def update(self) -> Status:
        """Return the status of the child; the first result is remembered."""
        if was_skipped(self.decorated):
            return self.decorated.status
        why = explain(self.decorated)
        if why is not None:
            self._why = why
            self._remembered = failure(why.code, why.reason)
        elif self.decorated.status is Status.SUCCESS:
            self._remembered = Result(Outcome.SUCCEEDED, reason="done before")
        return self.decorated.status
