"""Motions that are allowed now while the robot follows somebody, and turns in place."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.parameters import FollowParameters
from florence_bt.skills.navigation.navigate.state import CycleState


@dataclass(frozen=True, slots=True)
class FollowGoal:
    """The person to follow, and how.

    Attributes:
        user_id: The persistent id of the person.
        distance: How far to stay behind, in metres.
        max_linear: m/s.
        max_angular: rad/s.
    """

    user_id: int
    distance: float
    max_linear: float
    max_angular: float


@dataclass(frozen=True, slots=True)
class Move:
    """The motion of the robot in a cycle.

    Attributes:
        command: The velocity.
        text: What it does, for people.
        result: How the goal ended, or None.
    """

    command: Twist2
    text: str
    result: Result | None = None


class Motions:
    """Checks motions before they are driven.

    Attributes:
        held: Whether something was in the way of what was wanted last.
    """

    def __init__(self, goal: FollowGoal, params: FollowParameters) -> None:
        self._goal = goal
        self._params = params
        self.held = False

    def limited(self, turn: float) -> float:
        """Keep a turning speed within the limit of the goal, rad/s."""
        return max(-self._goal.max_angular, min(self._goal.max_angular, turn))

    def turning_speed(self, bearing: float) -> float:
        """Return how fast to turn towards what is so far beside the heading (rad), rad/s."""
        return self.limited(self._params.follow_angular_gain * bearing)

    def is_free(self, state: CycleState, command: Twist2) -> bool:
        """Tell whether a motion is free for as long as the robot looks ahead."""
        ahead = self._params.follow_look_ahead
        return state.clearance.is_free(command.linear * ahead, command.angular * ahead)

    def is_free_turn(self, clearance: Clearance, speed: float, turn: float, left: float) -> bool:
        """Tell whether a motion is free that turns by that much (``left``, rad) and no further."""
        ahead = self._params.follow_look_ahead
        angle = math.copysign(min(abs(left), abs(turn) * ahead), left)
        return clearance.is_free(speed * ahead, angle)

    def turn_towards(self, state: CycleState, bearing: float, clearance: Clearance | None = None) -> Twist2:
        """Turn in place, if there is room; ``clearance`` is that of the state when not given."""
        if abs(bearing) <= self._params.follow_angle_tolerance:
            return STANDSTILL
        turn = self.turning_speed(bearing)
        self.held = not self.is_free_turn(clearance or state.clearance, 0.0, turn, bearing)
        return STANDSTILL if self.held else Twist2(0.0, turn)
