"""The distance from a person within which the robot does not drive towards them."""

from __future__ import annotations

import math

from florence_bt.core.geometry import Pose2, Twist2

NEAREST_M = 0.5
"""Between the middles."""
_BEFORE_RAD = 1.0
"""Bearing up to which somebody is before the robot. Chosen."""


def keep_off(robot: Pose2, person: tuple[float, float], command: Twist2) -> Twist2:
    """Return the command; without its way forward when that leads towards somebody who is too near.

    Args:
        robot: The robot.
        person: The person, metres, in the same frame.
        command: The wanted velocity.
    """
    near = math.dist(person, (robot.x, robot.y)) < NEAREST_M
    before = abs(robot.bearing_to(*person)) < _BEFORE_RAD
    return Twist2(min(0.0, command.linear), command.angular) if near and before else command
