"""What missions may ask about the approach of a user."""

from __future__ import annotations

from florence_bt.core.declaration import Kind, Port, SkillDeclaration

PROPOSE_APPROACH_POSE = SkillDeclaration(
    name="propose_approach_pose",
    summary="Propose where to stand in front of a person, another place for each of three trials",
    inputs={
        "user": Port(Kind.POSE, "where the person is"),
        "robot": Port(Kind.POSE, "where the robot was when the approach began; the same for all trials"),
        "trial": Port(
            Kind.INTEGER, "1 straight ahead, 2 and 3 to either side", default=1, minimum=1, maximum=3
        ),
        "safe_distance": Port(
            Kind.LENGTH, "how far from the person the robot stops", default=0.5, minimum=0.3, maximum=2.0
        ),
    },
    outputs={"pose": Port(Kind.POSE, "where to stand, facing the person")},
    failures={"pose_occupied": "the proposed place is not free"},
    deadline_s=5.0,
)

DECLARATIONS = (PROPOSE_APPROACH_POSE,)
