"""Composites: py_trees' own, with fresh children at each start, and one that always cleans up."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.composites import Selector as PyTreesSelector

from florence_bt.behaviours.context import OpenRun, TreeContext
from florence_bt.behaviours.why import explain, path_of
from florence_bt.core.outcome import Result, failure, success

CLEANUP = "finally"
"""The name under which a clean-up beside the tree appears among the runs and in the journal."""


class Selector(PyTreesSelector):
    """The selector of py_trees, whose children forget their statuses when it starts anew.

    (A stock selector keeps them, so a dump would show failures of an earlier round.)
    """

    def initialise(self) -> None:
        """Reset the children."""
        _reset(self.children)


class Finally(Composite):
    """Runs a body, then a clean-up, and ends with the status of the body.

    The clean-up also runs when the body is stopped from outside: then it goes on beside the tree, as one of
    the context's open runs, until it is done. Its own failure changes nothing; the dump shows it.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        body: What is done.
        make_cleanup: Builds the tree of the clean-up; each stop from outside needs a fresh one.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        body: Behaviour,
        make_cleanup: Callable[[TreeContext], Behaviour],
    ) -> None:
        self._context = context
        self._make_cleanup = make_cleanup
        self._body = body
        self._cleanup = make_cleanup(context)
        super().__init__(name, [body, self._cleanup])

    def tick(self) -> Iterator[Behaviour]:
        """Tick the body until it is done, then the clean-up."""
        if self.status is not Status.RUNNING:
            _reset(self.children)
            self.current_child = self._body
        if self.current_child is self._body:
            yield from self._body.tick()
            if self._body.status is Status.RUNNING:
                self.status = Status.RUNNING
                yield self
                return
            self.current_child = self._cleanup
        yield from self._cleanup.tick()
        if self._cleanup.status is Status.RUNNING:
            self.status = Status.RUNNING
        else:
            self.stop(self._body.status)
            self.current_child = self._body
        yield self

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Stop; when that interrupts the body or the clean-up, clean up beside the tree."""
        interrupted = new_status is Status.INVALID and self.status is Status.RUNNING
        super().stop(new_status)
        if interrupted:
            _CleanupRun(self, self._context, self._make_cleanup).begin()


class _CleanupRun:
    """A clean-up that goes on beside the tree, seen as a run; polling it ticks it."""

    def __init__(
        self, owner: Behaviour, context: TreeContext, make_cleanup: Callable[[TreeContext], Behaviour]
    ) -> None:
        self._context = context
        self._tree = make_cleanup(replace(context, wake=self._wake))
        self._tree.parent = owner
        self._result: Result | None = None
        self._entry: OpenRun | None = None

    def begin(self) -> None:
        path = path_of(self._tree)
        self._context.on_skill_started(path, CLEANUP, {})
        self._entry = self._context.adopt(path, CLEANUP, self)
        self._context.poll(self._entry)

    @property
    def feedback(self) -> str:
        tip = self._tree.tip()
        return tip.feedback_message if tip is not None else ""

    def poll(self) -> Result | None:
        if self._result is None:
            self._tree.tick_once()
            why = explain(self._tree)
            if why is not None:
                self._result = failure(why.code, why.reason)
            elif self._tree.status is Status.SUCCESS:
                self._result = success()
        return self._result

    def cancel(self) -> None:
        """Refused on purpose: the deadlines of its skills end a clean-up."""

    def on_change(self, callback: Callable[[], None]) -> None:
        """Not needed: its nodes wake through the context."""

    def _wake(self) -> None:
        # Deferred: a wake may come in the middle of this tree's own tick.
        self._context.clock.call_at(self._context.clock.now(), self._on_wake)

    def _on_wake(self) -> None:
        if self._entry is not None:
            self._context.poll(self._entry)
        self._context.wake()


def _reset(children: Iterable[Behaviour]) -> None:
    for child in children:
        if child.status is not Status.INVALID:
            child.stop(Status.INVALID)
