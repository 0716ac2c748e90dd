"""What makes the robot safe without a mission: at a manual override, and first of all after a crash."""

from __future__ import annotations

from typing import Protocol

from florence_bt.core.skill import SkillRun


class Safety(Protocol):
    """Stops what drives the robot, whoever asked for it."""

    def stop_now(self) -> None:
        """Tell everything that moves the robot to stop; waits for nothing."""

    def make_safe(self) -> SkillRun:
        """As :meth:`stop_now`, as a run that succeeds when the robot is known to stand still.

        It ends within a bounded time in any case; a failure says what is not known.
        """
