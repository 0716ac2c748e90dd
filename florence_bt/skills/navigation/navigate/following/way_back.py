"""Backing off, best on the way on which the robot came: it is blind behind; and making room to turn."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.legs import Place
from florence_bt.skills.navigation.navigate.state import RobotState

_STEP_M, _POINTS = 0.1, 50
"""The way the robot came: a point at least so far from the next, so many are remembered."""
_TO_M = 0.3
"""It steers towards a point of that way so far behind its middle."""
_STRAIGHT_RAD = 0.3
"""Further beside that point it turns first."""
_TURNS_BACK_RAD, _LASER_RAD = 1.0, 1.6
"""Further to the side it does not turn from who is given way to, nor from who is stepped aside for: the laser
sees them there."""
_MPS, _MAKE_ROOM_S = 0.2, 1.0
"""How fast it makes room, and for how long at most: somebody may be behind it, where it is blind."""
_TO_TURN_M = 0.1, 0.2
"""Where it cannot turn, it drives forward when it could turn further after one of these than after as much
back."""
_AHEAD_S = 0.4, 1.0
"""A motion back must be free for so many seconds: slow, and where the robot has just been; or for as many as
it takes to get out of something that it touches in the costmap."""
_BEHIND_M, _CLOSE_BEHIND_M = 0.4, 0.6
"""It does not back off when somebody else was seen lately so near to a point so far behind it."""


class WayBack:
    """Remembers the way the robot came, and backs off on it."""

    def __init__(self, task: FollowTask) -> None:
        self._task = task
        self._trail: deque[Place] = deque(maxlen=_POINTS)
        self._until, self._forward = -math.inf, False

    def remember(self, state: RobotState) -> None:
        """Take the robot's place of a cycle."""
        here = state.pose.x, state.pose.y
        forward = state.twist.linear > 0.0
        if forward and (not self._trail or math.dist(self._trail[-1], here) >= _STEP_M):
            self._trail.append(here)

    def begin(self, state: RobotState, turn: float = 0.0) -> None:
        """Make a little room, from the next cycle on.

        Args:
            state: Of this moment.
            turn: For which there was no room, rad; without one the robot backs out.
        """
        self._until = state.now + _MAKE_ROOM_S
        self._forward = turn != 0.0 and self._turns_further_ahead(state, turn)

    def make_room(self, state: RobotState) -> Twist2:
        """The velocity while it makes room, else standstill."""
        command = STANDSTILL
        if state.now < self._until:
            command = state.people.slowed(
                state.pose, self._ahead(state) if self._forward else self.back_off(state)
            )
        if command.is_zero():
            self._until = -math.inf
        return command

    def _ahead(self, state: RobotState) -> Twist2:
        return Twist2(_MPS, 0.0) if state.clearance.is_free(_MPS * _AHEAD_S[0], 0.0) else STANDSTILL

    def _turns_further_ahead(self, state: RobotState, turn: float) -> bool:
        """Whether a turn is freer a little ahead than back, and the person is not there."""
        track = self._task.track
        if track.is_seen(state.now) and abs(state.pose.bearing_to(*track.at(state.now))) < _TURNS_BACK_RAD:
            return False

        def freed(direction: float) -> float:
            ways = (direction * way for way in _TO_TURN_M)
            free = (way for way in ways if state.clearance.is_free(way, 0.0))
            return max((state.clearance.after(way).free_part(0.0, turn) for way in free), default=0.0)

        return freed(1.0) > freed(-1.0)

    def back_off(self, state: RobotState, bearing: float = 0.0, speed: float = _MPS) -> Twist2:
        """Back on the way the robot came, or straight; standstill where there is no room.

        Args:
            state: Of this moment.
            bearing: Of the person who is given way to; the robot does not turn its back on them.
            speed: m/s, limited by ``follow_back_speed``.
        """
        trail, pose = self._trail, state.pose
        while trail and math.dist(trail[-1], (pose.x, pose.y)) < _TO_M:
            trail.pop()
        back = -min(speed, self._task.use.follow_back_speed)
        if back == 0.0 or self._is_somebody_behind(state):
            return STANDSTILL
        left = _left_to_reverse(pose, trail[-1], bearing, _TURNS_BACK_RAD) if trail else None
        # Where it has come, nothing stands that the map may know.
        costmap = self._task.costmaps.local_costmap
        come = state.clearance if left is None else Clearance(costmap, pose, None, None)
        command = self._reverse(come, back, left or 0.0)
        straight = Twist2(back, 0.0)
        if command.is_zero() and _is_free_back(state.clearance, straight):
            return straight
        return command

    def back_along(self, state: RobotState, way: Sequence[Place], bearing: float) -> Twist2:
        """Backwards along a way (odometry frame, metres); standstill where it would turn its back on who is
        at a bearing (rad), and where there is no room.
        """
        here = state.pose.x, state.pose.y
        place = next((place for place in way if math.dist(place, here) >= _TO_M), None)
        left = None if place is None else _left_to_reverse(state.pose, place, bearing, _LASER_RAD)
        if left is None or self._is_somebody_behind(state):
            return STANDSTILL
        return self._reverse(state.clearance, -min(_MPS, self._task.use.follow_back_speed), left)

    def _reverse(self, clearance: Clearance, back: float, left: float) -> Twist2:
        """Backwards with a turn, or the turn first; standstill where there is no room."""
        turn = self._task.motions.turning_speed(left)
        straight = back if abs(left) < _STRAIGHT_RAD else 0.0
        for command in Twist2(straight, turn), Twist2(0.0, turn):
            if not command.is_zero() and _is_free_back(clearance, command):
                return command
        return STANDSTILL

    def _is_somebody_behind(self, state: RobotState) -> bool:
        """Whether somebody else was behind the robot a moment ago, where it is blind."""
        behind = state.pose.apply(-_BEHIND_M, 0.0)
        return any(math.dist(place, behind) <= _CLOSE_BEHIND_M for _, place in self._task.track.others)


def _left_to_reverse(robot: Pose2, place: Place, bearing: float, most: float) -> float | None:
    """The turn (rad) after which a place is right behind, None when a bearing were further beside then."""
    left = normalize_angle(robot.bearing_to(*place) + math.pi)
    return left if abs(normalize_angle(bearing - left)) <= most else None


def _is_free_back(clearance: Clearance, command: Twist2) -> bool:
    return any(clearance.is_free(command.linear * ahead, command.angular * ahead) for ahead in _AHEAD_S)
