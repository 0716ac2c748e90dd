"""What missions may ask of the user tracker."""

from __future__ import annotations

from florence_bt.core.declaration import Kind, Port, SkillDeclaration

NO_USER_SEEN, NO_PICTURE = 1, 2
"""Error codes of the action ``look_for_user`` for the failures of these names."""

START_TRACKER = SkillDeclaration(
    name="start_tracker",
    summary="Start the user tracker with an empty memory",
    failures={"tracker_failed": "the tracker answered that it cannot"},
    deadline_s=5.0,
)

STOP_TRACKER = SkillDeclaration(
    name="stop_tracker",
    summary="Stop the user tracker and forget whom it tracked",
    failures={"tracker_failed": "the tracker answered that it cannot"},
    deadline_s=5.0,
)

LOOK_FOR_USER = SkillDeclaration(
    name="look_for_user",
    summary="Stand still and look whether a person is in front of the camera",
    inputs={
        "window": Port(Kind.DURATION, "how long to look at most", default=5.0, minimum=0.5, maximum=15.0),
    },
    outputs={
        "user": Port(Kind.POSE, "where the person is; the yaw points from the person to the robot"),
        "distance": Port(Kind.LENGTH, "horizontal distance between the camera and the person"),
        "user_id": Port(Kind.INTEGER, "the persistent id of the person"),
    },
    failures={
        "no_user_seen": "nobody was in front of the camera during the whole window",
        "no_picture": "the camera gave too few usable pictures to tell whether somebody is there",
    },
    deadline_s=20.0,
    server_codes={NO_USER_SEEN: "no_user_seen", NO_PICTURE: "no_picture"},
)

DECLARATIONS = (START_TRACKER, STOP_TRACKER, LOOK_FOR_USER)
