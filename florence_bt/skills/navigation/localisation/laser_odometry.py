"""The wheels' odometry, corrected by how each scan fits those just before it.

It needs no map, and it drifts by about a centimetre a metre whatever the wheels say. So it carries the robot
over wheels that slip, and through rooms that the map does not know.

Source: Olson, Real-time correlative scan matching, ICRA 2009; two submaps that overlap as in Hess et al.,
Real-time loop closure in 2D lidar SLAM, ICRA 2016.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.navigation.localisation._kernels import draw_distances
from florence_bt.skills.navigation.localisation.likelihood_field import LikelihoodField
from florence_bt.skills.navigation.localisation.scan_match import evenly, match_scan, search_around

_RESOLUTION_M, _REACH_M = 0.05, 12.0
"""Cells of a submap, and how far from its first scan it reaches."""
_FAR_M = 0.3
"""Where distances to the surfaces of a submap are cut."""
_GAP_M = 0.35
"""Two neighbouring beams that end nearer to each other have met the same surface."""
_KEEP_M, _KEEP_RAD, _SCANS = 0.15, 0.15, 24
"""A scan is kept when the robot has moved so far since the last one that was; this many make a submap, and
after half of them the next submap begins."""
_STEP_M, _STEP_RAD, _NEAR_M, _BEAMS = 0.05, 0.02, 0.2, 60
_LONGEST_M, _LARGEST_RAD = 0.6, 0.6
"""The search: its steps, which beams fit, how many are tried, and how far it reaches at most."""
_SIGMA_M, _FIT_BEAMS, _INDEPENDENT_BEAMS = 0.04, 180, 40.0
_BROKEN_BELOW = 0.5
"""When less of a scan fits, the wheels are believed: somebody stands around the robot, or has carried it."""
_ENOUGH = 0.4
"""When a smaller part of the beams has met anything, the wheels are believed, too: in the middle of a hall
somebody who walks by is most of what is seen, and would take the robot along."""
_SLIP = 0.2
"""The slip of even the best wheels, as a part of the motion."""
_LEAST_ERROR, _LEARNT = (0.01, 0.01), 0.02
"""The wheels' error from scan to scan: metres and radians at least, and how fast the rest is learnt."""


class _Submap:
    """How far it is to what some scans have met, around where the first one was taken."""

    def __init__(self, middle: Pose2) -> None:
        cells = round(2.0 * _REACH_M / _RESOLUTION_M)
        self.field = LikelihoodField(
            resolution=_RESOLUTION_M,
            origin_x=middle.x - _REACH_M,
            origin_y=middle.y - _REACH_M,
            signed=np.full((cells, cells), _FAR_M, np.float32),
            normals=np.zeros((cells, cells, 2), np.float32),
            max_distance=_FAR_M,
        )
        self.scans = 0

    def add(self, pose: Pose2, points: NDArray[np.float64]) -> None:
        field, at = self.field, (pose.x, pose.y, pose.yaw)
        draw_distances(field.signed, points, at, field.frame, _FAR_M, _GAP_M)
        self.scans += 1


class LaserOdometry:
    """Follows the robot from scan to scan.

    How wrong the wheels are is learnt on the way: where the scans say little, along a bare corridor, good
    wheels are believed more than bad ones.

    Attributes:
        pose: base_footprint in a frame of its own, in which the first scan was taken at the origin.
        broken: Whether the newest scan did not fit those before it: the robot may have been carried.
    """

    def __init__(self) -> None:
        self.pose = Pose2()
        self.broken = False
        self._odom: Pose2 | None = None
        self._kept = Pose2()
        self._submaps: list[_Submap] = []
        self._error_d, self._error_a = _LEAST_ERROR

    def update(self, points: NDArray[np.float64], odom_pose: Pose2, beams: int) -> None:
        """Take a scan.

        Args:
            points: Shape (n, 2), beam ends in the base frame, metres, in the order of the beams.
            odom_pose: base_footprint by the wheels' odometry.
            beams: How many the scan has, with those that met nothing.
        """
        if self._odom is not None:
            wheels = self._odom.inverse() @ odom_pose
            if len(points) < _ENOUGH * beams:
                self.pose, self.broken = self.pose @ wheels, False
            else:
                self._follow(points, wheels)
        self._odom = odom_pose
        if self.broken or not self._submaps:
            self._submaps = [_Submap(self.pose)]
        elif self._kept.distance_to(self.pose) < _KEEP_M and _turn(self._kept, self.pose) < _KEEP_RAD:
            return
        self._keep(points)

    def _follow(self, points: NDArray[np.float64], wheels: Pose2) -> None:
        way, turn = math.hypot(wheels.x, wheels.y), abs(wheels.yaw)
        guess = self.pose @ wheels
        field = self._submaps[0].field
        found = search_around(
            field,
            evenly(points, _BEAMS),
            guess,
            # So far is a drive that the wheels take for one in the other direction.
            reach=min(_LONGEST_M, 2.0 * way + _STEP_M),
            turn=min(_LARGEST_RAD, turn + 5.0 * _STEP_RAD),
            step=_STEP_M,
            turn_step=_STEP_RAD,
            near=_NEAR_M,
            cost_d=_cost(self._error_d + _SLIP * way),
            cost_a=_cost(self._error_a + _SLIP * turn),
        )
        if found == guess:
            belief, deviation_d, deviation_a = guess, self._error_d, self._error_a
        else:
            belief, deviation_d, deviation_a = found, _STEP_M, _STEP_RAD
        match = match_scan(
            field,
            evenly(points, _FIT_BEAMS),
            belief,
            np.diag(np.square([deviation_d, deviation_d, deviation_a])),
            sigma=_SIGMA_M,
            independent_beams=_INDEPENDENT_BEAMS,
        )
        self.broken = match.near_fraction < _BROKEN_BELOW
        if self.broken:
            self.pose = guess
            return
        self.pose = match.pose
        self._error_d += _LEARNT * (_LEAST_ERROR[0] + guess.distance_to(self.pose) - self._error_d)
        self._error_a += _LEARNT * (_LEAST_ERROR[1] + _turn(guess, self.pose) - self._error_a)

    def _keep(self, points: NDArray[np.float64]) -> None:
        self._kept = self.pose
        if self._submaps[0].scans >= _SCANS:
            self._submaps.pop(0)
        if len(self._submaps) == 1 and self._submaps[0].scans >= _SCANS // 2:
            self._submaps.append(_Submap(self.pose))
        for submap in self._submaps:
            submap.add(self.pose, points)


def _cost(deviation: float) -> float:
    """What a metre or radian from what the wheels say costs, squared, as a part of the scan."""
    return 0.5 / (_INDEPENDENT_BEAMS * deviation**2)


def _turn(start: Pose2, end: Pose2) -> float:
    return abs(normalize_angle(end.yaw - start.yaw))
