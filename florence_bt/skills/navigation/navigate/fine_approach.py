"""The last centimetres of a precise drive: turn to the goal, drive onto it, turn to its heading, measure."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, angle_difference, normalize_angle
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.navigation.navigate.state import CycleState

PRECISE_M, PRECISE_RAD = 0.01, math.radians(0.5)
"""A precise drive ends so near to its goal, and with its heading."""
_AIM_M, _AIM_RAD = 0.007, math.radians(0.35)
"""Nearer nothing is corrected."""
_ASIDE_RAD = 0.15
"""The robot drives onto what lies so much beside its heading, or straight behind it, without a turn."""
_GAIN, _TURN_GAIN = 2.0, 2.0
_SLOWEST_MPS, _FASTEST_MPS = 0.02, 0.06
_SLOWEST_RADPS, _FASTEST_RADPS = 0.06, 0.4
"""Slower the base would stand still."""
_STOPS_M, _STOPS_RAD = 0.003, 0.005
"""Way that it still makes when it is told to stop at the slowest speed: a cycle of the controller, and
braking."""
_REST_MPS, _REST_RADPS, _REST_S = 0.005, 0.02, 0.3
"""Slower, for so long, it stands, and is measured."""
_LEGS, _LIMIT_S = 12, 20.0
"""Then it is near enough or not; less than ``give_up_time`` of a drive."""


class FineApproach:
    """Corrects where a drive has ended, leg by leg.

    Args:
        goal: In the map frame.
        now: Seconds.
    """

    def __init__(self, goal: Pose2, now: float) -> None:
        self._goal = goal
        self._deadline = now + _LIMIT_S
        self._legs = 0
        self._turn_to: float | None = None
        self._way = 0.0
        self._moved = now

    def step(self, state: CycleState) -> tuple[Twist2, Result | None]:
        """Return the velocity, and the result when the robot stands as near as was asked for, or cannot."""
        here = state.map_pose
        moves = abs(state.twist.linear) > _REST_MPS or abs(state.twist.angular) > _REST_RADPS
        if self._turn_to is not None:
            command = self._turn(here, self._turn_to)
        elif self._way:
            command = self._drive(here)
        elif not moves and state.now - self._moved >= _REST_S:
            return STANDSTILL, self._next_leg(state)
        else:
            command = STANDSTILL
        if command.is_zero():
            self._turn_to, self._way = None, 0.0
        if moves or not command.is_zero():
            self._moved = state.now
        return state.people.slowed(state.pose, command), None

    def _next_leg(self, state: CycleState) -> Result | None:
        """Choose what to correct first; a result when that is nothing, or cannot be done."""
        here, goal = state.map_pose, self._goal
        left, turned = here.distance_to(goal), abs(angle_difference(goal.yaw, here.yaw))
        if left <= _AIM_M and turned <= _AIM_RAD:
            return success()
        if self._legs == _LEGS or state.now > self._deadline:
            near = left <= PRECISE_M and turned <= PRECISE_RAD
            return success() if near else failure("no_progress", _short_of(left, turned))
        self._legs += 1
        turn = angle_difference(goal.yaw, here.yaw)
        if left > _AIM_M:
            bearing = here.bearing_to(goal.x, goal.y)
            ahead = abs(bearing) <= math.pi / 2.0
            turn = bearing if ahead else normalize_angle(bearing + math.pi)
            if abs(turn) <= _ASIDE_RAD:
                self._way = left if ahead else -left
                free = state.clearance.is_free(self._way, 0.0)
                return None if free else failure("blocked", _short_of(left, turned))
        self._turn_to = here.yaw + turn
        free = state.clearance.is_free(0.0, turn)
        return None if free else failure("blocked", _short_of(left, turned))

    def _turn(self, here: Pose2, yaw: float) -> Twist2:
        left = angle_difference(yaw, here.yaw)
        if abs(left) <= _STOPS_RAD:
            return STANDSTILL
        speed = min(_FASTEST_RADPS, max(_SLOWEST_RADPS, _TURN_GAIN * abs(left)))
        return Twist2(0.0, math.copysign(speed, left))

    def _drive(self, here: Pose2) -> Twist2:
        ahead, _ = here.inverse().apply(self._goal.x, self._goal.y)
        left = ahead if self._way > 0.0 else -ahead
        if left <= _STOPS_M:
            return STANDSTILL
        speed = min(_FASTEST_MPS, max(_SLOWEST_MPS, _GAIN * left))
        return Twist2(math.copysign(speed, self._way), 0.0)


def _short_of(left: float, turned: float) -> str:
    return (
        f"the robot stands {100.0 * left:.1f} cm and {math.degrees(turned):.1f} degrees off its goal "
        f"(a precise drive ends within {100.0 * PRECISE_M:g} cm and {math.degrees(PRECISE_RAD):g} degrees)"
    )
