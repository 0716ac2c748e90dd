"""Bindings of the skill that proposes where to approach a user."""

from __future__ import annotations

from typing import Any

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ServiceBinding
from florence_bt.core.skill import Inputs


def _request(inputs: Inputs) -> dict[str, Any]:
    user, robot = inputs["user"], inputs["robot"]
    return {
        "user_x": user.x,
        "user_y": user.y,
        "robot_x": robot.x,
        "robot_y": robot.y,
        "safe_distance": inputs["safe_distance"],
        "trial": inputs["trial"],
    }


def _proposed(message: Any) -> Result:
    if not message.valid:
        return failure("pose_occupied", message.message or "the proposed pose is not free")
    return success(pose=Pose2(message.x, message.y, message.phi))


BINDINGS = (
    ServiceBinding(
        skill="propose_approach_pose",
        interface="florence_interfaces/srv/ProposeApproach",
        name="approach_user/propose",
        request=_request,
        result=_proposed,
    ),
)
