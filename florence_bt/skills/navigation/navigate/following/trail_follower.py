"""Along the way that the person walked: where they got through, the robot does too, and cuts no corner."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from florence_bt.core.geometry import Point2, Pose2, Twist2, normalize_angle
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.costmap import cost_at_distance
from florence_bt.skills.navigation.navigate.following.distance_law import speed_behind
from florence_bt.skills.navigation.navigate.following.line_of_sight import (
    OWN_PLACE_M,
    is_in_sight,
    is_line_free,
)
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.state import CycleState

_ROOM_M = 0.05
"""Room on each side, more than the robot needs to turn, from which a place is not narrow."""
_CLOSE_M = 0.45
"""Distance of the point of that way that the robot heads for in narrow places."""
_SHARES = 1.0, 0.5
"""Parts of the speed to try, the best first."""
_ASTRAY_RAD = 1.0
"""A way that begins further to the side leads away from the person."""
_START_M = 0.3
"""The robot turns to a point of the way when so much of the line to it is free."""
_SEEN_ERROR_M = 0.15
"""Error of the places where somebody was seen. Chosen."""
_NEARBY_OFFSETS = np.array(
    [(0.0, 0.0)]
    + [
        (part * _SEEN_ERROR_M * math.cos(angle), part * _SEEN_ERROR_M * math.sin(angle))
        for part in (0.5, 1.0)
        for angle in np.linspace(0.0, math.tau, 8, endpoint=False)
    ]
)
"""The tracker tells the places of the person with such an error: what to try round each, nearest first."""


class TrailFollower:
    """Drives along the way that the person walked."""

    def __init__(self, task: FollowTask) -> None:
        self._task = task
        footprint = task.costmaps.local_costmap.footprint
        to_turn = footprint.circumscribed_radius + _ROOM_M
        self.narrow = cost_at_distance(to_turn, footprint.inscribed_radius, task.parameters.costmap)
        """Cost from which the robot could not turn."""

    def drive(self, state: CycleState, person: Point2, keep: float) -> tuple[Twist2 | None, float]:
        """Return the velocity, None when the way cannot be driven, and the metres that are left.

        The robot heads for the furthest point of that way to which the straight line is free; rather for a
        nearer one than past something beside which it could not turn.

        Args:
            state: Of this moment.
            person: Where they are now, or were last: the end of the way; odometry frame, metres.
            keep: How far to stay behind, metres.
        """
        pose, track = state.pose, self._task.track
        distance, ahead = math.dist(person, (pose.x, pose.y)), pose.bearing_to(*person)
        # A person in sight is as far away as they look, any other as far as the robot has to drive.
        seen = is_in_sight(self._task, state, person)
        walks = track.walks_away(pose, ahead) if seen else track.speed
        steps = [
            (self._freest(place), walked)
            for place, walked in track.path.ahead((pose.x, pose.y), person)
            if math.dist(place, (pose.x, pose.y)) > OWN_PLACE_M
        ]
        if seen and distance <= keep + self._task.params.follow_give_way:
            # The robot does not turn away from somebody who is near and in sight.
            steps = [step for step in steps if not _is_astray(pose, step[0], ahead)]
        # Where they walked is free, whatever the map knows there: it was moved.
        seen_free = Clearance(self._task.costmaps.local_costmap, pose, None, None)
        # Where it is narrow, the robot stays on the way itself.
        close = sorted(steps, key=lambda step: abs(math.dist(step[0], (pose.x, pose.y)) - _CLOSE_M))
        points = [
            (place, math.dist(place, (pose.x, pose.y)) + walked)
            for some, least in ((steps, self.narrow), (close, INSCRIBED))
            for place, walked in some
            if is_line_free(self._task, state, place, person, least)
        ]
        for share in _SHARES:
            for place, left in points:
                bearing = pose.bearing_to(*place)
                speed = speed_behind(self._task, walks, (distance if seen else left) - keep)
                speed *= share * max(0.0, math.cos(bearing))
                turn = self._task.motions.turning_speed(bearing)
                if speed > 0.0 and self._task.motions.is_free_turn(seen_free, speed, turn, bearing):
                    return Twist2(speed, turn), left
        for place, left in points:
            moves = speed_behind(self._task, walks, (distance if seen else left) - keep) > 0.0
            astray = _is_astray(pose, place, ahead)
            if moves and not (seen and astray) and self._is_free_after_turning(pose, place):
                command = self._task.motions.turn_towards(state, pose.bearing_to(*place), seen_free)
                return None if command.is_zero() else command, left
        return None, math.inf

    def _freest(self, place: Point2) -> Point2:
        """Return where the robot fits best in a narrow place, within the error of a place of the person."""
        costs = self._task.costmaps.local_costmap.costs_at(place + _NEARBY_OFFSETS)
        if costs[0] < self.narrow:
            return place
        x, y = place + _NEARBY_OFFSETS[int(np.argmin(costs))]
        return float(x), float(y)

    def _is_free_after_turning(self, pose: Pose2, place: Point2) -> bool:
        """Tell whether the robot could drive towards a place if it were turned to it."""
        turned = replace(pose, yaw=pose.yaw + pose.bearing_to(*place))
        free = Clearance(self._task.costmaps.local_costmap, turned, None, None)
        return free.is_free(min(_START_M, math.dist(place, (pose.x, pose.y))), 0.0)


def _is_astray(pose: Pose2, place: Point2, ahead: float) -> bool:
    """Tell whether a place is far to the side of a bearing (rad)."""
    return abs(normalize_angle(pose.bearing_to(*place) - ahead)) > _ASTRAY_RAD
