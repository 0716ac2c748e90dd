"""Errors of the wheels' odometry, learnt from what the scans make of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2

_LEAST_M, _LEAST_RAD = 0.01, 0.006
"""A step of the wheels is never surer than this. Measured by ``tools/localisation.py``: with less the heading
is worse on the log from Freiburg; with more a crowd takes a robot that turns along."""
_TURN_PER_M = 0.5
"""A metre straight on may turn the robot as wrongly as a turn of so many radians (chosen)."""
_FIRST_SLIP, _FIRST_M = 0.1, 0.3
"""Believed before anything was learnt, with the weight of a single step of so many metres or radians."""
_FORGET_M = 3.0
"""Metres or radians within which what was learnt fades: a carpet, a kerb, a wheel that spins."""


class WheelSlip:
    """The standard deviation of the wheels' error as a part of the motion.

    The squared error of a step is the one that the fit found, and the variance that it left: along a bare
    corridor, where the scan says nothing of the way, nothing is learnt of it (expectation maximisation).
    """

    def __init__(self) -> None:
        # Squared errors and squared motions, each fading.
        self._way = self._turn = (_FIRST_SLIP**2 * _FIRST_M**2, _FIRST_M**2)

    def deviations(self, wheels: Pose2, least: float) -> tuple[float, float]:
        """Estimate how wrong a step may be.

        Args:
            wheels: The step.
            least: The slip at least, as a part of the motion.

        Returns:
            Standard deviations in metres and radians.
        """
        way, turn = _motion(wheels)
        slip_way, slip_turn = (
            max(least, math.sqrt(error / motion)) for error, motion in (self._way, self._turn)
        )
        return _LEAST_M + slip_way * way, _LEAST_RAD + slip_turn * turn

    def learn(self, wheels: Pose2, error: Pose2, covariance: NDArray[np.float64]) -> None:
        """Learn from a step.

        Args:
            wheels: The step as they told it.
            error: Where the fit has found the robot, seen from where the wheels said.
            covariance: Shape (3, 3), of the fit, in the robot's frame.
        """
        way, turn = _motion(wheels)
        keep = math.exp(-(way + abs(wheels.yaw)) / _FORGET_M)
        self._way = (
            keep * self._way[0] + error.x**2 + covariance[0, 0],
            keep * self._way[1] + way**2,
        )
        self._turn = (
            keep * self._turn[0] + error.yaw**2 + covariance[2, 2],
            keep * self._turn[1] + turn**2,
        )


def _motion(wheels: Pose2) -> tuple[float, float]:
    """Return what the errors of way and turn grow with, in metres and radians."""
    way = math.hypot(wheels.x, wheels.y)
    return way, abs(wheels.yaw) + _TURN_PER_M * way
