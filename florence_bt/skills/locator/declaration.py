"""What missions may ask of the locator."""

from __future__ import annotations

from florence_bt.core.declaration import Kind, Port, SkillDeclaration

GET_USER_ROOM = SkillDeclaration(
    name="get_user_room",
    summary="Tell the room where the user was last known to be",
    outputs={"room": Port(Kind.TEXT, "the label of the room", names="room")},
    failures={"user_unknown": "nobody has told yet where the user is"},
    deadline_s=5.0,
    instant=True,
)

GET_HOTSPOT = SkillDeclaration(
    name="get_hotspot",
    summary="Tell the pose that belongs to the label of a room or an object",
    inputs={"label": Port(Kind.TEXT, "the label of the hotspot", names="hotspot")},
    outputs={"pose": Port(Kind.POSE, "where the robot is to stand")},
    failures={"unknown_hotspot": "no hotspot has this label"},
    deadline_s=5.0,
    instant=True,
)

ROBOT_IN_ROOM = SkillDeclaration(
    name="robot_in_room",
    summary="Check that the robot is in a room",
    inputs={"room": Port(Kind.TEXT, "the label of the room", names="room")},
    failures={
        "elsewhere": "the robot is in another room",
        "no_pose": "the robot does not know where it is",
    },
    deadline_s=5.0,
    instant=True,
)

GET_ROBOT_POSE = SkillDeclaration(
    name="get_robot_pose",
    summary="Tell where the robot is",
    outputs={"pose": Port(Kind.POSE, "the robot's pose")},
    failures={"no_pose": "the robot does not know where it is"},
    deadline_s=5.0,
    instant=True,
)

SET_USER_POSITION = SkillDeclaration(
    name="set_user_position",
    summary="Remember where the user is, unless the map has an obstacle there",
    inputs={"user": Port(Kind.POSE, "where the user is")},
    deadline_s=5.0,
    instant=True,
)

DECLARATIONS = (GET_USER_ROOM, GET_HOTSPOT, ROBOT_IN_ROOM, GET_ROBOT_POSE, SET_USER_POSITION)
