"""The node ``robot_description``: where the robot's parts are, and the URDF text (document, section 3.2)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import JointState
from std_msgs.msg import String

from florence_bt.core.topic_names import JOINT_STATES, ROBOT_DESCRIPTION
from florence_bt.ros.conversions import stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.tf import StaticTransformBroadcaster, TransformBroadcaster
from florence_bt.skills.robot_description.description import DescriptionParameters, load_description

RESTING_PERIOD_S = 1.0
"""Every process that asks where the robot is reads each message (chosen)."""


class RobotDescriptionNode(FlorenceNode):
    """Publishes ``/tf_static`` in one message and ``robot_description``, both latched, once.

    The wheels follow ``joint_states`` on ``/tf``, as with robot_state_publisher; while none of them turns,
    once in :data:`RESTING_PERIOD_S`. A joint of the description that is in no message has no frame; one that
    the description does not know is left out.
    """

    parameter_classes = (DescriptionParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("robot_description", parameters=parameters, namespace=namespace)
        robot = load_description(self.read_parameters(DescriptionParameters).file)
        self._joints = {joint.name: joint for joint in robot.joints}
        self._broadcaster = StaticTransformBroadcaster(self)
        self._broadcaster.send(list(robot.fixed_frames))
        self._publisher = self.create_publisher(String, ROBOT_DESCRIPTION, LATCHED)
        self._publisher.publish(String(data=robot.urdf_text))
        self._moving = TransformBroadcaster(self)
        self._told: tuple[float, list[float]] = (-math.inf, [])
        self.create_subscription(JointState, JOINT_STATES, self._on_joints, RELIABLE)

    def _on_joints(self, message: JointState) -> None:
        moved = [
            (joint.parent, joint.child, joint.at(position))
            for name, position in zip(message.name, message.position, strict=False)
            if (joint := self._joints.get(name)) is not None
        ]
        when, positions = self.time_of(stamp_from_ros(message.header.stamp)), list(message.position)
        told_at, told = self._told
        if moved and not (positions == told and 0.0 <= when - told_at < RESTING_PERIOD_S):
            self._told = when, positions
            self._moving.send_all(when, moved)
