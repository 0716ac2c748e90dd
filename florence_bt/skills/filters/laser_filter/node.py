"""The node ``laser_filter``: :class:`LaserFiltering` on ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.filters.laser_filter.filtering import LaserFiltering, LaserFilterTopics
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilterParameters


class LaserFilterNode(FlorenceNode):
    """Filters every scan as it comes."""

    parameter_classes = (LaserFilterParameters, LaserFilterTopics)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("laser_filter", parameters=parameters, namespace=namespace)
        own = self.read_parameters(LaserFilterParameters)
        LaserFiltering(RosPorts(self), own, self.read_parameters(LaserFilterTopics))
