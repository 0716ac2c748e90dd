"""The search for who vanished: at who walks, at what may be their legs, and where they most likely are."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2, normalize_angle
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.retreat_path import RetreatPath
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.track import UNCLEAR_S, VIEW_M
from florence_bt.skills.navigation.navigate.legs import all_legs, of_nobody_known
from florence_bt.skills.navigation.navigate.moving_target import CAMERA_GAP_S
from florence_bt.skills.navigation.navigate.nearby_legs import TOO_NEAR_M, VIEW_RAD, NearbyLegs
from florence_bt.skills.navigation.navigate.person_belief import PersonBelief
from florence_bt.skills.navigation.navigate.state import RobotState

_FACING_RAD = 0.3
_LOOK_RADPS = 0.6
"""How fast the robot turns at last."""
_WORTH_LOOKING = 0.03, 0.06, 0.12
"""It turns to look when so much of what is likely would get into the picture, at the first look, the second
and so on; else, and after so many looks from one place, it drives on."""
_SAME_PLACE_M = 0.5
_CHOICE_S = 2.5
"""How long it stays with a place to drive to, at least."""


class Search:
    """Looks for the person from when the robot does not know any more where they are."""

    def __init__(
        self, task: FollowTask, path_follower: PathFollower, retreat_path: RetreatPath, state: RobotState
    ) -> None:
        self._task = task
        self._path_follower = path_follower
        self._retreat_path = retreat_path
        track = task.track
        assert track.seen is not None
        in_map = state.map_from_odom.apply(*track.last)
        velocity = Pose2(0.0, 0.0, state.map_from_odom.yaw).apply(*track.velocity)
        self._belief = PersonBelief(task.costmaps, in_map, velocity, track.seen)
        self._nearby = NearbyLegs(track.things.places())
        self._made_room = False
        self._looks_at_since: float | None = None
        self._heading: float | None = None
        self._goal_place: Point2 | None = None
        self._looks, self._looked_from = 0, state.map_pose
        self._next_choice = state.now

    def step(self, state: RobotState) -> Move:
        """Decide what to do."""
        look = self._look_at_who_walks(state)
        if look is not None:
            return Move(look, "looking at who walks")
        if self._heading is None and (self._looks > 0 or self._goal_place is not None):
            # They are most likely ahead; but they may be right beside the robot, too.
            look = self._look_at_legs(state)
            if look is not None:
                return Move(look, "looking at what may be the person")
        return Move(self._look_where_likely(state), "looking for the person")

    def _look_at_who_walks(self, state: RobotState) -> Twist2 | None:
        """Turn to the nearest legs that walk, until the camera sees who it is; None when there are none."""
        here, walking = (state.pose.x, state.pose.y), self._task.track.walking
        legs = [
            each
            for each in of_nobody_known(walking.places(self._task.track.scanned), state.people.places)
            if math.dist(each, here) < VIEW_M[1]
        ]
        if not legs or state.now - self._task.track.scanned > CAMERA_GAP_S:
            self._looks_at_since = None
            return None
        nearest = min(legs, key=lambda each: math.dist(each, here))
        bearing = state.pose.bearing_to(*nearest)
        if abs(bearing) < VIEW_RAD:
            self._looks_at_since = self._looks_at_since or state.now
            if state.now - self._looks_at_since > UNCLEAR_S:
                walking.reject(nearest)
                self._looks_at_since = None
        turn = self._task.motions.turning_speed(bearing)
        if self._task.motions.is_free_turn(state.clearance, 0.0, turn, bearing):
            return Twist2(0.0, turn)
        walking.reject(nearest)
        return None

    def _look_at_legs(self, state: RobotState) -> Twist2 | None:
        """Turn to what may be the person's legs nearby, and back off when they are too near to be seen."""
        before = self._nearby.since
        unknown = of_nobody_known(all_legs(self._task.track.unknown), state.people.places)
        legs = self._nearby.next(state.now, state.pose, unknown)
        if self._nearby.since != before:
            self._task.motions.begin_to_turn_round()
        if legs is None:
            return None
        bearing = state.pose.bearing_to(*legs)
        if abs(bearing) > _FACING_RAD:
            turn = self._task.motions.turn_round(state, bearing, self._task.goal.max_angular)
            if turn.is_zero():
                self._nearby.leave()
            return turn
        if math.dist(legs, (state.pose.x, state.pose.y)) < TOO_NEAR_M and not self._made_room:
            self._made_room = True
            self._retreat_path.begin(state.now)
        return STANDSTILL

    def _look_where_likely(self, state: RobotState) -> Twist2:
        """Turn to where they may be; drive there when that cannot be seen from here."""
        robot = state.map_pose
        legs = [state.map_from_odom.apply(*legs) for legs in all_legs(self._task.track.unknown)]
        self._belief.update(state.now, robot, legs)
        if self._heading is None and state.now >= self._next_choice:
            if self._goal_place is not None and self._path_follower.path is None:
                self._belief.no_way_to(self._goal_place)
            self._choose(state)
        if self._heading is not None:
            left = normalize_angle(self._heading - robot.yaw)
            if abs(left) > _FACING_RAD / 2.0:
                fast = abs(left) > 2.0 * _FACING_RAD
                speed = self._task.goal.max_angular if fast else _LOOK_RADPS
                turn = self._task.motions.turn_round(state, left, speed)
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

    def _choose(self, state: RobotState) -> None:
        """Choose between a heading to look in and a place to drive to."""
        self._next_choice = state.now + _CHOICE_S
        robot = state.map_pose
        heading, share = self._belief.best_view(robot)
        place = self._belief.best_place(robot)
        beside = abs(normalize_angle(heading - robot.yaw)) > _FACING_RAD
        if robot.distance_to(self._looked_from) > _SAME_PLACE_M:
            self._looks, self._looked_from = 0, robot
        worth = _WORTH_LOOKING[self._looks] if self._looks < len(_WORTH_LOOKING) else math.inf
        if place is None or (share >= worth and beside):
            self._heading, self._goal_place = heading, None
            self._task.motions.begin_to_turn_round()
            self._looks += 1
        else:
            self._goal_place = place
            self._path_follower.plan_anew()
