"""The node ``localiser``: :class:`Localising` on ROS (document, section 3.3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import PoseArray

from florence_bt.ros.conversions import pose_array_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.navigation.localisation.localising import (
    PARTICLES,
    Localising,
    LocalisingParameters,
    Particles,
)
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters


class LocaliserNode(FlorenceNode):
    """Publishes where the robot is: ``map -> odom`` and ``amcl_pose``.

    Attributes:
        localising: What does it.
    """

    parameter_classes = (LocaliserParameters, LocalisingParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("localiser", parameters=parameters, namespace=namespace)
        self.localising = Localising(
            RosPorts(self, {PARTICLES: self._particles}),
            self.read_parameters(LocaliserParameters),
            self.read_parameters(LocalisingParameters),
        )
        self.on_close(self.localising.close)

    def _particles(self, cloud: Particles) -> PoseArray:
        return pose_array_to_ros(cloud.poses, cloud.frame, self.stamp(cloud.stamp))
