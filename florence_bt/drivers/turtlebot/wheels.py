"""From a wanted velocity to wheel speeds and back (REFERENCE 2.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.geometry import Twist2
from florence_bt.core.limits import CheckedParameters, Limits, Positive
from florence_bt.drivers.turtlebot.codec.commands import MAX_RADIUS_MM, MAX_WHEEL_SPEED_MMPS


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """The arguments of Drive Direct.

    Attributes:
        left_mmps: Left wheel in mm/s, forward positive.
        right_mmps: Right wheel in mm/s.
    """

    left_mmps: int
    right_mmps: int

    @property
    def forward(self) -> bool:
        """Tell whether the base as a whole goes forward; a pure spin does not."""
        return self.left_mmps + self.right_mmps > 0


STOPPED = WheelSpeeds(0, 0)


@dataclass(frozen=True, slots=True)
class WheelParameters(CheckedParameters):
    """The parameters that make wheel speeds of velocities.

    Attributes:
        wheel_separation: Metres between the wheels, above zero.
        min_abs_yaw_vel: Slower turns are sped up to this, in rad/s; None for no limit.
        max_abs_yaw_vel: Faster turns are slowed down to this, in rad/s; None or 0 for no limit.
    """

    wheel_separation: Positive = 0.260
    min_abs_yaw_vel: Annotated[float, Limits(0.0, 3.0)] | None = None
    max_abs_yaw_vel: Annotated[float, Limits(0.0, 3.0)] | None = None


def limit_yaw_rate(angular: float, parameters: WheelParameters) -> float:
    """Apply the smallest and the largest turning speed; no turn stays no turn.

    Args:
        angular: rad/s.
        parameters: The limits.

    Source: REFERENCE 2.3, steps 1 and 2.
    """
    slowest, fastest = parameters.min_abs_yaw_vel, parameters.max_abs_yaw_vel
    if slowest is not None and angular != 0.0 and abs(angular) < slowest:
        angular = math.copysign(slowest, angular)
    if fastest and abs(angular) > fastest:
        angular = math.copysign(fastest, angular)
    return angular


def wheels_from_twist(twist: Twist2, parameters: WheelParameters) -> WheelSpeeds:
    """Share a velocity between the wheels; where both are too fast the turn wins over the advance.

    Args:
        twist: The wanted velocity; must be finite.
        parameters: Geometry and limits.

    Returns:
        Speeds within +-500 mm/s each, truncated toward zero.

    Source: REFERENCE 2.3, steps 1 to 5. The turning part is clamped to 500 mm/s first: without that, more
    than 3.846 rad/s would flip the sign of the advance.
    """
    angular = limit_yaw_rate(twist.angular, parameters)
    turn = 1000.0 * angular * parameters.wheel_separation / 2.0
    turn = _clamp(turn)
    room = MAX_WHEEL_SPEED_MMPS - abs(turn)
    advance = max(-room, min(room, 1000.0 * twist.linear))
    return WheelSpeeds(_truncate(advance - turn), _truncate(advance + turn))


def wheels_one_by_one(twist: Twist2, parameters: WheelParameters) -> WheelSpeeds:
    """Return wheel speeds, each clamped by itself, as in the old node's mode ``turtle``.

    Args:
        twist: The wanted velocity; must be finite.
        parameters: Geometry and limits.

    Source: REFERENCE 2.3, steps 1 to 3 and 5.
    """
    turn = 1000.0 * limit_yaw_rate(twist.angular, parameters) * parameters.wheel_separation / 2.0
    advance = 1000.0 * twist.linear
    return WheelSpeeds(_truncate(_clamp(advance - turn)), _truncate(_clamp(advance + turn)))


def arc_from_twist(twist: Twist2, parameters: WheelParameters) -> tuple[int, int | None]:
    """Return the velocity and radius for the Drive command.

    Args:
        twist: The wanted velocity; must be finite.
        parameters: Geometry and limits.

    Returns:
        Velocity in mm/s within +-500, and the radius in mm within +-2000, positive to the left: None for
        straight on, 1 and -1 for a turn on the spot.

    Source: REFERENCE 1.3 (137) and 2.3. Arcs wider than 2 m are driven with 2 m, the most that it can say.
    """
    angular = limit_yaw_rate(twist.angular, parameters)
    if angular == 0.0:
        return _truncate(_clamp(1000.0 * twist.linear)), None
    radius = 1000.0 * twist.linear / angular
    if abs(radius) < 2.0:
        spin = _clamp(1000.0 * angular * parameters.wheel_separation / 2.0)
        return abs(_truncate(spin)), 1 if angular > 0.0 else -1
    limited = max(-MAX_RADIUS_MM, min(MAX_RADIUS_MM, radius))
    return _truncate(_clamp(1000.0 * twist.linear)), _truncate(limited)


def _clamp(speed_mmps: float) -> float:
    return max(-MAX_WHEEL_SPEED_MMPS, min(MAX_WHEEL_SPEED_MMPS, speed_mmps))


def _truncate(speed_mmps: float) -> int:
    """Truncate toward zero; but 264.9999999, which floating point made of 265, stays 265."""
    return math.trunc(round(speed_mmps, 6))
