"""What the decorators here have in common, those that change a status, and the call of another mission."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore, ValueProblem, resolve
from florence_bt.behaviours.reactive import AlwaysSettled, Reactive
from florence_bt.core.declaration import Port
from florence_bt.core.outcome import Result, failure


class PreparedDecorator(Decorator):
    """A decorator that looks up what it needs before its child begins, and fails when it cannot.

    The child is not ticked at all when :meth:`prepare` has a result already: then that is the node's own.
    """

    on_halt: Callable[[Behaviour], None] | None = None
    """Set by a ticker that wants to stop the child itself."""

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child)
        self.result: Result | None = None

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
        """Whether the child may be ticked now; when not, the node has ended with a result of its own."""
        if self.status is Status.RUNNING:
            return True
        self.feedback_message = ""
        try:
            self.result = self.prepare()
        except ValueProblem as error:
            self.result = error.as_result()
        if self.result is None:
            return True
        self.settle(self.result)
        return False

    @property
    def refused(self) -> bool:
        """Whether the node has ended with a result of its own and without its child."""
        return self.result is not None and self.decorated.status is Status.INVALID

    def settle(self, result: Result) -> None:
        """End with a result that the child has no part in."""
        self.feedback_message = result.reason
        if self.decorated.status is not Status.INVALID:
            if self.on_halt is None:
                self.decorated.stop(Status.INVALID)
            else:
                self.on_halt(self.decorated)
        self.stop(Status.SUCCESS if result.succeeded else Status.FAILURE)


class Invert(AlwaysSettled, PreparedDecorator):
    """Turns success into failure and failure into success."""

    def update(self) -> Status:
        """The opposite of the child's status."""
        if self.decorated.status is Status.FAILURE:
            return Status.SUCCESS
        if self.decorated.status is Status.SUCCESS:
            self.result = failure("inverted", f"{self.decorated.name} succeeded, but the opposite was wanted")
            self.feedback_message = self.result.reason
            return Status.FAILURE
        return self.decorated.status


class ForceSuccess(AlwaysSettled, Decorator):
    """Succeeds when its child is done, whichever way."""

    def update(self) -> Status:
        """RUNNING as long as the child is, then SUCCESS."""
        return Status.RUNNING if self.decorated.status is Status.RUNNING else Status.SUCCESS


class ForceFailure(AlwaysSettled, PreparedDecorator):
    """Fails when its child is done, whichever way; a failure of the child stands as it is."""

    def update(self) -> Status:
        """RUNNING as long as the child is, then FAILURE."""
        if self.decorated.status is Status.RUNNING:
            return Status.RUNNING
        if self.decorated.status is Status.SUCCESS:
            self.result = failure("forced", f"{self.decorated.name} succeeded, which counts as failure here")
            self.feedback_message = self.result.reason
        return Status.FAILURE


class CallMission(Reactive, PreparedDecorator):
    """Runs the tree of another mission with keys of its own.

    Args:
        name: The name of the node in dumps.
        child: The tree of the called mission, built on the called keys.
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
        child: Behaviour,
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
        """The status of the called mission; on success its outputs are copied."""
        if self.decorated.status is Status.SUCCESS:
            try:
                for output, key in self._outputs.items():
                    self._context.keys.write(key, self.called_keys.read(output))
            except ValueProblem as error:
                self.result = error.as_result()
                self.feedback_message = self.result.reason
                return Status.FAILURE
        return self.decorated.status
