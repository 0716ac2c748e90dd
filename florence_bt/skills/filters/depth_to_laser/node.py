"""The node ``kinect_laser``: :class:`DepthProjecting` on ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaserParameters, ThrottleParameters
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters
from florence_bt.skills.filters.depth_to_laser.projecting import DepthProjecting


class FakeLaserNode(FlorenceNode):
    """Subscribes ``camera/depth/image`` and ``camera/depth/camera_info``, publishes ``kinect_scan``,
    ``kinect_low_scan`` of what is too low for that, and ``kinect_overhang_scan``.
    """

    parameter_classes = (FakeLaserParameters, LowObstacleParameters, OverhangParameters, ThrottleParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("kinect_laser", parameters=parameters, namespace=namespace)
        DepthProjecting(
            RosPorts(self),
            self.read_parameters(FakeLaserParameters),
            self.read_parameters(LowObstacleParameters),
            self.read_parameters(OverhangParameters),
            self.read_parameters(ThrottleParameters),
        )
