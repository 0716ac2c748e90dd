"""The view of a place in a laser scan: nobody stands there when its beams go through."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3

_BODY_M = 0.3
"""Legs are no further to either side of where somebody was seen, nor behind it, metres: a stride, or the
error of a place that was seen from nearby."""
_MOST_SHORT = 0.03
"""So large a part of the beams may end before they are through: rays that graze an edge. Chosen."""
_FEWEST = 8
"""So many beams are enough. Chosen: at 4 m, a beam in 1.5 degrees."""


@dataclass(frozen=True, slots=True)
class LaserView:
    """A scan and from where it was taken.

    Attributes:
        scan: The scan.
        laser: Its frame, as a pose in the map frame.
    """

    scan: LaserScan
    laser: Transform3

    def is_free(self, x: float, y: float) -> bool:
        """Tell whether the laser looks through a place, metres in the map frame: nobody stands on it."""
        ranges = self.scan.ranges.astype(float)
        directions = np.pad(self.scan.directions(), ((0, 0), (0, 1))) @ self.laser.rotation.T
        dx, dy = x - float(self.laser.translation[0]), y - float(self.laser.translation[1])
        along = directions[:, 0] * dx + directions[:, 1] * dy
        beside = np.abs(directions[:, 0] * dy - directions[:, 1] * dx)
        looks_there = (along > 0.0) & (beside < _BODY_M)
        # NaN and what is too near to be measured show nothing.
        through = looks_there & (ranges > math.hypot(dx, dy) + _BODY_M)
        count = int(looks_there.sum())
        return count >= _FEWEST and int(through.sum()) >= (1.0 - _MOST_SHORT) * count


def laser_view(scan: LaserScan, laser_in_frame: Transform3, frame: Pose2) -> LaserView:
    """Return the view of a scan.

    Args:
        scan: The scan.
        laser_in_frame: The laser in a frame of the floor.
        frame: This frame in the map frame.
    """
    return LaserView(scan, Transform3.from_pose2(frame) @ laser_in_frame)
