"""The node ``laser_combinator``: :class:`LaserCombining` on ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.filters.laser_combinator.combining import LaserCombining
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters


class LaserCombinatorNode(FlorenceNode):
    """Combines whenever a Kinect scan comes and both scans are fresh."""

    parameter_classes = (CombinatorParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("laser_combinator", parameters=parameters, namespace=namespace)
        LaserCombining(RosPorts(self), self.read_parameters(CombinatorParameters))
