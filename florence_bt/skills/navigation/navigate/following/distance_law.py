"""The law of the speed behind somebody who is to be a certain distance away.

The law of the document, with the person's own velocity added, so that the robot does not lag behind.

Source:
    REFERENCE 12.6, whose signs are those of other axes.
"""

from __future__ import annotations

import math

from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.skills.navigation.navigate.following.task import FollowTask

_NEAREST_M = 0.5
"""Distance below which a person who walks past is not turned after any faster."""


def velocity_straight(task: FollowTask, robot: Pose2, distance: float, bearing: float) -> Twist2:
    """Return the velocity straight towards the person at a distance (metres) and bearing (rad)."""
    params, track = task.params, task.track
    turn = params.follow_angular_gain * bearing if abs(bearing) > params.follow_angle_tolerance else 0.0
    if track.walks:
        (vx, vy), heading = track.velocity, robot.yaw + bearing
        turn += (math.cos(heading) * vy - math.sin(heading) * vx) / max(distance, _NEAREST_M)
    speed = speed_along(task, robot, distance, bearing) * max(0.0, math.cos(bearing))
    return Twist2(speed, task.motions.limited(turn))


def speed_along(task: FollowTask, robot: Pose2, way: float, bearing: float) -> float:
    """Return the speed along a way of so many metres to somebody who walks away from the robot, m/s."""
    away = task.track.walks_away(robot, bearing)
    return speed_behind(task, away, way - task.goal.distance)


def speed_behind(task: FollowTask, away: float, too_far: float) -> float:
    """Return the speed behind somebody who walks (m/s) and is some metres too far; never backwards."""
    params = task.params
    if abs(too_far) <= params.follow_distance_tolerance:
        too_far = 0.0
        if not task.track.walks:
            return 0.0
    return max(0.0, min(task.goal.max_linear, away + params.follow_linear_gain * too_far))
