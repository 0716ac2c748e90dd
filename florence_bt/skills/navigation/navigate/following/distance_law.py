"""How fast to drive behind somebody who is to be a certain distance away."""

from __future__ import annotations

import math

from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.skills.navigation.navigate.following.motions import FollowGoal, Motions
from florence_bt.skills.navigation.navigate.following.track import PersonTrack
from florence_bt.skills.navigation.navigate.parameters import FollowParameters

_NEAREST_M = 0.5
"""Who walks past nearer than this is not turned after any faster."""


class DistanceLaw:
    """The law of the document, with the person's own velocity added, so that the robot does not lag behind.

    Source:
        REFERENCE 12.6, whose signs are those of other axes.
    """

    def __init__(self, goal: FollowGoal, use: FollowParameters, track: PersonTrack, motions: Motions) -> None:
        self._goal = goal
        self._use = use
        self._track = track
        self._motions = motions

    def straight(self, robot: Pose2, distance: float, bearing: float) -> Twist2:
        """The velocity straight towards the person, who is so far away (metres) and so far beside (rad)."""
        turn = (
            self._use.follow_angular_gain * bearing
            if abs(bearing) > self._use.follow_angle_tolerance
            else 0.0
        )
        if self._track.walks:
            (vx, vy), heading = self._track.velocity, robot.yaw + bearing
            turn += (math.cos(heading) * vy - math.sin(heading) * vx) / max(distance, _NEAREST_M)
        speed = self.speed_along(robot, distance, bearing) * max(0.0, math.cos(bearing))
        return Twist2(speed, self._motions.limited(turn))

    def speed_along(self, robot: Pose2, way: float, bearing: float) -> float:
        """The speed along a way of so many metres to who walks away from the robot, m/s."""
        return self.speed(self._track.walks_away(robot, bearing), way - self._goal.distance)

    def speed(self, away: float, too_far: float) -> float:
        """The speed behind somebody who walks on (m/s) and is some metres too far away; never backwards."""
        if abs(too_far) <= self._use.follow_distance_tolerance:
            too_far = 0.0
            if not self._track.walks:
                return 0.0
        return max(0.0, min(self._goal.max_linear, away + self._use.follow_linear_gain * too_far))
