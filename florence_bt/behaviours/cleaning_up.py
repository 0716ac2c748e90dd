"""Clean-ups: a node that always cleans up, and the clean-up that goes on beside the tree after a stop."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.branch import take_ids
from florence_bt.behaviours.context import OpenRun, TreeContext
from florence_bt.behaviours.skipping import was_skipped
from florence_bt.behaviours.stepping import Stepping, Steps
from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.watching import Spot
from florence_bt.behaviours.why import explain, path_of
from florence_bt.core.outcome import Result, failure, success

CLEANUP = "finally"
"""The name under which a clean-up beside the tree appears among the runs and in the journal."""


class Finally(Stepping):
    """Runs a body, then a clean-up, and ends with the status of the body.

    The clean-up also runs when the body is stopped from outside: then it goes on beside the tree, as one of
    the context's open runs, until it is done. A clean-up that is stopped itself goes on there where it was.
    Its own failure changes nothing; the dump shows it.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        body: What is done.
        make_cleanup: Builds the tree of the clean-up; each one that goes on beside the tree needs another.
        spot: Where it stands in a condition that is watched, or None: it does not clean up again where the
            body only replays what it has done.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        body: Behaviour,
        make_cleanup: Callable[[TreeContext], Behaviour],
        spot: Spot | None = None,
    ) -> None:
        self._context = context
        self._spot = spot
        self._make_cleanup = make_cleanup
        self._body = body
        self._cleanup = make_cleanup(context)
        self._beside: Behaviour | None = None
        super().__init__(name, [body, self._cleanup])

    @property
    def shown(self) -> tuple[Behaviour, Behaviour]:
        """The body and the clean-up for a dump: the one beside the tree, when there was one."""
        return self._body, self._beside or self._cleanup

    @property
    def skipped(self) -> bool:
        """Tell whether the body was skipped."""
        return was_skipped(self._body)

    def steps(self) -> Steps:
        """Tick the body until it is done, then the clean-up."""
        if self.status is not Status.RUNNING:
            self.halt_all()
            self._beside = None
            self.current_child = self._body
        if self.current_child is self._body:
            yield self._body
            if self._body.status is Status.RUNNING:
                return Status.RUNNING
            if self._spot is not None and self._spot.recall():
                return self._body.status
            self.current_child = self._cleanup
        yield self._cleanup
        if self._cleanup.status is Status.RUNNING:
            return Status.RUNNING
        if self._spot is not None:
            self._spot.keep(True)
        self.current_child = self._body
        return self._body.status

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Stop; when that interrupts the body or the clean-up, clean up beside the tree."""
        interrupted = new_status is Status.INVALID and self.status is Status.RUNNING
        tree = self._cleanup_for_beside() if interrupted else None
        super().stop(new_status)
        if tree is not None:
            self._beside = tree
            CleanupRun(self, self._context, tree).begin()

    def _cleanup_for_beside(self) -> Behaviour:
        """Return the tree of the clean-up that goes on when this node is stopped."""
        fresh = self._make_cleanup(self._context)
        if self.current_child is not self._cleanup:
            return fresh
        # What goes on is no part of the tree any more; a fresh one takes its place, which can begin again.
        begun, self._cleanup = self._cleanup, fresh
        take_ids(fresh, begun)
        fresh.parent, self.children[1] = self, fresh
        return begun


class CleanupRun:
    """A clean-up that goes on beside the tree, seen as a run.

    Args:
        owner: The node whose clean-up it is.
        context: What the tree shares.
        tree: The tree of the clean-up, which may have begun.
    """

    feedback = ""
    """Empty: no node shows it."""

    def __init__(self, owner: Behaviour, context: TreeContext, tree: Behaviour) -> None:
        self._context = context
        self.tree = tree
        self.tree.parent = owner
        self._ticker = Ticker(self.tree)
        self._result: Result | None = None
        self._entry: OpenRun | None = None

    def begin(self) -> None:
        """Tick it beside the tree for the first time; whoever ticks the tree goes on with it."""
        path = path_of(self.tree)
        self._context.on_skill_started(path, CLEANUP, {})
        self._entry = self._context.adopt(path, CLEANUP, self)
        self._context.beside.append(self)
        self.tick()

    def tick(self) -> None:
        """Tick the tree of the clean-up; at its end the run ends."""
        try:
            self._ticker.tick()
        except Exception as error:
            # A bug in a clean-up ends the clean-up, and not the mission.
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(where.filename).name}:{where.lineno}"
            self.break_off("internal_error", f"{type(error).__name__}: {error} (in {place})")
            return
        why = explain(self.tree)
        if why is not None:
            self._end(failure(why.code, why.reason))
        elif self.tree.status is Status.SUCCESS:
            self._end(success())

    def break_off(self, code: str, reason: str) -> None:
        """End with a failure; skills that the clean-up had started are cancelled."""
        for node in self.tree.iterate():
            if not node.children and node.status is Status.RUNNING:
                with suppress(Exception):  # the node that broke may break again
                    node.stop(Status.INVALID)
        self._end(failure(code, reason))

    def _end(self, result: Result) -> None:
        assert self._entry is not None
        self._result = result
        self._context.beside.remove(self)
        self._context.poll(self._entry)

    def poll(self) -> Result | None:
        """Return the result, None as long as it goes on."""
        return self._result

    def cancel(self) -> None:
        """Refuse on purpose: the deadlines of its skills end a clean-up."""

    def on_change(self, callback: Callable[[], None]) -> None:
        """Not needed: its nodes wake through the context."""
