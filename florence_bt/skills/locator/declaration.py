"""What missions may ask of the locator, and how it is served."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ServiceBinding
from florence_bt.core.skill import Inputs

NO_POSE = "the robot does not know where it is: no transform from map to base_link"
USER_UNKNOWN = "nobody has said yet where the user is (setUserPosRoom or setUserPosXYPhi would)"

GET_USER_ROOM = SkillDeclaration(
    name="get_user_room",
    summary="Look up the room where the user was last known to be, how long ago, and by which sensor",
    outputs={
        "room": Port(Kind.TEXT, "the label of the room", names="room"),
        "age": Port(Kind.DURATION, "how long ago that was"),
        "source": Port(Kind.TEXT, "what said so: a home sensor, or the topic or service that was used"),
    },
    failures={"user_unknown": "nobody has said yet where the user is"},
    deadline_s=5.0,
    instant=True,
)

GET_HOTSPOT = SkillDeclaration(
    name="get_hotspot",
    summary="Look up the pose that belongs to the label of a room or an object",
    inputs={"label": Port(Kind.TEXT, "the label of the hotspot", names="hotspot")},
    outputs={"pose": Port(Kind.POSE, "where the robot is to stand")},
    failures={"unknown_hotspot": "no hotspot has this label"},
    deadline_s=5.0,
    instant=True,
)

GET_VIEW = SkillDeclaration(
    name="get_view",
    summary="Look up a place from which a room can be seen: the hotspot, then what shows most of the rest",
    inputs={
        "room": Port(Kind.TEXT, "the label of the room", names="room"),
        "number": Port(
            Kind.INTEGER, "1 for the hotspot of the room; each number shows something new", minimum=1
        ),
    },
    outputs={"pose": Port(Kind.POSE, "where the robot is to stand, towards what is new there")},
    failures={
        "no_more_views": "the room has no further place that shows something new, or there is no such room"
    },
    deadline_s=10.0,
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
    summary="Look up where the robot is",
    outputs={"pose": Port(Kind.POSE, "the robot's pose")},
    failures={"no_pose": "the robot does not know where it is"},
    deadline_s=5.0,
    instant=True,
)

GET_ROOMS = SkillDeclaration(
    name="get_rooms",
    summary="List the rooms to visit: first where the user is likely to be, then one near the other",
    inputs={
        "rooms": Port(
            Kind.LIST_OF_TEXT,
            "the rooms to visit, in this order; without it all rooms, the likely ones first",
            default=(),
            names="room",
        ),
    },
    outputs={"rooms": Port(Kind.LIST_OF_TEXT, "the labels of the rooms, each once", names="room")},
    failures={"unknown_room": "one of the rooms to visit is not a room"},
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


def _pose(message: Any) -> Pose2:
    return Pose2(message.x, message.y, message.phi)


def _in_room(inputs: Inputs, result: Result) -> Result:
    room = result.outputs["room"]
    if room != inputs["room"]:
        return failure("elsewhere", f"the robot is in {room!r}, not in {inputs['room']!r}")
    return success()


def _rooms(inputs: Inputs, result: Result) -> Result:
    known = _labels(result.outputs["rooms"].split(","))
    wanted = _labels(inputs["rooms"]) or known
    for room in wanted:
        if room not in known:
            close = ", ".join(closest_first(room, known))
            return failure("unknown_room", f"there is no room {room!r} (would have worked: {close})")
    return success(rooms=wanted)


def _labels(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the labels among some texts, each once."""
    labels = (label.strip() for label in texts)
    return tuple(dict.fromkeys(label for label in labels if label))


BINDINGS = (
    ServiceBinding(
        skill=GET_USER_ROOM,
        interface="florence_interfaces/srv/GetUserSeen",
        name="florenceLocator/getUserSeen",
        result=lambda message: (
            success(room=message.room, age=message.age, source=message.source)
            if message.valid
            else failure("user_unknown", USER_UNKNOWN)
        ),
        component="locator",
        start_in_rig=lambda locator, inputs: locator.get_user_room(),
    ),
    ServiceBinding(
        skill=GET_HOTSPOT,
        interface="florence_interfaces/srv/GetHotspot",
        name="florenceLocator/getHotspot",
        request=lambda inputs: {"label": inputs["label"]},
        result=lambda message: (
            success(pose=_pose(message)) if message.valid else failure("unknown_hotspot", message.message)
        ),
        component="locator",
        start_in_rig=lambda locator, inputs: locator.get_hotspot(inputs["label"]),
    ),
    ServiceBinding(
        skill=GET_VIEW,
        interface="florence_interfaces/srv/GetView",
        name="florenceLocator/getView",
        request=lambda inputs: {"room": inputs["room"], "number": inputs["number"]},
        result=lambda message: (
            success(pose=_pose(message)) if message.valid else failure("no_more_views", message.message)
        ),
        component="locator",
        start_in_rig=lambda locator, inputs: locator.get_view(inputs["room"], inputs["number"]),
    ),
    ServiceBinding(
        skill=ROBOT_IN_ROOM,
        interface="florence_interfaces/srv/GetRoom",
        name="florenceLocator/getRobotPosRoom",
        result=lambda message: success(room=message.room) if message.valid else failure("no_pose", NO_POSE),
        judge=_in_room,
        component="locator",
        start_in_rig=lambda locator, inputs: locator.robot_in_room(inputs["room"]),
    ),
    ServiceBinding(
        skill=GET_ROBOT_POSE,
        interface="florence_interfaces/srv/GetXYPhi",
        name="florenceLocator/getRobotPosXYPhi",
        result=lambda message: success(pose=_pose(message)) if message.valid else failure("no_pose", NO_POSE),
        component="locator",
        start_in_rig=lambda locator, inputs: locator.get_robot_pose(),
    ),
    ServiceBinding(
        skill=GET_ROOMS,
        interface="std_srvs/srv/Trigger",
        name="florenceLocator/getRooms",
        result=lambda message: success(rooms=message.message),
        judge=_rooms,
        component="locator",
        start_in_rig=lambda locator, inputs: _rooms(inputs, success(rooms=", ".join(locator.likely_rooms()))),
    ),
    ServiceBinding(
        skill=SET_USER_POSITION,
        interface="florence_interfaces/srv/SetXYPhi",
        name="florenceLocator/setUserPosXYPhi",
        request=lambda inputs: {"x": inputs["user"].x, "y": inputs["user"].y, "phi": inputs["user"].yaw},
        result=lambda message: success() if message.success else failure("bad_input", message.message),
        component="locator",
        start_in_rig=lambda locator, inputs: locator.set_user_position(inputs["user"]),
    ),
)
