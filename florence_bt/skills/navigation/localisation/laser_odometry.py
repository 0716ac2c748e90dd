"""The wheels' odometry, corrected by how each scan fits those just before it.

It needs no map, and it drifts by about a centimetre a metre whatever the wheels say. So it carries the robot
over wheels that slip, and through rooms that the map does not know. Wheels and scan are fused by what each
can be wrong by: the wheels by what they have slipped lately, the scan, in a bare corridor by any distance.

Source: Olson, Real-time correlative scan matching, ICRA 2009; two submaps that overlap as in Hess et al.,
Real-time loop closure in 2D lidar SLAM, ICRA 2016.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.skills.navigation.localisation.scan_match import (
    Match,
    evenly,
    match_scan,
    search_around,
    turned_covariance,
)
from florence_bt.skills.navigation.localisation.submap import Submap
from florence_bt.skills.navigation.localisation.wheel_slip import WheelSlip

_KEEP_M, _KEEP_RAD = 0.15, 0.15
"""A scan is kept when the robot has moved so far since the last one that was; after half a submap the next
one begins."""
_STEP_M, _STEP_RAD, _NEAR_M, _BEAMS = 0.05, 0.02, 0.2, 60
_LONGEST_M, _LARGEST_RAD, _WIDER, _WIDER_GAIN = 0.6, 0.6, 2, 0.15
"""The search: its steps, which beams fit, how many are tried, how far it reaches at most, and when the scan
does not fit there, how much longer the steps of a wider one are, by which so much more of it has to fit."""
_FARTHEST_M = 4.0
"""No search goes farther, whatever the wheels say: one of 100 m would last for minutes."""
_SIGMA_M, _FIT_BEAMS, _INDEPENDENT_BEAMS = 0.04, 180, 40.0
_BROKEN_BELOW = 0.5
"""Fit of a scan below which the wheels are believed: somebody stands around the robot, or has carried it."""
_ENOUGH = 0.4
"""Part of the beams that met anything below which the wheels are believed, too: in the middle of a hall
somebody who walks by is most of what is seen, and would take the robot along."""
_SLIP, _SLIP_OF_SEARCH = 0.1, 0.2
"""The slip of even the best wheels, as a part of the motion: what holds the fit, and what holds the search,
which has to find the wheels that have just begun to slip (``python tools/localisation.py``)."""


class LaserOdometry:
    """Follows the robot from scan to scan.

    Attributes:
        pose: base_footprint in a frame of its own, in which the first scan was taken at the origin.
        covariance: Shape (3, 3), how sure the newest step is: of x, y, yaw in the robot's frame.
        broken: Whether the newest scan did not fit those before it: the robot may have been carried.
    """

    def __init__(self) -> None:
        self.pose = Pose2()
        self.covariance: NDArray[np.float64] = np.zeros((3, 3))
        self.broken = False
        self._odom: Pose2 | None = None
        self._kept = Pose2()
        self._submaps: list[Submap] = []
        self._slip = WheelSlip()

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
                self._believe(wheels, broken=False)
            else:
                self._follow(points, wheels)
        self._odom = odom_pose
        if self.broken or not self._submaps:
            self._submaps = [Submap(self.pose)]
        elif self._kept.distance_to(self.pose) < _KEEP_M and _turn(self._kept, self.pose) < _KEEP_RAD:
            return
        self._keep(points)

    def _believe(self, wheels: Pose2, *, broken: bool) -> None:
        self.pose, self.broken = self.pose @ wheels, broken
        self.covariance = _covariance(self._slip.deviations(wheels, _SLIP))

    def _follow(self, points: NDArray[np.float64], wheels: Pose2) -> None:
        # Twice the way: the wheels may take a drive for one in the other direction.
        reach = min(_FARTHEST_M, 2.0 * math.hypot(wheels.x, wheels.y) + _STEP_M)
        match = self._match(points, wheels, min(_LONGEST_M, reach), 1)
        if match.near_fraction < _BROKEN_BELOW and reach > _LONGEST_M:
            wider = self._match(points, wheels, reach, _WIDER)
            if wider.near_fraction > match.near_fraction + _WIDER_GAIN:
                match = wider
        if match.near_fraction < _BROKEN_BELOW:
            self._believe(wheels, broken=True)
            return
        error = (self.pose @ wheels).inverse() @ match.pose
        self.pose, self.broken = match.pose, False
        self.covariance = turned_covariance(match.covariance, -match.pose.yaw)
        self._slip.learn(wheels, error, self.covariance)

    def _match(self, points: NDArray[np.float64], wheels: Pose2, reach: float, longer: int) -> Match:
        field, guess = self._submaps[0].field, self.pose @ wheels
        held_d, held_a = self._slip.deviations(wheels, _SLIP_OF_SEARCH)
        found = search_around(
            field,
            evenly(points, _BEAMS),
            guess,
            reach=reach,
            turn=min(_LARGEST_RAD, abs(wheels.yaw) + 5.0 * _STEP_RAD),
            step=longer * _STEP_M,
            turn_step=longer * _STEP_RAD,
            near=_NEAR_M,
            cost_d=_cost(held_d),
            cost_a=_cost(held_a),
        )
        # The wheels may be off by their usual error, and by what the search has found.
        slipped = [found.x - guess.x, found.y - guess.y, angle_difference(found.yaw, guess.yaw)]
        return match_scan(
            field,
            evenly(points, _FIT_BEAMS),
            guess,
            _covariance(self._slip.deviations(wheels, _SLIP)) + np.outer(slipped, slipped),
            sigma=_SIGMA_M,
            independent_beams=_INDEPENDENT_BEAMS,
            start=found,
        )

    def _keep(self, points: NDArray[np.float64]) -> None:
        self._kept = self.pose
        if self._submaps[0].used(self.pose) >= 1.0 and len(self._submaps) > 1:
            self._submaps.pop(0)
        if len(self._submaps) == 1 and self._submaps[0].used(self.pose) >= 0.5:
            self._submaps.append(Submap(self.pose))
        for submap in self._submaps:
            submap.add(self.pose, points)


def _cost(deviation: float) -> float:
    """Return the cost of a metre or radian of deviation from the wheels, squared, as a part of the scan."""
    return 0.5 / (_INDEPENDENT_BEAMS * deviation**2)


def _covariance(deviations: tuple[float, float]) -> NDArray[np.float64]:
    metres, radians = deviations
    return np.diag(np.square([metres, metres, radians]))


def _turn(start: Pose2, end: Pose2) -> float:
    return abs(angle_difference(end.yaw, start.yaw))
