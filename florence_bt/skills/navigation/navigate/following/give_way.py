"""Giving way: back off from who comes nearer, and step aside for who waits for the robot to let them past."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Point2, Twist2
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.retreat_path import RetreatPath
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.state import CycleState
from florence_bt.skills.navigation.navigate.step_aside import place_to_step_aside

_TOWARDS, _CAME_S = 0.7, 1.0
"""Somebody comes towards the robot who walks no further beside it than this cosine, up to so long ago."""
_ASIDE_AFTER_S, _ASIDE_S, _ASIDE_MORE_M = 2.0, 15.0, 0.3
"""Without a way back for so long, the robot drives to where it can be passed: for how long at most, and how
much further away than it follows."""
_ARRIVED_M = 0.1
_WAITS_S, _STAYS_M = 6.0, 0.25
"""Time that somebody stands before the robot, and the way that they go at most, when they wait for it to let
them pass."""


class GiveWay:
    """Lets people pass."""

    def __init__(self, task: FollowTask, retreat_path: RetreatPath, path_follower: PathFollower) -> None:
        self._task = task
        self._retreat_path = retreat_path
        self._path_follower = path_follower
        self._came_at = -math.inf
        self._waits: tuple[Point2, float] | None = None
        self._cornered_since: float | None = None
        self._aside: tuple[Point2, Point2, float] | None = None

    @property
    def steps_aside(self) -> bool:
        """Tell whether the robot drives to where it can be passed."""
        return self._aside is not None

    def is_too_near(self, state: CycleState, distance: float, bearing: float) -> bool:
        """Tell whether the person is nearer than wanted; one who does not come may be a little nearer."""
        track = self._task.track
        comes = track.walks and track.walks_away(state.pose, bearing) < -_TOWARDS * track.speed
        if comes:
            self._came_at = state.now
        return distance < self._task.goal.distance - (0.0 if comes else self._task.params.follow_give_way)

    def back_off(self, state: CycleState, person: Point2, bearing: float) -> Twist2:
        """Back off as far as there is room, else face the person. Who stands there for long wants to pass."""
        self._waits = person, state.now
        too_near = self._task.goal.distance - math.dist(person, (state.pose.x, state.pose.y))
        comes = max(0.0, -self._task.track.walks_away(state.pose, bearing))
        speed = comes + self._task.params.follow_linear_gain * too_near
        command = self._retreat_path.back_off(state, bearing, speed)
        self._note_way_back(state, person, backing=command.linear != 0.0)
        return self._task.motions.turn_towards(state, bearing) if command.is_zero() else command

    def nobody_is_too_near(self) -> None:
        """Note that there is nobody before the robot to give way to."""
        self._cornered_since = None

    def let_pass(self, state: CycleState, person: Point2, distance: float) -> None:
        """Step aside for who came too near and waits at one place, nearer than wanted, for long."""
        if self._waits is None or distance >= self._task.goal.distance:
            self._waits = None
            return
        place, since = self._waits
        if math.dist(person, place) > _STAYS_M:
            self._waits = person, state.now
        elif state.now - since > _WAITS_S:
            self._waits = person, state.now
            self._begin_to_step_aside(state, person)

    def step_aside(self, state: CycleState) -> Twist2:
        """Drive to where the robot can be passed; who is not seen then has gone through where it stood."""
        assert self._aside is not None
        stood, place, deadline = self._aside
        person = self._task.track.at(state.now)
        there = state.map_from_odom.inverse().apply(*place)
        command, remaining = self._path_follower.drive(state, there, person)
        far = math.dist(person, (state.pose.x, state.pose.y)) > self._task.goal.distance + _ASIDE_MORE_M
        if far or state.now > deadline or remaining <= _ARRIVED_M or self._path_follower.path is None:
            self._aside = None
            self._path_follower.forget()
            if not self._task.track.is_seen(state.now):
                self._task.track.suppose(state.now, stood)
            return STANDSTILL
        return command

    def _note_way_back(self, state: CycleState, person: Point2, *, backing: bool) -> None:
        """Look for a place to step aside to when there is no way back for long."""
        walks_past = self._task.track.walks and self._came_at < state.now
        if backing or walks_past or self._cornered_since is None:
            self._cornered_since = None if backing or walks_past else state.now
            return
        came = self._came_at > self._cornered_since - _CAME_S
        if state.now - self._cornered_since > (_ASIDE_AFTER_S if came else _WAITS_S):
            self._cornered_since = state.now
            self._begin_to_step_aside(state, person)

    def _begin_to_step_aside(self, state: CycleState, person: Point2) -> None:
        apart = self._task.goal.distance + _ASIDE_MORE_M
        in_map = state.map_from_odom.apply(*person)
        place = place_to_step_aside(self._task.costmaps, state.map_pose, in_map, apart)
        if place is not None:
            self._aside = (state.pose.x, state.pose.y), place, state.now + _ASIDE_S
            self._path_follower.plan_anew()
