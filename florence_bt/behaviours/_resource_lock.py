"""The lock of a skill on what it needs for itself: it starts when no other skill of the run holds that."""

from __future__ import annotations

from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.context import TreeContext
from florence_bt.core.outcome import Result, failure


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
        """Whether the skill may start now; else its resources are waited for."""
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
