"""The node ``laser_combinator``: ``scan`` and ``kinect_scan`` in, ``scan_combined`` out.

Source: document, section 3.7.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.conversions import scan_from_ros, scan_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR
from florence_bt.ros.tf import TransformListener
from florence_bt.skills.filters.laser_combinator.combinator import LaserCombinator
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters


class LaserCombinatorNode(FlorenceNode):
    """Combines whenever a Kinect scan comes and both scans are fresh."""

    parameter_classes = (CombinatorParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("laser_combinator", parameters=parameters, namespace=namespace)
        self._combinator = LaserCombinator(self.read_parameters(CombinatorParameters))
        # Frames are needed to move the Kinect's points only, and only until the mounting is known.
        self._transforms = TransformListener(self) if self._combinator.parameters.project_origin else None
        self._publisher = self.create_publisher(LaserScanMsg, "scan_combined", SENSOR)
        self.create_subscription(LaserScanMsg, "scan", self._on_laser, SENSOR)
        self.create_subscription(LaserScanMsg, "kinect_scan", self._on_kinect, SENSOR)

    def _on_laser(self, message: LaserScanMsg) -> None:
        self._publish(self._combinator.update_laser(self.timed(scan_from_ros(message)), self.timebase.now()))

    def _on_kinect(self, message: LaserScanMsg) -> None:
        self._learn_mounting(self._combinator.parameters.kinect_frame_id or message.header.frame_id)
        self._publish(self._combinator.update_kinect(self.timed(scan_from_ros(message)), self.timebase.now()))

    def _learn_mounting(self, kinect_frame: str) -> None:
        laser_frame = self._combinator.laser_frame
        if self._transforms is None or laser_frame is None:
            return
        try:
            self._combinator.laser_from_kinect = self._transforms.buffer.lookup(laser_frame, kinect_frame)
        except TransformUnavailable as error:
            self.get_logger().warning(f"nothing combined yet: {error}", throttle_duration_sec=5.0)
            return
        self.call_soon(self._transforms.close)
        self._transforms = None

    def _publish(self, scan: LaserScan | None) -> None:
        if scan is not None:
            self._publisher.publish(scan_to_ros(self.stamped(scan)))
