"""Search for a person who vanished: look at who walks, and where they may be. No ROS, no clock of its own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2, normalize_angle
from florence_bt.core.outcome import failure, success
from florence_bt.skills.filters.legs.leg_detector import all_legs, of_nobody_known
from florence_bt.skills.filters.legs.walking_legs import WalkingLegs
from florence_bt.skills.navigation.navigate.costmap import moved_points
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.person_goal import PersonGoal
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.map_difference import MapDifference
from florence_bt.skills.navigation.navigate.person_belief import PersonBelief
from florence_bt.skills.navigation.navigate.state import CycleState

_FACING_RAD = 0.3
_FAR_M, _RECENT_S = 3.5, 0.3
"""It turns to legs that walk, no further away, and in a scan no older than this."""
_VIEW_RAD, _UNCLEAR_S = 0.35, 1.5
"""Whom the camera does not know so near to the middle of its picture for so long is somebody else."""
_SAME_M = 0.3
"""Legs that are so far from those of the cycle before are those of another one."""
_WORTH_LOOKING = 0.03, 0.06, 0.12
"""It turns to look when so much of what is likely would get into the picture, at the first look, the second
and so on; else, and after so many looks from one place, it drives on."""
_SAME_PLACE_M = 0.5
_CHOICE_S = 2.5
"""Least time that it stays with a place to drive to."""
_NO_WAY_S = 15.0
"""A search in which the robot cannot move for so long is over."""


class Search(PersonGoal):
    """Drives and turns to where a person may be who was followed and lost, until they are seen."""

    def __init__(self, task: FollowTask, now: float) -> None:
        super().__init__(task, now)
        self._unmapped = MapDifference(task.costmaps)
        self._belief: PersonBelief | None = None
        self._heading: float | None = None
        self._goal_place: Point2 | None = None
        self._looks, self._looked_from = 0, Pose2(math.inf, math.inf)
        self._next_choice = now
        self._legs: list[Point2] = []
        self._walking = WalkingLegs()
        self._scanned = -math.inf
        self._looks_at: Point2 = (math.inf, math.inf)
        self._looks_at_since: float | None = None

    def saw_scan(
        self, stamp: float, points: NDArray[np.float64], robot: Pose2, map_from_odom: Pose2 | None
    ) -> None:
        """Look for legs in a scan of the laser, beside what the map knows."""
        if map_from_odom is None:
            return
        known = self._unmapped.is_known(moved_points(points, map_from_odom))
        self.saw_legs(stamp, all_legs(points[~known]))

    def saw_legs(self, stamp: float, legs: list[Point2]) -> None:
        """Note where the laser sees something like legs: seconds; odometry frame, metres."""
        self._scanned, self._legs = stamp, legs
        self._walking.saw(stamp, legs)

    def _choose(self, state: CycleState) -> Move:
        track = self._task.track
        if track.seen is None:
            reason = f"person {self.user_id} was not followed lately: nobody knows where they vanished"
            return Move(STANDSTILL, "lost", failure("user_lost", reason))
        if track.is_seen(state.now):
            return Move(STANDSTILL, "the person is seen", success())
        if state.now - self._moved > _NO_WAY_S:
            reason = f"the robot could not move for {_NO_WAY_S:g} s, and sees nobody from where it is"
            return Move(STANDSTILL, "lost", failure("user_lost", reason))
        look = self._look_at_who_walks(state)
        if look is not None:
            return Move(look, "looking at who walks")
        return Move(self._look_where_likely(state, track.seen), "looking for the person")

    def _look_at_who_walks(self, state: CycleState) -> Twist2 | None:
        """Turn to the nearest legs that walk, until the camera sees who it is; None when there are none."""
        here = state.pose.x, state.pose.y
        legs = [
            each
            for each in of_nobody_known(self._walking.places(self._scanned), state.people.places)
            if math.dist(each, here) < _FAR_M
        ]
        if not legs or state.now - self._scanned > _RECENT_S:
            self._looks_at_since = None
            return None
        nearest = min(legs, key=lambda each: math.dist(each, here))
        bearing = state.pose.bearing_to(*nearest)
        if math.dist(nearest, self._looks_at) > _SAME_M:
            self._looks_at_since = None
        self._looks_at = nearest
        if abs(bearing) < _VIEW_RAD:
            self._looks_at_since = self._looks_at_since or state.now
            if state.now - self._looks_at_since > _UNCLEAR_S:
                self._walking.reject(nearest)
                self._looks_at_since = None
        turn = self._task.motions.turning_speed(bearing)
        if self._task.motions.is_free_turn(state.clearance, 0.0, turn, bearing):
            return Twist2(0.0, turn)
        self._walking.reject(nearest)
        return None

    def _look_where_likely(self, state: CycleState, vanished: float) -> Twist2:
        """Turn to where they may be; drive there when that cannot be seen from here."""
        robot, track = state.map_pose, self._task.track
        if self._belief is None:
            in_map = state.map_from_odom.apply(*track.last)
            velocity = Pose2(0.0, 0.0, state.map_from_odom.yaw).apply(*track.velocity)
            self._belief = PersonBelief(self._task.costmaps, in_map, velocity, vanished)
        legs = [state.map_from_odom.apply(*each) for each in self._legs]
        self._belief.update(state.now, robot, legs)
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

    def _choose_place(self, state: CycleState, belief: PersonBelief) -> None:
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
