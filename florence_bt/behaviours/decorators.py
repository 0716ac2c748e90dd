"""What the decorators here have in common, the two that change a status, and the call of another mission."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.keys import KeyStore, MissingKey, resolve
from florence_bt.core.declaration import Port
from florence_bt.core.outcome import Result, failure


class PreparedDecorator(Decorator):
    """A decorator that looks up what it needs before its child begins, and fails when it cannot.

    The child is not ticked at all when :meth:`prepare` finds a problem.
    """

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child)
        self.result: Result | None = None

    def prepare(self) -> Result | None:
        """Look up what is needed for a new round; the failure when something is wrong."""
        return None

    def tick(self) -> Iterator[Behaviour]:
        """Prepare, then tick as every decorator does."""
        if self.status is not Status.RUNNING:
            self.feedback_message = ""
            try:
                self.result = self.prepare()
            except MissingKey as error:
                self.result = error.as_result()
            if self.result is not None:
                self.feedback_message = self.result.reason
                self.stop(Status.FAILURE)
                yield self
                return
        yield from super().tick()


class Invert(PreparedDecorator):
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


class ForceSuccess(Decorator):
    """Succeeds when its child is done, whichever way."""

    def update(self) -> Status:
        """RUNNING as long as the child is, then SUCCESS."""
        return Status.RUNNING if self.decorated.status is Status.RUNNING else Status.SUCCESS


class CallMission(PreparedDecorator):
    """Runs the tree of another mission with keys of its own.

    Args:
        name: The name of the node in dumps.
        child: The tree of the called mission, built on the called keys.
        context: The context of the caller.
        called_keys: The keys of the called mission.
        ports: The inputs that the called mission declares.
        inputs: Values or value sources (in the caller's keys) by input.
        outputs: Output of the called mission -> key of the caller.
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
    ) -> None:
        super().__init__(name, child)
        self._context = context
        self._called_keys = called_keys
        self._ports = ports
        self._inputs = dict(inputs)
        self._outputs = dict(outputs)

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
        self._called_keys.reset(values)
        return None

    def update(self) -> Status:
        """The status of the called mission; on success its outputs are copied."""
        if self.decorated.status is Status.SUCCESS:
            try:
                for output, key in self._outputs.items():
                    self._context.keys.write(key, self._called_keys.read(output))
            except MissingKey as error:
                self.result = error.as_result()
                self.feedback_message = self.result.reason
                return Status.FAILURE
        return self.decorated.status
