"""Backing off, best on the way on which the robot came: it is blind behind."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Twist2, normalize_angle
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.state import CycleState

_STEP_M = 0.1
"""A point of the way the robot came is so far from the next at least."""
_TO_M = 0.3
"""It steers towards a point of that way so far behind its middle."""
_STRAIGHT_RAD = 0.3
"""Further beside that point it turns first."""
_TURNS_BACK_RAD = 1.0
"""Further to the side it does not turn from who is given way to."""
_MPS, _BACK_OUT_S = 0.2, 1.0
"""Speed of backing out, and its longest time: somebody may be behind the robot, where it is blind."""
_AHEAD_S = 0.4, 1.0
"""A motion back must be free for so many seconds: slow, and where the robot has just been; or for as many as
it takes to get out of something that it touches in the costmap."""
_BEHIND_M, _CLOSE_BEHIND_M = 0.4, 0.6
"""It does not back off when somebody else was seen lately so near to a point so far behind it."""


class RetreatPath:
    """Remembers the way the robot came, and backs off on it."""

    def __init__(self, task: FollowTask) -> None:
        self._task = task
        self._trail = task.came
        self._until = -math.inf

    def remember(self, state: CycleState) -> None:
        """Take the robot's place of a cycle."""
        here = state.pose.x, state.pose.y
        forward = state.twist.linear > 0.0
        if forward and (not self._trail or math.dist(self._trail[-1], here) >= _STEP_M):
            self._trail.append(here)

    def begin(self, now: float) -> None:
        """Back out a little, from the next cycle on."""
        self._until = now + _BACK_OUT_S

    def back_out(self, state: CycleState) -> Twist2:
        """Return the velocity while the robot backs out, else standstill."""
        command = STANDSTILL
        if state.now < self._until:
            command = state.people.slowed(state.pose, self.back_off(state))
        if command.is_zero():
            self._until = -math.inf
        return command

    def back_off(self, state: CycleState, bearing: float = 0.0, speed: float = _MPS) -> Twist2:
        """Back off the way the robot came, or straight; standstill where there is no room.

        Args:
            state: Of this moment.
            bearing: Of the person who is given way to; the robot does not turn its back on them.
            speed: m/s, limited by ``follow_back_speed``.
        """
        trail, pose = self._trail, state.pose
        while trail and math.dist(trail[-1], (pose.x, pose.y)) < _TO_M:
            trail.pop()
        back = -min(speed, self._task.params.follow_back_speed)
        if back == 0.0 or self._is_somebody_behind(state):
            return STANDSTILL
        left = normalize_angle(pose.bearing_to(*trail[-1]) + math.pi) if trail else 0.0
        on_trail = bool(trail) and abs(normalize_angle(bearing - left)) <= _TURNS_BACK_RAD
        if not on_trail:
            left = 0.0
        turn = self._task.motions.turning_speed(left)
        straight = back if abs(left) < _STRAIGHT_RAD else 0.0
        # Where it came from is free, whatever the map knows there.
        costmap = self._task.costmaps.local_costmap
        come = Clearance(costmap, pose, None, None) if on_trail else state.clearance
        ways = (Twist2(straight, turn), come), (Twist2(0.0, turn), come), (Twist2(back, 0.0), state.clearance)
        for command, clearance in ways:
            if not command.is_zero() and any(
                clearance.is_free(command.linear * ahead, command.angular * ahead) for ahead in _AHEAD_S
            ):
                return command
        return STANDSTILL

    def _is_somebody_behind(self, state: CycleState) -> bool:
        """Tell whether somebody else was behind the robot a moment ago, where it is blind."""
        behind = state.pose.apply(-_BEHIND_M, 0.0)
        return any(
            math.dist(place, behind) <= _CLOSE_BEHIND_M
            for place in self._task.people.others(self._task.goal.user_id, state.now)
        )
