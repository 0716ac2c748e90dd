"""What missions may ask about the approach of a user, and how it is served."""

from __future__ import annotations

from typing import Any

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ServiceBinding
from florence_bt.core.skill import Inputs

PROPOSE_APPROACH_POSE = SkillDeclaration(
    name="propose_approach_pose",
    summary="Propose where to stand in front of a person, another place for each of six trials",
    inputs={
        "user": Port(Kind.POSE, "where the person is"),
        "robot": Port(Kind.POSE, "where the robot was when the approach began; the same for all trials"),
        "trial": Port(
            Kind.INTEGER,
            "1 straight ahead, 2 and 3 to either side, 4 to 6 other places as near as the robot gets",
            default=1,
            minimum=1,
            maximum=6,
        ),
        "safe_distance": Port(
            Kind.LENGTH, "how far from the person the robot stops", default=0.5, minimum=0.3, maximum=2.0
        ),
    },
    outputs={"pose": Port(Kind.POSE, "where to stand, facing the person")},
    failures={"pose_occupied": "the proposed place is not free, or there is none to propose"},
    groups=(CodeGroup("unreachable", frozenset({"pose_occupied"})),),
    deadline_s=5.0,
)


def _request(inputs: Inputs) -> dict[str, Any]:
    user, robot = inputs["user"], inputs["robot"]
    return {
        "user_x": user.x,
        "user_y": user.y,
        "robot_x": robot.x,
        "robot_y": robot.y,
        "safe_distance": float(inputs["safe_distance"]),
        "trial": inputs["trial"],
    }


def _proposed(message: Any) -> Result:
    if not message.valid:
        return failure("pose_occupied", message.message or "the proposed pose is not free")
    return success(pose=Pose2(message.x, message.y, message.phi))


BINDINGS = (
    ServiceBinding(
        skill=PROPOSE_APPROACH_POSE,
        interface="florence_interfaces/srv/ProposeApproach",
        name="approach_user/propose",
        request=_request,
        result=_proposed,
        component="approach",
        start_in_rig=lambda propose, inputs: propose(**inputs),
    ),
)
