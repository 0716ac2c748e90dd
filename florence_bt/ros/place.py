"""Where the robot is in the map, as the document's nodes tell it: ``map -> odom`` and ``amcl_pose``."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import Odometry
from florence_bt.ros.conversions import pose_with_covariance_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.ros.tf import TransformBroadcaster
from florence_bt.ros.topics import AMCL_POSE

ODOMETRY_PERIOD_S = 0.04
"""At the latest after this long the next odometry comes, when the robot stands."""


class PlacePublisher:
    """Publishes the place of the odometry frame in the map, and the robot's pose there.

    Args:
        node: The node that knows.
        map_frame: The map's frame.
        odom_frame: The odometry's frame.
        tolerance: How far ahead of the newest odometry ``map -> odom`` is stamped, seconds.

    Source:
        REFERENCE 7.7.
    """

    def __init__(self, node: FlorenceNode, map_frame: str, odom_frame: str, tolerance: float) -> None:
        self._node = node
        self._map, self._odom, self._tolerance = map_frame, odom_frame, tolerance
        self._broadcaster = TransformBroadcaster(node)
        self._poses = node.create_publisher(PoseWithCovarianceStamped, AMCL_POSE, LATCHED)

    def send_transform(self, map_from_odom: Pose2, odometry: Odometry | None) -> None:
        """Send ``map -> odom``.

        Args:
            map_from_odom: The place of the odometry frame in the map.
            odometry: The newest one, None before the first.
        """
        now = self._node.timebase.now()
        # Behind the odometry, the pose of now is not known.
        known = now if odometry is None else min(now, odometry.stamp + ODOMETRY_PERIOD_S)
        self._broadcaster.send(self._map, self._odom, known + self._tolerance, map_from_odom)

    def publish_pose(self, pose: Pose2, covariance: NDArray[np.float64], stamp: float) -> None:
        """Publish where the robot is.

        Args:
            pose: base_footprint in the map frame.
            covariance: Shape (3, 3), of x, y, yaw.
            stamp: Seconds.
        """
        whole = np.zeros((6, 6))
        whole[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
        message = pose_with_covariance_to_ros(
            pose, whole.ravel().tolist(), self._map, self._node.stamp(stamp)
        )
        self._poses.publish(message)
