"""Goals by odometry alone that need no plan: a straight drive, and standing still for a while."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, angle_difference
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.people import SOMEBODY_IN_THE_WAY
from florence_bt.skills.navigation.navigate.state import CycleState, Feedback

_PRECISION_M = 0.01
SLOWEST_MPS = 0.02
"""Slower the base stands still."""
_BRAKING_MPS2 = 0.3
_HEADING_GAIN = 1.5
_AHEAD_S, _AHEAD_M = 1.0, 0.1
"""So many seconds and metres ahead the robot looks for what is in the way."""
_KEPT_AHEAD_M, _KEPT_BEHIND_M = 0.03, 0.1
"""It stops so far before that: the step in which a way is looked at, and what it takes to stop. Behind it,
where only the map tells, the error of the localisation comes to that."""
_AT_REST_MPS = 0.02
"""Speed below which the robot has stopped. Chosen."""


class StraightDrive(NavigationGoal):
    """Drive straight on, or back, by odometry; as far as there is room when something is in the way.

    It backs over floor where the robot was, and no other: nothing sees what stands low behind it.

    Args:
        distance: Metres, below zero backwards.
        speed: m/s, :data:`SLOWEST_MPS` or more.
        now: Seconds.
        time_allowance: Seconds it may take; 0 is no limit.
    """

    by_odometry = True

    def __init__(self, distance: float, speed: float, now: float, time_allowance: float) -> None:
        self._distance, self._speed = distance, speed
        self._deadline = now + time_allowance if time_allowance > 0.0 else math.inf
        self._start: Pose2 | None = None

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the drive is over."""
        start = self._start = self._start or state.pose
        way = math.copysign(1.0, self._distance)
        travelled = way * (start.inverse() @ state.pose).x
        left = abs(self._distance) - travelled
        text = "driving straight on" if way > 0.0 else "backing up"

        def answer(command: Twist2, result: Result | None = None, text: str = text) -> tuple:
            return (
                command,
                Feedback(max(0.0, left), max(0.0, left) / self._speed, 0, text, 1, travelled),
                result,
            )

        if left <= _PRECISION_M:
            return answer(STANDSTILL, success() if abs(state.twist.linear) < _AT_REST_MPS else None)
        if way > 0.0 and state.stop.holds_forward:
            return answer(STANDSTILL, state.stop.failure())
        if state.now > self._deadline:
            reason = f"{left:.2f} m were left when the time was over"
            return answer(STANDSTILL, failure("time_allowance", reason))
        room, obstacle = _room(state, way, left, _AHEAD_S * self._speed + _AHEAD_M)
        speed = min(self._speed, max(SLOWEST_MPS, math.sqrt(2.0 * _BRAKING_MPS2 * max(0.0, room))))
        if room <= _PRECISION_M:
            reason = f"{obstacle}; it got {max(0.0, travelled):.2f} m far, {left:.2f} m were left"
            return answer(STANDSTILL, failure("collision_ahead", reason))
        turn = _HEADING_GAIN * angle_difference(start.yaw, state.pose.yaw)
        command = state.people.slowed(state.pose, Twist2(way * speed, turn))
        if command.linear == 0.0:
            return answer(STANDSTILL, text=f"waiting: {SOMEBODY_IN_THE_WAY}")
        return answer(command)


def _room(state: CycleState, way: float, left: float, sight: float) -> tuple[float, str]:
    """Return how far the robot may go on, and what ends there.

    Args:
        state: The robot now.
        way: 1 ahead, -1 back.
        left: Metres that it still has to go.
        sight: So far it looks, metres.
    """
    ahead = min(left, sight)
    free = ahead * state.clearance.free_part(way * ahead, 0.0)
    if way > 0.0:
        return (left if free >= ahead else free - _KEPT_AHEAD_M), "something is ahead"
    room = left if free >= ahead else free - _KEPT_BEHIND_M
    driven = state.driven.way_back(state.pose, ahead)
    if driven < min(ahead, room):
        return driven, "behind the robot is floor where it was not, and nothing sees what stands low there"
    return room, "something is behind the robot"


class WaitInPlace(NavigationGoal):
    """Wait.

    Args:
        duration: Seconds.
        now: Seconds.
    """

    def __init__(self, duration: float, now: float) -> None:
        self._end = now + duration

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step."""
        return STANDSTILL, *self.stand_still(state.now)

    def stand_still(self, now: float) -> tuple[Feedback, Result | None]:
        """Take one step, which needs no sensors: how much time is left, and the result at the end."""
        left = max(0.0, self._end - now)
        return Feedback(0.0, left, 0, "waiting"), None if left > 0.0 else success()
