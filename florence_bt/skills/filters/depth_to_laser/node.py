"""The node ``kinect_laser``: depth pictures in, and three scans of them out.

Source: document, section 3.7.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.errors import FlorenceError
from florence_bt.core.sensing import CameraModel
from florence_bt.ros.conversions import camera_model_from_ros, depth_from_ros, scan_to_ros, stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR
from florence_bt.skills.filters.depth_to_laser.fake_laser import (
    FakeLaser,
    FakeLaserParameters,
    Throttle,
    ThrottleParameters,
)
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters, LowObstacles
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters, Overhangs

WARN_EVERY_S = 5.0


class FakeLaserNode(FlorenceNode):
    """Subscribes ``camera/depth/image`` and ``camera/depth/camera_info``, publishes ``kinect_scan``,
    ``kinect_low_scan`` of what is too low for that, and ``kinect_overhang_scan``.

    Works only while there is a subscriber, as the old nodelet did (REFERENCE 6.1).
    """

    parameter_classes = (FakeLaserParameters, LowObstacleParameters, OverhangParameters, ThrottleParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("kinect_laser", parameters=parameters, namespace=namespace)
        tall, low = self.read_parameters(FakeLaserParameters), self.read_parameters(LowObstacleParameters)
        self._laser = FakeLaser(tall)
        self._low = LowObstacles.between(tall, low)
        self._overhangs = Overhangs.within(tall, self.read_parameters(OverhangParameters))
        self._throttle = Throttle(self.read_parameters(ThrottleParameters))
        self._camera: CameraModel | None = None
        self._publisher = self.create_publisher(LaserScanMsg, "kinect_scan", SENSOR)
        self._low_publisher = self.create_publisher(LaserScanMsg, "kinect_low_scan", SENSOR)
        self._overhang_publisher = self.create_publisher(LaserScanMsg, "kinect_overhang_scan", SENSOR)
        self.create_subscription(CameraInfo, "camera/depth/camera_info", self._on_camera, SENSOR)
        self.create_subscription(Image, "camera/depth/image", self._on_picture, SENSOR)

    def _on_camera(self, message: CameraInfo) -> None:
        try:
            self._camera = camera_model_from_ros(message)
        except FlorenceError as error:
            self._warn(f"camera information dropped: {error}")

    def _on_picture(self, message: Image) -> None:
        if self._camera is None or self._publisher.get_subscription_count() == 0:
            return
        if not self._throttle.admits(self.time_of(stamp_from_ros(message.header.stamp))):
            return
        try:
            picture = depth_from_ros(message, self._camera)
            scan = self._laser.project(picture)
        except FlorenceError as error:
            self._warn(f"depth picture dropped: {error}")
            return
        self._publisher.publish(scan_to_ros(scan))
        if self._low is not None:
            self._low_publisher.publish(scan_to_ros(self._low.project(picture, scan)))
        if self._overhangs is not None:
            self._overhang_publisher.publish(scan_to_ros(self._overhangs.project(picture)))

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=WARN_EVERY_S)
