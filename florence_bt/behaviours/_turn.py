"""The turn of a skill: it starts when no other skill of the run holds what it needs for itself."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.behaviours._alarm import Alarm
from florence_bt.behaviours.context import TreeContext
from florence_bt.core.outcome import Result, failure


class Turn:
    """Waits until a skill may start.

    The check refuses missions whose branches want one resource at the same time. What is left are the moments
    in which a skill was told to stop and has not stopped yet, and clean-ups beside the tree.

    Args:
        context: What the tree shares.
        skill: The skill that wants to start.
        touch: Called when it may have become possible, before the tick is asked for.
    """

    def __init__(self, context: TreeContext, skill: str, touch: Callable[[], None]) -> None:
        self.feedback = ""
        self._context = context
        self._skill = skill
        self._touch = touch
        self._alarm = Alarm(context, touch)
        self._waiting = False

    def come(self) -> bool:
        """Whether the skill may start now; else it is waited for."""
        holder = self._context.holder(self._skill)
        if holder is None:
            self.end()
            return True
        if not self._waiting:
            self._waiting = True
            self._context.waiting.append(self._on_free)
            self._alarm.set(self._context.declarations[self._skill].deadline_s)
        needs = sorted(holder.resources & self._context.declarations[self._skill].resources)
        self.feedback = f"waits for the {' and the '.join(needs)}, which {holder.skill} at {holder.path} has"
        return False

    @property
    def too_late(self) -> Result | None:
        """The failure when it has taken as long as the skill itself may take, else None."""
        if not self._alarm.passed:
            return None
        deadline = self._context.declarations[self._skill].deadline_s
        return failure(
            "timed_out", f"{self._skill} could not start within {deadline:g} s: it {self.feedback}"
        )

    def end(self) -> None:
        """Wait no more."""
        if self._waiting:
            self._waiting = False
            self._context.waiting.remove(self._on_free)
        self._alarm.clear()

    def _on_free(self) -> None:
        self._touch()
        self._context.wake()
