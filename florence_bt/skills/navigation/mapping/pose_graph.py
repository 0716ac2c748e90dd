"""The poses of the kept scans, and what is known of how they lie to each other; gtsam does the arithmetic.

Source: Dellaert and Kaess, Factor graphs for robot perception, 2017.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.installation import how_to_get

_FIRST = (1e-3, 1e-3, 1e-4)
"""Standard deviations of the first pose, which nothing else holds, in metres and radians."""
_CAUCHY = 2.0
"""From so many standard deviations on a tie counts less and less: it may be wrong."""
_TIE_M = 0.5
"""A recognised place is as unsure as so many metres of way."""


@dataclass(frozen=True, slots=True)
class Tie:
    """A constraint between two poses.

    Attributes:
        first: Number of the one.
        second: Number of the other.
        relative: The second one as seen from the first.
        covariance: Shape (3, 3), of x, y, yaw, in the second one's frame.
        way: How unsure that is, in metres of way that make the odometry as unsure.
    """

    first: int
    second: int
    relative: Pose2
    covariance: NDArray[np.float64]
    way: float = _TIE_M


def import_gtsam() -> Any:
    """Load gtsam, which is large and not everybody needs.

    Raises:
        ConfigError: It is not installed.
    """
    try:
        import gtsam
    except ModuleNotFoundError as error:
        if error.name != "gtsam":
            raise
        raise ConfigError(
            "mapping needs gtsam, which is not installed", valid=[how_to_get("gtsam")]
        ) from error
    return gtsam


class PoseGraph:
    """Poses with ties between them.

    Attributes:
        poses: In the map frame; the first one stays where it is.
        ties: All that is known, in the order in which it became known.
    """

    def __init__(self, first: Pose2) -> None:
        self._gtsam = gtsam = import_gtsam()
        self.poses = [first]
        self.ties: list[Tie] = []
        self._factors = gtsam.NonlinearFactorGraph()
        held = gtsam.noiseModel.Diagonal.Sigmas(np.array(_FIRST))
        self._factors.add(gtsam.PriorFactorPose2(0, _to_gtsam(gtsam, first), held))

    def add_step(self, step: Tie) -> None:
        """Add the pose that follows the last one."""
        self.poses.append(self.poses[-1] @ step.relative)
        self.add_tie(step)

    def add_tie(self, tie: Tie) -> None:
        """Tie two poses together. They move in :meth:`optimise`."""
        gtsam = self._gtsam
        self.ties.append(tie)
        kernel = gtsam.noiseModel.mEstimator.Cauchy.Create(_CAUCHY)
        noise = gtsam.noiseModel.Robust.Create(kernel, gtsam.noiseModel.Gaussian.Covariance(tie.covariance))
        relative = _to_gtsam(gtsam, tie.relative)
        self._factors.add(gtsam.BetweenFactorPose2(tie.first, tie.second, relative, noise))

    def optimise(self) -> None:
        """Move the poses to where they agree best with all ties."""
        gtsam = self._gtsam
        values = gtsam.Values()
        for number, pose in enumerate(self.poses):
            values.insert(number, _to_gtsam(gtsam, pose))
        best = gtsam.LevenbergMarquardtOptimizer(self._factors, values).optimize()
        for number in range(len(self.poses)):
            found = best.atPose2(number)
            self.poses[number] = Pose2(found.x(), found.y(), found.theta())

    def ways_from(self, number: int) -> NDArray[np.float64]:
        """Return how unsurely each pose lies to one of them: the shortest way along the ties, metres."""
        count = len(self.poses)
        edges = np.array([(tie.first, tie.second, tie.way) for tie in self.ties]).reshape(-1, 3)
        first, second = edges[:, :2].astype(int).T
        # The least way: a matrix without it would have no edge there.
        links = coo_array((np.maximum(edges[:, 2], 1e-6), (first, second)), shape=(count, count)).tocsr()
        ways: NDArray[np.float64] = dijkstra(links, directed=False, indices=number)
        return ways


def _to_gtsam(gtsam: Any, pose: Pose2) -> Any:
    return gtsam.Pose2(pose.x, pose.y, pose.yaw)
