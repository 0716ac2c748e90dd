"""One drive along a path that somebody else has planned: no other path, no recovery (Nav2's FollowPath)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.navigation.navigate.controller import Controller
from florence_bt.skills.navigation.navigate.drive import TYPICAL_SPEED
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.recovery import ProgressWatch
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState, Feedback


class PathDrive(NavigationGoal):
    """A drive along a path, from the start of the drive to its result.

    Args:
        path: Shape (n, 2), metres in the map frame.
        goal: The last pose.
        costmaps: Where the robot drives.
        parameters: All of navigation.
        now: Seconds.

    Attributes:
        path: The path.
    """

    path: NDArray[np.float64] | None = None

    def __init__(
        self,
        path: NDArray[np.float64],
        goal: Pose2,
        costmaps: Costmaps,
        parameters: NavigatorParameters,
        now: float,
    ) -> None:
        self.path = path
        self._goal = goal
        self._costmaps = costmaps
        self._patience = parameters.recovery.controller_patience
        self._controller = Controller(parameters.controller)
        self._controller.set_plan(path, goal)
        self._progress = ProgressWatch(parameters.recovery)
        self._progress.reset(now)
        self._last_control = now

    def resume(self, now: float) -> None:
        """Go on after the robot did not know where it was: nothing of before counts as lost time."""
        self._progress.reset(now)
        self._last_control = now

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the drive is over."""
        odom_from_map = state.map_from_odom.inverse()
        people = state.people.around_goal(odom_from_map @ self._goal)
        control = self._controller.control(
            state.pose, state.twist, self._costmaps.local_costmap, odom_from_map, state.clearance, people
        )
        text = control.text or f"waiting: {control.blocked}"
        feedback = Feedback(control.remaining, control.remaining / TYPICAL_SPEED, 0, text)
        if control.reached:
            return STANDSTILL, feedback, success()
        if state.stop.holds_forward:
            return STANDSTILL, feedback, state.stop.failure()
        if not control.blocked:
            self._last_control = state.now
            problem = self._progress.problem(state.now, state.pose, control.remaining)
            return control.command, feedback, failure("no_progress", problem) if problem else None
        if state.now - self._last_control > self._patience:
            return STANDSTILL, feedback, failure("blocked", control.blocked)
        return STANDSTILL, feedback, None
