"""To where the person vanished: face it, and drive there along their way or a planned path."""

from __future__ import annotations

import math

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate.following.line_of_sight import PERSON_M, is_in_sight
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.trail_follower import TrailFollower
from florence_bt.skills.navigation.navigate.state import CycleState
from florence_bt.skills.navigation.navigate.vacated_cells import clear_person

_NO_NEARER_S, _NEARER_M = 5.0, 0.1
"""The robot goes on while it comes so much nearer at least so often, a half turn included."""
_ARRIVED_M = 0.4
"""It is there when it is so near to the place."""
_FACING_RAD = 0.3
"""Bearing at which the robot faces the place of somebody who vanished. Chosen."""
_VIEW_RAD, _VIEW_M = 0.35, (0.9, 3.5)
"""Somebody no further beside the middle of the camera's picture, and so far away, is seen whole."""


class Vanished:
    """Drives to where the person vanished."""

    def __init__(
        self, task: FollowTask, trail_follower: TrailFollower, path_follower: PathFollower, now: float
    ) -> None:
        self._task = task
        self._trail_follower = trail_follower
        self._path_follower = path_follower
        self._faced = False
        self._way_left, self._nearer_at = math.inf, now

    def clear_marks(self, state: CycleState) -> None:
        """Clear what the camera has marked where they walked last: it was they. If they still stand there,
        the laser sees their legs.
        """
        for place in self._task.track.path.last(PERSON_M):
            clear_person(self._task.costmaps, place, state.map_from_odom.apply(*place))

    def step(self, state: CycleState, unseen: float) -> Move | None:
        """Decide what to do; None when there without seeing the person, or when it cannot get there."""
        expected = self._task.track.at(state.now)
        bearing = state.pose.bearing_to(*expected)
        self._faced = (
            self._faced or abs(bearing) < _FACING_RAD or not is_in_sight(self._task, state, expected)
        )
        if not self._faced and unseen <= self._task.params.follow_patience:
            # They may just have walked out of the picture.
            return Move(self._task.motions.turn_towards(state, bearing), "turning after the person")
        place = self._task.track.last
        if math.dist(place, (state.pose.x, state.pose.y)) > _ARRIVED_M:
            walk, left = self._trail_follower.drive(state, place, 0.0)
            if walk is not None and self._gets_nearer(state.now, left):
                return Move(walk, "going along the person's path")
        command, remaining = self._path_follower.drive(state, place)
        if remaining <= _ARRIVED_M or self._is_there(state, place):
            return None
        gets_nearer = self._gets_nearer(state.now, remaining)
        goes = gets_nearer and (not command.is_zero() or unseen <= self._task.params.follow_patience)
        return Move(command, "going to where the person was seen last") if goes else None

    def _gets_nearer(self, now: float, left: float) -> bool:
        """Tell whether the robot comes nearer to where they vanished, which is some metres away from it."""
        if left < self._way_left - _NEARER_M:
            self._way_left, self._nearer_at = left, now
        return now - self._nearer_at <= _NO_NEARER_S

    def _is_there(self, state: CycleState, place: Point2) -> bool:
        """Tell whether the robot is where they vanished, or would see them there: they have walked on."""
        away = math.dist(place, (state.pose.x, state.pose.y))
        in_picture = abs(state.pose.bearing_to(*place)) < _VIEW_RAD and _VIEW_M[0] < away < _VIEW_M[1]
        return away <= _ARRIVED_M or (in_picture and is_in_sight(self._task, state, place))
