"""A cloud of poses that follows the odometry and is sorted out by the laser."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.skills.navigation.localisation._kernels import resample_systematic, weigh_particles
from florence_bt.skills.navigation.localisation.likelihood_field import LikelihoodField
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters

_CLUSTER_DISTANCE_M = 0.6
"""Distance from the best particle within which others count for the pose, with the angle below. Chosen."""
_CLUSTER_ANGLE = math.radians(30.0)


class ParticleFilter:
    """Monte Carlo localisation with the likelihood field.

    Attributes:
        particles: Shape (n, 3): x, y, yaw in the map frame.
        weights: Shape (n,), sum 1.

    Source:
        REFERENCE 7.7; Probabilistic Robotics, table 8.2.
    """

    def __init__(
        self, field: LikelihoodField, parameters: LocaliserParameters, random: np.random.Generator
    ) -> None:
        self._field = field
        self._parameters = parameters
        self._random = random
        self._updates = 0
        self.particles = np.zeros((parameters.particles, 3))
        self.weights = np.full(parameters.particles, 1.0 / parameters.particles)
        self._cubes: NDArray[np.float32] = np.empty((0, 0), np.float32)
        self._cubes_range = -1.0

    def set_pose(self, pose: Pose2, standard_deviations: tuple[float, float, float]) -> None:
        """Start again around a pose (map frame; deviations of x, y in metres and of yaw in radians)."""
        count = self._parameters.particles
        spread = self._random.standard_normal((count, 3)) * np.array(standard_deviations)
        self.particles = np.array([pose.x, pose.y, pose.yaw]) + spread
        self.weights = np.full(count, 1.0 / count)
        self._updates = 0

    def move(self, motion: Pose2, covariance: NDArray[np.float64]) -> None:
        """Move every particle as the odometry says, each with its own error.

        Args:
            motion: The new pose of the base seen from the old one, by odometry.
            covariance: Shape (3, 3), of what this odometry knows to be unsure of: x, y, yaw in the new pose.

        Source:
            REFERENCE 7.7, motion (diff), with the square roots of Nav2.
        """
        p = self._parameters
        way = math.hypot(motion.x, motion.y)
        turn1 = math.atan2(motion.y, motion.x) if way >= 0.01 else 0.0
        turn2 = normalize_angle(motion.yaw - turn1)
        noise1, noise2 = _turn_for_noise(turn1), _turn_for_noise(turn2)
        random = self._random.standard_normal((3, len(self.particles)))
        turns1 = turn1 + random[0] * math.sqrt(p.alpha1 * noise1**2 + p.alpha2 * way**2)
        ways = way + random[1] * math.sqrt(p.alpha3 * way**2 + p.alpha4 * (noise1**2 + noise2**2))
        turns2 = turn2 + random[2] * math.sqrt(p.alpha1 * noise2**2 + p.alpha2 * way**2)
        heading = self.particles[:, 2] + turns1
        self.particles[:, 0] += ways * np.cos(heading)
        self.particles[:, 1] += ways * np.sin(heading)
        yaw = heading + turns2
        drift = self._random.multivariate_normal(np.zeros(3), covariance, len(self.particles))
        c, s = np.cos(yaw), np.sin(yaw)
        self.particles[:, 0] += c * drift[:, 0] - s * drift[:, 1]
        self.particles[:, 1] += s * drift[:, 0] + c * drift[:, 1]
        self.particles[:, 2] = _wrap(yaw + drift[:, 2])

    def weigh(self, points: NDArray[np.float64], range_max: float) -> None:
        """Weigh every particle by a scan.

        Args:
            points: Shape (m, 2), beam ends in the base frame.
            range_max: Longest range of the scanner in metres.
        """
        if self._cubes_range != range_max:
            self._cubes, self._cubes_range = self._cube_table(range_max), range_max
        field = self._field
        likelihood = weigh_particles(
            self.particles,
            points,
            self._cubes,
            field.normals,
            float((self._parameters.z_rand / range_max) ** 3),
            field.origin_x,
            field.origin_y,
            field.resolution,
        )
        # What the map does not explain, in rooms that it has not seen or after furniture was moved, would
        # draw the particles to whatever of it looks alike.
        p = self._parameters
        explained = (float(likelihood.max()) - 1.0) / (len(points) * p.z_hit**3)
        trust = min(1.0, max(0.0, (explained - p.match_least_fit) / (p.match_full_fit - p.match_least_fit)))
        weights = self.weights * likelihood**trust
        self.weights = weights / weights.sum()

    def _cube_table(self, range_max: float) -> NDArray[np.float32]:
        p = self._parameters
        hit = p.z_hit * np.exp(-(self._field.signed.astype(float) ** 2) / (2.0 * p.sigma_hit**2))
        return np.ascontiguousarray((hit + p.z_rand / range_max) ** 3, np.float32)

    def estimate(self) -> tuple[Pose2, NDArray[np.float64]]:
        """Return the mean and covariance (3, 3) of x, y, yaw over the heaviest cluster of particles."""
        x, y, yaw = self.particles.T
        column, row = np.floor(x / 0.5), np.floor(y / 0.5)
        sector = np.floor(_wrap(yaw) / math.radians(10.0))
        # One number per bin, in the order of (column, row, sector): sorting rows of three is slow.
        rows = row.max() - row.min() + 1.0
        bins = ((column - column.min()) * rows + (row - row.min())) * 64.0 + (sector + 32.0)
        _, which = np.unique(bins, return_inverse=True)
        heaviest = int(np.argmax(np.bincount(which, weights=self.weights)))
        mean = self._mean(which == heaviest)
        near = (np.hypot(x - mean[0], y - mean[1]) < _CLUSTER_DISTANCE_M) & (
            np.abs(_wrap(yaw - mean[2])) < _CLUSTER_ANGLE
        )
        mean = self._mean(near)
        weights = self.weights[near] / self.weights[near].sum()
        offsets = self.particles[near] - mean
        offsets[:, 2] = _wrap(offsets[:, 2])
        covariance = (offsets * weights[:, None]).T @ offsets
        return Pose2(float(mean[0]), float(mean[1]), float(mean[2])), covariance

    def _mean(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        weights = self.weights[chosen] / self.weights[chosen].sum()
        x, y, yaw = self.particles[chosen].T
        angle = math.atan2(float(weights @ np.sin(yaw)), float(weights @ np.cos(yaw)))
        return np.array([float(weights @ x), float(weights @ y), angle])

    def inject(self, pose: Pose2, covariance: NDArray[np.float64], fraction: float) -> None:
        """Replace some particles by others around a pose, so that the cloud follows a good fit.

        Args:
            pose: In the map frame.
            covariance: How far around: shape (3, 3), of x, y, yaw.
            fraction: The part of the particles; which ones is left to chance.
        """
        count = int(fraction * len(self.particles))
        if count == 0:
            return
        drawn = self._random.permutation(len(self.particles))[:count]
        self.particles[drawn] = self._random.multivariate_normal(
            [pose.x, pose.y, pose.yaw], covariance, count
        )
        self.weights[drawn] = self.weights.mean()
        self.weights /= self.weights.sum()

    def resample(self) -> None:
        """Resample in proportion to the weights, at every ``resample_interval``-th call."""
        self._updates += 1
        if self._updates % self._parameters.resample_interval:
            return
        count = self._parameters.particles
        drawn = resample_systematic(self.weights, float(self._random.random()), count)
        self.particles = self.particles[drawn]
        self.weights = np.full(count, 1.0 / count)


def _turn_for_noise(turn: float) -> float:
    """Return a turn's size for the noise: backwards is half a circle, but no noisier than forwards."""
    return min(abs(turn), abs(normalize_angle(turn - math.pi)))


def _wrap(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return (angles + math.pi) % math.tau - math.pi
