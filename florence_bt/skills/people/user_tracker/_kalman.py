"""A constant-velocity Kalman filter in the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

_SEES_POSITION = np.eye(2, 4)
"""The matrix of a measurement: it is of the first two numbers of the state."""
WALKING_SPEED = 0.7
"""Standard deviation of the speed of somebody who was just seen first, m/s."""


class ConstantVelocity:
    """A Kalman filter for the place and velocity of somebody.

    Args:
        position: Shape (2,), metres.
        sigma: Standard deviation of that position, metres.
        acceleration: Standard deviation of the acceleration, m/s^2.

    Attributes:
        state: x, y, and their rates; metres and m/s.
        covariance: Shape (4, 4).
    """

    def __init__(self, position: F64, sigma: float, acceleration: float) -> None:
        self.state = np.concatenate([position, np.zeros(2)])
        self.covariance = np.diag([sigma**2, sigma**2, WALKING_SPEED**2, WALKING_SPEED**2])
        self._acceleration = acceleration

    def predict(self, seconds: float) -> None:
        """Go on for some time without a measurement."""
        step = np.eye(4)
        step[0, 2] = step[1, 3] = seconds
        push = np.array([[0.5 * seconds**2, 0.0], [0.0, 0.5 * seconds**2], [seconds, 0.0], [0.0, seconds]])
        self.state = step @ self.state
        self.covariance = step @ self.covariance @ step.T + self._acceleration**2 * push @ push.T

    def innovation_covariance(self, sigma: float) -> F64:
        """Return the covariance (2, 2), m^2, of a measured position around the expected one."""
        return self.covariance[:2, :2] + sigma**2 * np.eye(2)

    def mahalanobis_squared(self, position: F64, sigma: float) -> float:
        """Return the squared Mahalanobis distance of a measured position, (2,), metres, from the expected."""
        innovation = position - self.state[:2]
        return float(innovation @ np.linalg.solve(self.innovation_covariance(sigma), innovation))

    def update(self, position: F64, sigma: float) -> None:
        """Take a position, shape (2,), that was measured with a standard deviation, metres."""
        gain = np.linalg.solve(self.innovation_covariance(sigma), self.covariance[:2]).T
        self.state = self.state + gain @ (position - self.state[:2])
        self.covariance = (np.eye(4) - gain @ _SEES_POSITION) @ self.covariance

    def halt(self) -> None:
        """Forget the velocity: nobody walks on for ever unseen."""
        self.state[2:] = 0.0
        self.covariance[2:, :2] = self.covariance[:2, 2:] = 0.0
        self.covariance[2:, 2:] = WALKING_SPEED**2 * np.eye(2)
