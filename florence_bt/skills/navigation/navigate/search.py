"""Search for a person who vanished: look and drive where they may be. No ROS, no clock of its own."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2, normalize_angle
from florence_bt.core.outcome import failure, success
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.person_goal import PersonGoal
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.person_belief import PersonBelief
from florence_bt.skills.navigation.navigate.state import RobotState

_FACING_RAD = 0.3
_WORTH_LOOKING = 0.03, 0.06, 0.12
"""It turns to look when so much of what is likely would get into the picture, at the first look, the second
and so on; else, and after so many looks from one place, it drives on."""
_SAME_PLACE_M = 0.5
_CHOICE_S = 2.5
"""How long it stays with a place to drive to, at least."""
_NO_WAY_S = 15.0
"""A search in which the robot cannot move for so long is over."""


class Search(PersonGoal):
    """Drives and turns to where a person may be who was followed and lost, until they are seen."""

    def __init__(self, task: FollowTask, now: float) -> None:
        super().__init__(task, now)
        self._belief: PersonBelief | None = None
        self._heading: float | None = None
        self._goal_place: Point2 | None = None
        self._looks, self._looked_from = 0, Pose2(math.inf, math.inf)
        self._next_choice = now
        self._legs: list[Point2] = []

    def saw_legs(self, legs: list[Point2]) -> None:
        """Note where the laser sees something like legs, map frame, metres."""
        self._legs = legs

    def _choose(self, state: RobotState) -> Move:
        track = self._task.track
        if track.seen is None:
            reason = f"person {self.user_id} was not followed lately: nobody knows where they vanished"
            return Move(STANDSTILL, "lost", failure("user_lost", reason))
        if track.is_seen(state.now):
            return Move(STANDSTILL, "the person is seen", success())
        if state.now - self._moved > _NO_WAY_S:
            reason = f"the robot could not move for {_NO_WAY_S:g} s, and sees nobody from where it is"
            return Move(STANDSTILL, "lost", failure("user_lost", reason))
        return Move(self._look_where_likely(state, track.seen), "looking for the person")

    def _look_where_likely(self, state: RobotState, vanished: float) -> Twist2:
        """Turn to where they may be; drive there when that cannot be seen from here."""
        robot, track = state.map_pose, self._task.track
        if self._belief is None:
            in_map = state.map_from_odom.apply(*track.last)
            velocity = Pose2(0.0, 0.0, state.map_from_odom.yaw).apply(*track.velocity)
            self._belief = PersonBelief(self._task.costmaps, in_map, velocity, vanished)
        self._belief.update(state.now, robot, self._legs)
        if self._heading is None and state.now >= self._next_choice:
            if self._goal_place is not None and self._path_follower.path is None:
                self._belief.no_way_to(self._goal_place)
            self._choose_place(state, self._belief)
        if self._heading is not None:
            left = normalize_angle(self._heading - robot.yaw)
            if abs(left) > _FACING_RAD / 2.0:
                turn = self._task.motions.turn_towards(state, left)
                if turn.is_zero():
                    # It cannot be looked at from here: make room, and drive on.
                    self._heading, self._looks = None, len(_WORTH_LOOKING)
                    self._next_choice = state.now
                    self._retreat_path.begin(state.now)
                return turn
            self._heading = None
        if self._goal_place is None:
            return STANDSTILL
        command, _ = self._path_follower.drive(state, state.map_from_odom.inverse().apply(*self._goal_place))
        return command

    def _choose_place(self, state: RobotState, belief: PersonBelief) -> None:
        """Choose between a heading to look in and a place to drive to."""
        self._next_choice = state.now + _CHOICE_S
        robot = state.map_pose
        heading, share = belief.best_view(robot)
        place = belief.best_place(robot)
        beside = abs(normalize_angle(heading - robot.yaw)) > _FACING_RAD
        if robot.distance_to(self._looked_from) > _SAME_PLACE_M:
            self._looks, self._looked_from = 0, robot
        worth = _WORTH_LOOKING[self._looks] if self._looks < len(_WORTH_LOOKING) else math.inf
        if place is None or (share >= worth and beside):
            self._heading, self._goal_place = heading, None
            self._looks += 1
        else:
            self._goal_place = place
            self._path_follower.plan_anew()
