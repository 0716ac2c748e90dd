"""The robot's place in the map, as the document's nodes tell it: ``map -> odom`` and ``amcl_pose``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.ports import Ports
from florence_bt.core.sensing import Odometry, PoseEstimate
from florence_bt.core.topics import POSE

ODOMETRY_PERIOD_S = 0.04
"""At the latest after this long the next odometry comes, when the robot stands."""


class PlacePublisher:
    """Publishes the place of the odometry frame in the map, and the robot's pose there.

    Args:
        ports: Of the component that knows.
        map_frame: The map's frame.
        odom_frame: The odometry's frame.
        tolerance: How far ahead of the newest odometry ``map -> odom`` is stamped, seconds.

    Source:
        REFERENCE 7.7.
    """

    def __init__(self, ports: Ports, map_frame: str, odom_frame: str, tolerance: float) -> None:
        self._ports = ports
        self._map, self._odom, self._tolerance = map_frame, odom_frame, tolerance
        self._poses = ports.output(POSE)

    def send_transform(self, map_from_odom: Pose2, odometry: Odometry | None) -> None:
        """Send ``map -> odom``.

        Args:
            map_from_odom: The place of the odometry frame in the map.
            odometry: The newest one, None before the first.
        """
        now = self._ports.clock.now()
        # Behind the odometry, the pose of now is not known.
        known = now if odometry is None else min(now, odometry.stamp + ODOMETRY_PERIOD_S)
        self._ports.send_frame(self._map, self._odom, known + self._tolerance, map_from_odom)

    def send_pose(self, pose: Pose2, covariance: NDArray[np.float64], stamp: float) -> None:
        """Send where the robot was.

        Args:
            pose: base_footprint in the map frame.
            covariance: Shape (3, 3), of x, y, yaw.
            stamp: When, seconds.
        """
        self._poses.send(PoseEstimate(stamp, self._map, pose, covariance))
