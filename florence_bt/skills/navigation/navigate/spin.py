"""Turning in place: how fast, and a whole turn by an angle of the odometry."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.geometry import STANDSTILL, Twist2, normalize_angle
from florence_bt.core.limits import CheckedParameters, Limits, Positive, check_order
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.state import CycleState, Feedback


@dataclass(frozen=True, slots=True)
class SpinParameters(CheckedParameters):
    """The parameters of turning by an angle.

    Attributes:
        spin_max_speed: rad/s.
        spin_min_speed: rad/s; slower the base would stand still.
        spin_gain: Speed per angle that is left, 1/s.
        spin_precision: The turn is over when this much or less is left, in radians.

    Source:
        REFERENCE 12.2.
    """

    spin_max_speed: Positive = 0.5
    spin_min_speed: Positive = 0.2
    spin_gain: Positive = 1.5
    spin_precision: Annotated[float, Limits(0.0, 1.0, above=True)] = 0.05

    def _check(self) -> None:
        check_order(self, ("spin_min_speed", "spin_max_speed"), equal=True)


_BRAKING_RAD = 0.02
"""Turn that the robot still makes at the slowest speed: a cycle of the controller, and braking."""
AT_REST_TURN_SPEED = 0.03
"""rad/s; slower counts as standing."""


class _Phase(enum.Enum):
    READY = "ready"
    TURNING = "turning"
    SETTLING = "settling"


class Spin(NavigationGoal):
    """One turn in place, from its start to its result.

    Attributes:
        travelled: Radians turned so far, counter-clockwise positive.
    """

    by_odometry = True

    def __init__(self, angle: float, parameters: SpinParameters, now: float, time_allowance: float) -> None:
        self._angle = angle
        self._parameters = parameters
        self._deadline = now + time_allowance if time_allowance > 0.0 else math.inf
        self._last_yaw: float | None = None
        self._phase = _Phase.READY
        self.travelled = 0.0

    @property
    def remaining(self) -> float:
        """Radians that are left, counter-clockwise positive."""
        return self._angle - self.travelled

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the turn is over."""
        command, result = self._turn(state)
        left = abs(self.remaining)
        time = left / self._parameters.spin_max_speed
        return command, Feedback(left, time, 0, "turning in place", travelled=self.travelled), result

    def _turn(self, state: CycleState) -> tuple[Twist2, Result | None]:
        clearance = state.clearance
        if self._last_yaw is not None:
            self.travelled += normalize_angle(state.pose.yaw - self._last_yaw)
        self._last_yaw = state.pose.yaw
        near_enough = abs(self.remaining) <= self._parameters.spin_precision
        # It stops a little before the angle, and not at the first that is near enough: seven turns that all
        # fall short by as much leave a gap in a circle that nobody looks into.
        ahead = self.remaining * self._angle > 0.0 and abs(self.remaining) > _BRAKING_RAD
        if near_enough and not (ahead and clearance.is_free(0.0, self.remaining)):
            self._phase = _Phase.SETTLING
        if self._phase is _Phase.SETTLING:
            return STANDSTILL, success() if abs(state.twist.angular) < AT_REST_TURN_SPEED else None
        if state.now > self._deadline:
            left = math.degrees(self.remaining)
            return STANDSTILL, failure(
                "time_allowance", f"{left:.0f} degrees were left when the time was over"
            )
        if not clearance.is_free(0.0, self.remaining):
            return STANDSTILL, failure("collision_ahead", "something is in the way of the turn")
        self._phase = _Phase.TURNING
        return Twist2(0.0, self._speed()), None

    def _speed(self) -> float:
        p = self._parameters
        speed = min(p.spin_max_speed, max(p.spin_min_speed, p.spin_gain * abs(self.remaining)))
        return math.copysign(speed, self.remaining)
