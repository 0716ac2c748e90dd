"""A map of distances to what a few scans have met, for other scans to be fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.localisation._kernels import draw_distances
from florence_bt.skills.navigation.localisation.likelihood_field import LikelihoodField

FAR_M = 0.3
"""Distance at which those to the surfaces of a submap are cut."""
_RESOLUTION_M, _REACH_M = 0.05, 12.0
"""Cells of a submap, and how far from its middle it reaches."""
_CELLS = round(2.0 * _REACH_M / _RESOLUTION_M)
_GAP_M = 0.35
"""Two neighbouring beams that end nearer to each other have met the same surface."""
_SCANS, _LENGTH_M = 24, 6.0
"""This many scans make a submap, or so many metres from its middle, where the next ones still lie within its
reach."""
_NO_NORMALS = np.zeros((_CELLS, _CELLS, 2), np.float32)
"""Normals of a submap, which does not keep the side that a surface was seen from. Shared, and never written
(a read-only array would have the kernels compiled once more)."""


class Submap:
    """A map of distances to what some scans have met, around where the first one was taken.

    Attributes:
        middle: Where that was, in the frame of the poses that are given.
        field: The distances, in the same frame; all of them to the front of a surface.
    """

    def __init__(self, middle: Pose2) -> None:
        self.middle = middle
        self.field = LikelihoodField(
            resolution=_RESOLUTION_M,
            origin_x=middle.x - _REACH_M,
            origin_y=middle.y - _REACH_M,
            signed=np.full((_CELLS, _CELLS), FAR_M, np.float32),
            normals=_NO_NORMALS,
            max_distance=FAR_M,
        )
        self._scans = 0

    def used(self, pose: Pose2) -> float:
        """Return the part of it that is used up when the robot is at a pose; from 1 on it is full."""
        return used_up(self._scans, self.middle, pose)

    def add(self, pose: Pose2, points: NDArray[np.float64]) -> None:
        """Draw a scan.

        Args:
            pose: Of the base.
            points: Shape (n, 2), beam ends in the base frame, metres, in the order of the beams.
        """
        field, at = self.field, (pose.x, pose.y, pose.yaw)
        draw_distances(field.signed, points, at, field.frame, FAR_M, _GAP_M)
        self._scans += 1


def used_up(scans: int, middle: Pose2, pose: Pose2) -> float:
    """Return the part of a submap that so many scans, the last one at a pose, use up."""
    return max(scans / _SCANS, middle.distance_to(pose) / _LENGTH_M)
