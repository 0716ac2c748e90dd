"""The direction of a wall in front of the robot, from one scan (REFERENCE 3.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from florence_bt.core.limits import CheckedParameters, Limits, Positive, check_order
from florence_bt.core.sensing import LaserScan


@dataclass(frozen=True, slots=True)
class WallParameters(CheckedParameters):
    """The parameters of the part of a scan that is the wall, and of what counts as one.

    Attributes:
        min_angle: First direction looked at, radians (REFERENCE 3.1).
        max_angle: Last direction looked at, radians (REFERENCE 3.1).
        min_points: Fewer beams that hit something are not a wall.
        max_steepness: A wall at a larger angle than this, radians, may be the next one round the corner, and
            does not count.
        max_residual_m: Points further from the fitted line (root mean square) are not a straight wall.
    """

    min_angle: Annotated[float, Limits(-math.pi, math.pi)] = -0.3
    max_angle: Annotated[float, Limits(-math.pi, math.pi)] = 0.3
    min_points: Annotated[int, Limits(2)] = 10
    max_steepness: Annotated[float, Limits(0.0, math.pi / 2, above=True, below=True)] = 0.5
    max_residual_m: Positive = 0.05

    def _check(self) -> None:
        check_order(self, ("min_angle", "max_angle"))


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall ahead.

    Attributes:
        angle: Radians; 0 when the robot looks straight at it, positive when it is turned left of the wall's
            normal.
        distance: Metres from the sensor to the wall along its normal.
        points: How many beams hit it.
    """

    angle: float
    distance: float
    points: int


def find_wall(scan: LaserScan, parameters: WallParameters | None = None) -> Wall | str:
    """Fit a wall to the beams straight ahead.

    Args:
        scan: Angles counter-clockwise about an upward axis, zero straight ahead.
        parameters: What to look at.

    Returns:
        The wall, or why there is none.

    Source: REFERENCE 3.2 (x = r sin, y = r cos, a line y over x by least squares; its slope's angle).
    """
    limits = parameters or WallParameters()
    angles = scan.angles()
    used = scan.valid() & (angles >= limits.min_angle) & (angles <= limits.max_angle)
    count = int(np.count_nonzero(used))
    if count < limits.min_points:
        return f"only {count} beams straight ahead hit something, {limits.min_points} are needed"
    ranges = scan.ranges[used].astype(np.float64)
    x = ranges * np.sin(angles[used])
    y = ranges * np.cos(angles[used])
    spread = x - x.mean()
    denominator = float(spread @ spread)
    if denominator <= 0.0:
        return "all beams hit one point"
    slope = float(spread @ y) / denominator
    offset = float(y.mean() - slope * x.mean())
    residual = float(np.sqrt(np.mean((y - slope * x - offset) ** 2) / (1.0 + slope * slope)))
    if residual > limits.max_residual_m:
        return f"what is straight ahead is not a straight wall: points lie {residual:.3f} m beside the line"
    angle = math.atan(slope)
    if abs(angle) > limits.max_steepness:
        return f"the wall ahead is {math.degrees(abs(angle)):.0f} degrees off: another one may be meant"
    return Wall(angle, abs(offset) / math.hypot(1.0, slope), count)
