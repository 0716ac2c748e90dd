"""The person is in sight: keep the distance, straight, along their way, or round what is in the way."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL
from florence_bt.core.outcome import failure
from florence_bt.skills.navigation.navigate.following.distance_law import speed_along, velocity_straight
from florence_bt.skills.navigation.navigate.following.give_way import GiveWay
from florence_bt.skills.navigation.navigate.following.line_of_sight import is_in_sight, is_line_free
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.trail_follower import TrailFollower
from florence_bt.skills.navigation.navigate.state import CycleState

_BEFORE_RAD = 1.0
"""Angle beyond which a person does not come towards the robot: they walk past it."""
_BLOCKED_S = 20.0
"""The person is in sight, but there is no way to them for so long."""


class KeepDistance:
    """Keeps the distance to somebody who is in sight."""

    def __init__(
        self,
        task: FollowTask,
        trail_follower: TrailFollower,
        path_follower: PathFollower,
        give_way: GiveWay,
        now: float,
    ) -> None:
        self._task = task
        self._trail_follower = trail_follower
        self._path_follower = path_follower
        self._give_way = give_way
        self._free_since = now

    def step(self, state: CycleState) -> Move:
        """Decide what to do; fail when nothing has led to the person for long."""
        x, y = self._task.track.at(state.now)
        distance, bearing = math.hypot(x - state.pose.x, y - state.pose.y), state.pose.bearing_to(x, y)
        move = self._without_a_path(state, distance, bearing)
        if move is not None:
            self._path_follower.forget()
            self._free_since = state.now
            return move
        return self._round_obstacles(state, bearing)

    def _without_a_path(self, state: CycleState, distance: float, bearing: float) -> Move | None:
        """Return the first possible move that needs no planned path; None when there is none."""
        person, wanted = self._task.track.at(state.now), self._task.goal.distance
        if self._give_way.is_too_near(state, distance, bearing):
            if abs(bearing) < _BEFORE_RAD:
                return Move(self._give_way.back_off(state, person, bearing), "giving way")
            self._give_way.nobody_is_too_near()
            return Move(self._task.motions.turn_towards(state, bearing), "following")
        self._give_way.nobody_is_too_near()
        self._give_way.let_pass(state, person, distance)
        command = velocity_straight(self._task, state.pose, distance, bearing)
        free = is_line_free(self._task, state, person, person, self._trail_follower.narrow)
        if free and self._task.motions.is_free(state, command):
            return Move(command, "following")
        walk, _ = self._trail_follower.drive(state, person, wanted)
        if walk is not None:
            return Move(walk, "following along the person's path")
        near = distance <= wanted + self._task.params.follow_give_way
        if near and is_in_sight(self._task, state, person):
            return Move(self._task.motions.turn_towards(state, bearing), "following")
        return None

    def _round_obstacles(self, state: CycleState, bearing: float) -> Move:
        command, remaining = self._path_follower.drive(state, self._task.track.at(state.now))
        speed = speed_along(self._task, state.pose, remaining, bearing)
        if speed <= 0.0:
            return Move(self._task.motions.turn_towards(state, bearing), "following")
        if not command.is_zero():
            self._free_since = state.now
        elif state.now - self._free_since > _BLOCKED_S:
            reason = f"{self._path_follower.trouble or 'something is in the way'}, for {_BLOCKED_S:g} s"
            result = failure("blocked", reason)
            return Move(STANDSTILL, reason, result)
        return Move(command.slowed_to(speed), "following, round what is in the way")
