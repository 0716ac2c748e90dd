"""The node ``laser_filter``: ``filtered_scan`` and, if wanted, the scans of the Kinect.

Source: document, section 3.5.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.publisher import Publisher
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.errors import ConfigError
from florence_bt.ros.conversions import scan_from_ros, scan_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter, LaserFilterParameters


@dataclass(frozen=True, slots=True)
class LaserFilterTopics:
    """The topics that the node listens to.

    Attributes:
        input_topic: The scan to filter (the document remaps ``scan`` to ``scan_combined``).
        filter_kinect: Whether ``kinect_scan``, ``kinect_low_scan`` and ``kinect_overhang_scan`` are filtered
            too, for costmap layers of their own in which the laser's far beams do not clear what only the
            Kinect sees; and ``scan``, the laser's alone, which tells what of that has left.
    """

    input_topic: str = "scan_combined"
    filter_kinect: bool = False

    def __post_init__(self) -> None:
        if not self.input_topic:
            raise ConfigError(
                "input_topic is empty", valid=("input_topic: scan_combined", "input_topic: scan")
            )


class LaserFilterNode(FlorenceNode):
    """Filters every scan as it comes."""

    parameter_classes = (LaserFilterParameters, LaserFilterTopics)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("laser_filter", parameters=parameters, namespace=namespace)
        self._filter = LaserFilter(self.read_parameters(LaserFilterParameters))
        topics = self.read_parameters(LaserFilterTopics)
        self._connect(topics.input_topic, "filtered_scan")
        if topics.filter_kinect:
            self._connect("scan", "filtered_laser_scan")
            self._connect("kinect_scan", "filtered_kinect_scan")
            self._connect("kinect_low_scan", "filtered_kinect_low_scan")
            self._connect("kinect_overhang_scan", "filtered_kinect_overhang_scan")

    def _connect(self, input_topic: str, output_topic: str) -> None:
        publisher = self.create_publisher(LaserScanMsg, output_topic, SENSOR)

        def on_scan(message: LaserScanMsg) -> None:
            self._pass_on(message, publisher)

        self.create_subscription(LaserScanMsg, input_topic, on_scan, SENSOR)

    def _pass_on(self, message: LaserScanMsg, publisher: Publisher) -> None:
        publisher.publish(scan_to_ros(self._filter.filter(scan_from_ros(message))))
