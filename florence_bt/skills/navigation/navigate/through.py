"""One drive past several poses to the last one (Nav2's NavigateThroughPoses)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.drive import TYPICAL_SPEED, Drive
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState, Feedback

PASSED_M = 0.7
"""A pose on the way counts as passed from so far away, along the path (Nav2: RemovePassedGoals)."""


class ThroughDrive(NavigationGoal):
    """A drive to each pose in turn, without a stop at those on the way.

    Args:
        goals: At least one; in the map frame.
        costmaps: Where the robot drives.
        parameters: All of navigation.
        now: Seconds.
    """

    def __init__(
        self, goals: Sequence[Pose2], costmaps: Costmaps, parameters: NavigatorParameters, now: float
    ) -> None:
        self._goals = list(goals)
        self._costmaps = costmaps
        self._p = parameters
        self._recoveries = 0
        self._drive = Drive(goals[0], costmaps, parameters, now)

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path to the next pose, shape (n, 2) in the map frame, or None."""
        return self._drive.path

    def resume(self, now: float) -> None:
        """Go on after the robot did not know where it was."""
        self._drive.resume(now)

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the drive is over."""
        command, feedback, result = self._drive.step(state)
        while len(self._goals) > 1 and self._is_passed(result):
            self._goals.pop(0)
            self._recoveries += feedback.recoveries
            self._drive = Drive(self._goals[0], self._costmaps, self._p, state.now)
            # It plans in this cycle: the robot does not stop.
            command, feedback, result = self._drive.step(state)
        after = sum(one.distance_to(two) for one, two in zip(self._goals, self._goals[1:], strict=False))
        total = replace(
            feedback,
            distance_remaining=feedback.distance_remaining + after,
            time_remaining=feedback.time_remaining + after / TYPICAL_SPEED,
            recoveries=feedback.recoveries + self._recoveries,
            poses_remaining=len(self._goals),
        )
        return command, total, result

    def _is_passed(self, result: Result | None) -> bool:
        if result is not None:
            return result.succeeded
        return self._drive.path is not None and self._drive.remaining <= PASSED_M
