"""A parallel that ends after a number of successes or of failures."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.stepping import Stepping, Steps
from florence_bt.behaviours.why import Why


class CountingParallel(Stepping):
    """Ticks all its branches; a branch that is done is not ticked again.

    It succeeds when enough branches have succeeded, and fails when too many have failed or when the successes
    are out of reach. When one tick brings both, it has succeeded. Its failure is that of the first child that
    has failed, in their order. At its end the branches that still run are stopped.

    Args:
        name: The name of the node in dumps.
        children: The branches.
        succeed: How many successes are enough, at least 1.
        fail: How many failures are too many; None: only the reach counts.
        wanted: The branches whose successes count; None: all.
    """

    def __init__(
        self,
        name: str,
        children: list[Behaviour],
        succeed: int,
        fail: int | None = None,
        wanted: Collection[Behaviour] | None = None,
    ) -> None:
        super().__init__(name, children)
        self.succeed = succeed
        self.fail = fail
        self.wanted = tuple(wanted) if wanted is not None else None

    def steps(self) -> Steps:
        """Tick every branch that is not done, then count."""
        if self.status is not Status.RUNNING:
            self.halt_all()
            self.current_child = None
            self.feedback_message = ""
            self.initialise()
        for child in self.children:
            if child.status in (Status.INVALID, Status.RUNNING):
                yield child
        return self._count()

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Stop the branches that still run."""
        self.halt_running()
        super().stop(new_status)

    def extend_reason(self, why: Why) -> Why:
        """Say how many branches failed, when it is not just one."""
        failed = sum(child.status is Status.FAILURE for child in self.children)
        if failed < 2:
            return why
        return replace(why, reason=f"{failed} of {len(self.children)} branches failed; first: {why.reason}")

    def _count(self) -> Status:
        wanted = self.children if self.wanted is None else self.wanted
        succeeded = [child for child in wanted if child.status is Status.SUCCESS]
        failed = [child for child in self.children if child.status is Status.FAILURE]
        if len(succeeded) >= self.succeed:
            self.current_child = succeeded[-1]
            return Status.SUCCESS
        lost = sum(child.status is Status.FAILURE for child in wanted)
        out_of_reach = len(wanted) - lost < self.succeed
        if out_of_reach or (self.fail is not None and len(failed) >= self.fail):
            self.current_child = failed[0] if failed else None
            return Status.FAILURE
        self.current_child = self.children[-1]
        return Status.RUNNING
