"""What makes the robot safe without a mission, first of all after a crash."""

from __future__ import annotations

from typing import Protocol

from florence_bt.core.skill import SkillRun


class Safety(Protocol):
    """Stops what drives the robot, whoever asked for it."""

    def make_safe(self) -> SkillRun:
        """Stop everything that moves the robot.

        Returns:
            A run that succeeds when the robot is known to stand still. It ends within a bounded time in any
            case; a failure says what is not known.
        """
