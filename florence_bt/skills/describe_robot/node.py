"""The node ``robot_description``: static transforms at once, and the URDF text (document, section 3.2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from std_msgs.msg import String

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.ros.tf import StaticTransformBroadcaster
from florence_bt.skills.describe_robot.description import DescriptionParameters, load_description


class RobotDescriptionNode(FlorenceNode):
    """Publishes ``/tf_static`` in one message and ``robot_description``, both latched, once."""

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("robot_description", parameters=parameters, namespace=namespace)
        robot = load_description(self.read_parameters(DescriptionParameters).file)
        self._broadcaster = StaticTransformBroadcaster(self)
        self._broadcaster.send(list(robot.frames))
        self._publisher = self.create_publisher(String, "robot_description", LATCHED)
        self._publisher.publish(String(data=robot.urdf_text))
