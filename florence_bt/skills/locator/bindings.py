"""Bindings of the skills of the locator."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from florence_bt.core.errors import closest_first
from florence_bt.core.geometry import Pose2, yaw_of_quaternion
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ServiceBinding
from florence_bt.core.skill import Inputs

NO_POSE = "the robot does not know where it is: no transform from map to base_link"
USER_UNKNOWN = "nobody has said yet where the user is (setUserPosRoom or setUserPosXYPhi would)"


def _pose(message: Any) -> Pose2:
    return Pose2(message.x, message.y, message.phi)


def _views(message: Any) -> Result:
    if not message.valid:
        return failure("unknown_room", message.message)
    turns = [(pose.position, pose.orientation) for pose in message.poses]
    return success(poses=tuple(Pose2(p.x, p.y, yaw_of_quaternion(q.x, q.y, q.z, q.w)) for p, q in turns))


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
        skill="get_user_room",
        interface="florence_interfaces/srv/GetUserSeen",
        name="florenceLocator/getUserSeen",
        result=lambda message: (
            success(room=message.room, age=message.age, source=message.source)
            if message.valid
            else failure("user_unknown", USER_UNKNOWN)
        ),
    ),
    ServiceBinding(
        skill="get_hotspot",
        interface="florence_interfaces/srv/GetHotspot",
        name="florenceLocator/getHotspot",
        request=dict,
        result=lambda message: (
            success(pose=_pose(message)) if message.valid else failure("unknown_hotspot", message.message)
        ),
    ),
    ServiceBinding(
        skill="get_views",
        interface="florence_interfaces/srv/GetViews",
        name="florenceLocator/getViews",
        request=dict,
        result=_views,
    ),
    ServiceBinding(
        skill="robot_in_room",
        interface="florence_interfaces/srv/GetRoom",
        name="florenceLocator/getRobotPosRoom",
        result=lambda message: success(room=message.room) if message.valid else failure("no_pose", NO_POSE),
        judge=_in_room,
    ),
    ServiceBinding(
        skill="get_robot_pose",
        interface="florence_interfaces/srv/GetXYPhi",
        name="florenceLocator/getRobotPosXYPhi",
        result=lambda message: success(pose=_pose(message)) if message.valid else failure("no_pose", NO_POSE),
    ),
    ServiceBinding(
        skill="get_rooms",
        interface="std_srvs/srv/Trigger",
        name="florenceLocator/getRooms",
        result=lambda message: success(rooms=message.message),
        judge=_rooms,
    ),
    ServiceBinding(
        skill="set_user_position",
        interface="florence_interfaces/srv/SetXYPhi",
        name="florenceLocator/setUserPosXYPhi",
        request=lambda inputs: {"x": inputs["user"].x, "y": inputs["user"].y, "phi": inputs["user"].yaw},
        result=lambda message: success() if message.success else failure("bad_input", message.message),
    ),
)
