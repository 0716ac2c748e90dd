"""A scan of people who sit or lie: where their arms and legs are, at whatever height.

A laser passes over who lies on the floor, and what is low and near the robot is below the camera's picture.
So what was seen of them from further away is told to navigation, which remembers it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from florence_bt.core.sensing import LaserScan
from florence_bt.skills.people.user_tracker.detector import Detection

_STEP_RAD = math.radians(0.5)
_BEAMS = 360
"""Of half a circle. Chosen: 4 cm apart at the end of the range."""
_NEAREST_M, _FARTHEST_M = 0.25, 4.5
"""The nearest is chosen; the farthest is that of the people who are tracked (REFERENCE 12.9)."""


def body_scan(found: Sequence[Detection], stamp: float, frame_id: str) -> LaserScan:
    """Compute the scan of one picture.

    Args:
        found: Who is in it, in the robot frame.
        stamp: Of the picture, seconds.
        frame_id: The robot frame.

    Returns:
        The nearest part of somebody who sits or lies in each direction from -90 to 90 degrees; NaN where
        there is none: the scan does not say what is free.
    """
    ranges = np.full(_BEAMS, np.inf)
    for each in found:
        if each.posture in ("sitting", "lying") and each.outline is not None:
            x, y = each.outline.points.astype(float).T
            beams = np.floor(np.arctan2(y, x) / _STEP_RAD).astype(int) + _BEAMS // 2
            inside = (beams >= 0) & (beams < _BEAMS)
            np.minimum.at(ranges, beams[inside], np.hypot(x, y)[inside])
    seen = (ranges >= _NEAREST_M) & (ranges < _FARTHEST_M)
    return LaserScan(
        stamp=stamp,
        frame_id=frame_id,
        angle_min=-math.pi / 2 + _STEP_RAD / 2,
        angle_increment=_STEP_RAD,
        range_min=_NEAREST_M,
        range_max=_FARTHEST_M,
        ranges=np.where(seen, ranges, np.nan).astype(np.float32),
    )
