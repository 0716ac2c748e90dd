"""Whether the orientation of a goal is a heading in the plane. Light: no numpy, no ROS."""

from __future__ import annotations

import math


def problem_with_quaternion(x: float, y: float, z: float, w: float) -> str | None:
    """Why a quaternion is no heading, None when it is one.

    Source:
        REFERENCE 7.3 (goal quaternion).
    """
    squared = x * x + y * y + z * z + w * w
    if not math.isfinite(squared):
        return "the goal's orientation is not finite"
    if squared < 1e-6:
        return "the goal's orientation is the zero quaternion; w: 1.0 means straight ahead"
    if 2.0 * (x * x + y * y) / squared > 1e-3:
        return "the goal's orientation is tilted; the robot can only turn about the vertical axis"
    return None
