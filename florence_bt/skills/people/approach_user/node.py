"""The node ``approach_user``: :class:`Approaching` on ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.people.approach_user.approaching import Approaching, ApproachParameters
from florence_bt.skills.robot_description.room import RoomParameters


class ApproachNode(FlorenceNode):
    """Serves ``approach_user/propose`` and publishes ``approach_user/status``.

    Args:
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (ApproachParameters, RoomParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("approach_user", parameters=parameters)
        own = self.read_parameters(ApproachParameters)
        Approaching(RosPorts(self), own, self.read_parameters(RoomParameters))
