"""What missions may ask of the user tracker, and how it is served."""

from __future__ import annotations

from typing import Any

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.serving import ActionBinding, ConditionBinding, ServiceBinding
from florence_bt.core.skill import Inputs

NO_USER_SEEN, NO_IMAGE = 1, 2
"""Error codes of the action ``look_for_user`` for the failures of these names."""

START_TRACKER = SkillDeclaration(
    name="start_tracker",
    summary="Start the user tracker with an empty memory",
    failures={"tracker_failed": "the tracker refused"},
    deadline_s=5.0,
)

STOP_TRACKER = SkillDeclaration(
    name="stop_tracker",
    summary="Stop the user tracker and forget whom it tracked",
    failures={"tracker_failed": "the tracker refused"},
    deadline_s=5.0,
)

LOOK_FOR_USER = SkillDeclaration(
    name="look_for_user",
    summary="Stand still and look whether a person is in front of the camera",
    inputs={
        "window": Port(Kind.DURATION, "how long to look at most", default=5.0, minimum=0.5, maximum=15.0),
        "user_id": Port(
            Kind.INTEGER, "only the person with this id counts; 0: anybody", default=0, minimum=0
        ),
        "x": Port(
            Kind.LENGTH, "only who is within 0.5 m of x and y counts, in front of the robot", default=0.0
        ),
        "y": Port(Kind.LENGTH, "the same, to the left of the robot; both 0: anywhere", default=0.0),
    },
    outputs={
        "user": Port(Kind.POSE, "where the person is; the yaw points from the person to the robot"),
        "distance": Port(Kind.LENGTH, "horizontal distance between the camera and the person"),
        "user_id": Port(Kind.INTEGER, "the persistent id of the person"),
        "posture": Port(
            Kind.TEXT, "standing, sitting, lying, or unknown of who is too near", default="standing"
        ),
        "height": Port(
            Kind.LENGTH,
            "height above the floor of the highest point seen of the person; 0: not known",
            default=0.0,
        ),
    },
    failures={
        "no_user_seen": "nobody was in front of the camera during the whole window",
        "no_image": "the camera gave too few usable images to know whether somebody is there",
    },
    groups=(
        CodeGroup("not_found", frozenset({"no_user_seen"}), "a person is not where they were looked for"),
    ),
    resources=frozenset({"camera"}),
    deadline_s=20.0,
    server_codes={NO_USER_SEEN: "no_user_seen", NO_IMAGE: "no_image"},
)

USER_LYING = SkillDeclaration(
    name="user_lying",
    summary="Check whether somebody whom the user tracker sees lies on the floor",
    failures={"nobody_lies": "nobody is seen to lie on the floor"},
    deadline_s=5.0,
    instant=True,
    reports_changes=True,
)


def _lies(inputs: Inputs, message: Any) -> Result:
    return success() if message.data else failure("nobody_lies", "nobody is seen to lie on the floor")


def _switched(message: Any) -> Result:
    return success() if message.success else failure("tracker_failed", message.message or "it answered no")


def _looked(message: Any, outcome: Outcome) -> Result:
    if outcome is Outcome.CANCELLED:
        return cancelled()
    if not message.found:
        code = LOOK_FOR_USER.server_codes.get(message.error_code, "no_user_seen")
        return failure(code, message.error_msg or "no user seen")
    user = Pose2(message.x, message.y, message.phi)
    return success(
        user=user,
        distance=message.distance,
        user_id=message.user_id,
        posture=message.posture,
        height=message.height,
    )


BINDINGS = (
    ServiceBinding(
        skill=START_TRACKER,
        interface="std_srvs/srv/Trigger",
        name="user_tracker_ni_node/Start",
        result=_switched,
        component="people",
        start_in_rig=lambda people, inputs: people.start_tracker(),
    ),
    ServiceBinding(
        skill=STOP_TRACKER,
        interface="std_srvs/srv/Trigger",
        name="user_tracker_ni_node/Stop",
        result=_switched,
        component="people",
        start_in_rig=lambda people, inputs: people.stop_tracker(),
    ),
    ActionBinding(
        skill=LOOK_FOR_USER,
        interface="florence_interfaces/action/LookForUser",
        name="look_for_user",
        request=lambda inputs: {
            "user_id": inputs["user_id"],
            **{name: float(inputs[name]) for name in ("window", "x", "y")},
        },
        result=_looked,
        feedback=lambda message: f"looking; people seen so far: {message.users_seen}",
        component="people",
        start_in_rig=lambda people, inputs: people.look(**inputs),
    ),
    ConditionBinding(
        skill=USER_LYING, interface="std_msgs/msg/Bool", name="user_lying", judge=_lies, max_age_s=2.0
    ),
)
