"""Checks of messages from outside: one per type, in one table. Nothing of ROS is imported here.

The nodes apply the table to every subscription, service and goal (:mod:`florence_bt.ros.node`,
:mod:`florence_bt.ros.action_server`). A type without numbers that could do harm needs no check; neither do
types of other packages, whose skills know best. docs/manual/safety.md has the limits as a table for people.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import MAX_ANGLE_RAD, MAX_DISTANCE_M
from florence_bt.core.sensing import MAX_MAP_CELLS, MAX_RESOLUTION_M, MIN_RESOLUTION_M, upright_size
from florence_bt.core.zones import MAX_CORNERS, MAX_ZONES

NANO = 1_000_000_000
"""Nanoseconds of a second."""
MAX_SPEED_MPS, MAX_TURN_RATE = 100.0, 100.0
"""m/s and rad/s; the limits of the base itself are far below."""
MAX_ACCELERATION = 1_000.0
"""m/s^2"""
MAX_STAMP_OFFSET_S = 10.0
"""Largest difference between the stamp of a reading and the present time."""
MIN_BEAM_STEP_RAD = 1e-5
"""Between two beams of a scan; no laser has a hundredth of it."""
MAX_BEAMS = 20_000
MAX_PIXELS_A_SIDE = 10_000
MAX_FOCAL_LENGTH_PX = 100_000.0
MAX_LOOK_S = 3_600.0
MAX_WAIT_S = 86_400
MOST_CHARGE = 1.1
"""Of the full charge: the capacity of a battery is an estimate, which a fresh one may exceed."""
MAX_NOTE_S = 60.0
MAX_RUN_S = 1e9
"""A run of thirty years."""
MAX_ITEMS = 1_000
"""Transforms or joints in one message."""
MAX_JOY = 100
"""Axes, and buttons, of a gamepad."""
MAX_POSES = 2_000
"""Of a path: 100 m in steps of 5 cm. More would keep the callback, and with it the heartbeat of the process,
for too long: 65 us a pose of another frame (Python 3.11, one core)."""
MAX_NAME = 200
"""Characters of a frame, a label or another name."""
MIN_SQUARED_NORM = 1e-6
"""Of a quaternion; a shorter one has no direction (REFERENCE 7.3)."""

Now = Callable[[float], float]
"""Given a stamp in seconds, the present time to hold it against; zero while that is not known."""
Check = Callable[[Any, Now | None], None]
"""Given a message and the source of the time (None where stamps do not matter); raises BadMessage."""


class BadMessage(FlorenceError):
    """A message holds values that cannot be meant; says what would have worked."""

    def __init__(self, problem: str, valid: str) -> None:
        super().__init__(f"{problem} (would have worked: {valid})")


def type_name(message_type: type) -> str:
    """Return the key of a type in :data:`CHECKS`: ``nav_msgs/Odometry``, ``nav2_msgs/Spin_Goal``."""
    return f"{message_type.__module__.partition('.')[0]}/{message_type.__name__}"


def problem_with(message: Any, now: Now | None = None, message_type: type | None = None) -> str | None:
    """Tell why a message is not to be used, or None when it may be.

    Args:
        message: A message, the request of a service or a goal.
        now: Gives the present time; None where stamps do not matter.
        message_type: The type whose fields it has; its own when not given.
    """
    check = CHECKS.get(type_name(message_type or type(message)))
    if check is None:
        return None
    try:
        check(message, now)
    except BadMessage as error:
        return str(error)
    return None


def check_time(sec: int, nanosec: int, name: str = "the time") -> None:
    """Raise BadMessage when a time cannot be this."""
    if sec < 0 or nanosec >= NANO:
        raise BadMessage(f"{name} is {sec} s and {nanosec} ns", f"0 s and more, 0 to {NANO - 1} ns")


# ---- parts of messages --------------------------------------------------------------------------------


def _within(name: str, value: float, limit: float, unit: str) -> None:
    # Written so that NaN fails too.
    if not -limit <= value <= limit:
        raise BadMessage(f"{name} is {value:g}", f"{-limit:g} to {limit:g} {unit}".rstrip())


def _between(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    if not low <= value <= high:
        raise BadMessage(f"{name} is {value:g}", f"{low:g} to {high:g} {unit}".rstrip())


def _place(name: str, part: Any) -> None:
    for axis, value in (("x", part.x), ("y", part.y), ("z", part.z)):
        _within(f"{name}.{axis}", value, MAX_DISTANCE_M, "m")


def _rotation(name: str, q: Any, shortest: float = MIN_SQUARED_NORM) -> None:
    x, y, z, w = q.x, q.y, q.z, q.w
    if not shortest <= x * x + y * y + z * z + w * w < math.inf:
        raise BadMessage(f"{name} is ({x:g}, {y:g}, {z:g}, {w:g}), not a rotation", "a unit quaternion")


def _velocity(name: str, linear: Any, angular: Any) -> None:
    for axis in "xyz":
        _within(f"{name}linear.{axis}", getattr(linear, axis), MAX_SPEED_MPS, "m/s")
        _within(f"{name}angular.{axis}", getattr(angular, axis), MAX_TURN_RATE, "rad/s")


def _name(name: str, text: str, longest: int = MAX_NAME) -> None:
    if len(text) > longest:
        raise BadMessage(f"{name} has {len(text)} characters", f"at most {longest}")
    if not text.isprintable():
        raise BadMessage(f"{name} is {text!r}", "characters that can be printed")


def _stamp(name: str, stamp: Any, now: Now | None) -> None:
    if now is None:
        return
    if stamp.nanosec >= NANO:
        raise BadMessage(f"{name} has {stamp.nanosec} ns", f"0 to {NANO - 1} ns")
    seconds = stamp.sec + stamp.nanosec * 1e-9
    present = now(seconds)
    ahead = seconds - present
    if present > 0.0 and not -MAX_STAMP_OFFSET_S <= ahead <= MAX_STAMP_OFFSET_S:
        relation = "after" if ahead > 0.0 else "before"
        raise BadMessage(
            f"{name} is {abs(ahead):.1f} s {relation} the present time",
            f"within {MAX_STAMP_OFFSET_S:g} s of it",
        )


def _moment(name: str) -> Check:
    """Make the check of a field that is a time of any age."""

    def check(message: Any, now: Now | None) -> None:
        stamp = getattr(message, name)
        check_time(stamp.sec, stamp.nanosec, name)

    return check


def _clock(message: Any, now: Now | None) -> None:
    check_time(message.clock.sec, message.clock.nanosec)


def _date(message: Any, now: Now | None) -> None:
    check_time(message.sec, message.nanosec)


def _header(header: Any, now: Now | None) -> None:
    _name("header.frame_id", header.frame_id)
    _stamp("header.stamp", header.stamp, now)


# ---- checks made of parts ------------------------------------------------------------------------------


def _numbers(limit: float, unit: str, *names: str) -> Check:
    """Make the check of fields whose absolute value is limited."""

    def check(message: Any, now: Now | None) -> None:
        for name in names:
            _within(name, getattr(message, name), limit, unit)

    return check


def _range(name: str, low: float, high: float, unit: str) -> Check:
    """Make the check of a field between two values."""
    return lambda message, now: _between(name, getattr(message, name), low, high, unit)


def _names(*names: str) -> Check:
    """Make the check of fields that are names."""

    def check(message: Any, now: Now | None) -> None:
        for name in names:
            _name(name, getattr(message, name))

    return check


def _all(*checks: Check) -> Check:
    """Combine several checks, one after the other."""

    def check(message: Any, now: Now | None) -> None:
        for each in checks:
            each(message, now)

    return check


_PLANAR = _all(_numbers(MAX_DISTANCE_M, "m", "x", "y"), _numbers(MAX_ANGLE_RAD, "rad", "phi"))


# ---- whole messages -----------------------------------------------------------------------------------


def _twist(message: Any, now: Now | None) -> None:
    _velocity("", message.linear, message.angular)


def _odometry(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    _place("pose.position", message.pose.pose.position)
    _rotation("pose.orientation", message.pose.pose.orientation)
    twist = message.twist.twist
    _velocity("twist.", twist.linear, twist.angular)


def _transforms(message: Any, now: Now | None) -> None:
    if len(message.transforms) > MAX_ITEMS:
        raise BadMessage(f"{len(message.transforms)} transforms", f"at most {MAX_ITEMS}")
    for one in message.transforms:
        _header(one.header, now)
        _name("child_frame_id", one.child_frame_id)
        if one.child_frame_id == one.header.frame_id:
            raise BadMessage(f"the frame {one.child_frame_id!r} is its own parent", "two frames")
        _place(f"the translation of {one.child_frame_id!r}", one.transform.translation)
        _rotation(f"the rotation of {one.child_frame_id!r}", one.transform.rotation)


def _scan(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    beams = len(message.ranges)
    _between("the number of ranges", beams, 1, MAX_BEAMS)
    if len(message.intensities) not in (0, beams):
        raise BadMessage(f"{len(message.intensities)} intensities for {beams} ranges", f"none or {beams}")
    for name in ("angle_min", "angle_max"):
        _within(name, getattr(message, name), 2 * math.tau, "rad")
    _within("the angle from the first to the last beam", message.angle_increment * beams, 2 * math.tau, "rad")
    if beams > 1 and abs(message.angle_increment) < MIN_BEAM_STEP_RAD:
        raise BadMessage(
            f"angle_increment is {message.angle_increment:g} rad: all {beams} beams go the same way",
            f"{MIN_BEAM_STEP_RAD:g} rad and more",
        )
    _between("range_min", message.range_min, 0.0, MAX_DISTANCE_M, "m")
    _between("range_max", message.range_max, message.range_min, MAX_DISTANCE_M, "m")
    lasts = message.time_increment * beams
    _between("the time from the first to the last beam", lasts, 0.0, MAX_STAMP_OFFSET_S, "s")
    _between("scan_time", message.scan_time, 0.0, MAX_STAMP_OFFSET_S, "s")


def _map(message: Any, now: Now | None) -> None:
    info = message.info
    cells = info.width * info.height
    _between("the number of cells", cells, 1, MAX_MAP_CELLS)
    _between("resolution", info.resolution, MIN_RESOLUTION_M, MAX_RESOLUTION_M, "m")
    _between("the longer side", max(info.width, info.height) * info.resolution, 0.0, MAX_DISTANCE_M, "m")
    if len(message.data) != cells:
        raise BadMessage(
            f"a map of {info.width} x {info.height} cells has {len(message.data)} values", f"{cells} values"
        )
    _place("origin.position", info.origin.position)
    _rotation("origin.orientation", info.origin.orientation)
    turned = info.origin.orientation
    yaw = 2.0 * math.atan2(turned.z, turned.w)
    upright = math.prod(upright_size(info.width, info.height, yaw))
    _between("the number of cells around the turned map", upright, 1, 2 * MAX_MAP_CELLS)


def _image(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    _between("width", message.width, 1, MAX_PIXELS_A_SIDE, "pixels")
    _between("height", message.height, 1, MAX_PIXELS_A_SIDE, "pixels")
    if len(message.data) != message.step * message.height:
        raise BadMessage(
            f"{message.height} rows of {message.step} bytes have {len(message.data)} bytes",
            f"{message.step * message.height} bytes",
        )


def _camera(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    _between("width", message.width, 1, MAX_PIXELS_A_SIDE, "pixels")
    _between("height", message.height, 1, MAX_PIXELS_A_SIDE, "pixels")
    for index in (0, 4):
        _between(f"k[{index}] (the focal length)", message.k[index], 1.0, MAX_FOCAL_LENGTH_PX, "pixels")
    for index in (2, 5):
        _within(f"k[{index}] (the optical axis)", message.k[index], MAX_FOCAL_LENGTH_PX, "pixels")


def _imu(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    for axis in "xyz":
        acceleration = getattr(message.linear_acceleration, axis)
        _within(f"linear_acceleration.{axis}", acceleration, MAX_ACCELERATION, "m/s^2")
        _within(f"angular_velocity.{axis}", getattr(message.angular_velocity, axis), MAX_TURN_RATE, "rad/s")
    _rotation("orientation", message.orientation, shortest=0.0)  # all zeros: not measured


def _joints(message: Any, now: Now | None) -> None:
    _header(message.header, now)
    _between("the number of joints", len(message.name), 0, MAX_ITEMS)
    for values, what in ((message.position, "positions"), (message.velocity, "velocities")):
        if len(values) not in (0, len(message.name)):
            raise BadMessage(f"{len(values)} {what} of {len(message.name)} joints", "one each, or none")
        if not np.isfinite(values).all():
            raise BadMessage(f"{what} that are not finite", "numbers")


def _joy(message: Any, now: Now | None) -> None:
    _between("the number of axes", len(message.axes), 0, MAX_JOY)
    _between("the number of buttons", len(message.buttons), 0, MAX_JOY)
    for index, value in enumerate(message.axes):
        _within(f"axes[{index}]", value, 1.0 + 1e-6, "")


def _pose_stamped(message: Any, now: Now | None) -> None:
    # The time of a goal is not used, and people leave it out.
    _name("header.frame_id", message.header.frame_id)
    _place("pose.position", message.pose.position)
    # What is too short, or tilted, ends the goal that it is meant for: NavigationNode says so.
    _rotation("pose.orientation", message.pose.orientation, shortest=0.0)


def _poses(name: str) -> Check:
    """Make the check of a field that is a list of poses, or a path."""

    def check(message: Any, now: Now | None) -> None:
        field = getattr(message, name)
        poses = getattr(field, "poses", field)
        if len(poses) > MAX_POSES:
            raise BadMessage(f"{name} has {len(poses)} poses", f"at most {MAX_POSES}")
        for pose in poses:
            _pose_stamped(pose, now)

    return check


def _pose_with_covariance(message: Any, now: Now | None) -> None:
    _name("header.frame_id", message.header.frame_id)
    _place("pose.position", message.pose.pose.position)
    _rotation("pose.orientation", message.pose.pose.orientation)
    if not (np.abs(message.pose.covariance) <= MAX_DISTANCE_M**2).all():  # NaN fails too
        raise BadMessage("a covariance that is not finite or too large", f"at most {MAX_DISTANCE_M**2:g}")


def _battery(message: Any, now: Now | None) -> None:
    for name in ("voltage", "current", "charge", "capacity"):  # NaN: not measured
        if math.isinf(getattr(message, name)):
            raise BadMessage(f"{name} is infinite", "a number, or NaN when it is not measured")
    if not math.isnan(message.percentage):
        _between("percentage", message.percentage, 0.0, MOST_CHARGE)


def _parameters(message: Any, now: Now | None) -> None:
    # rclpy 7.1 raises at an unknown type.
    for parameter in message.parameters:
        _between(f"the type of {parameter.name[:MAX_NAME]!r}", parameter.value.type, 0, 9)


def _song(message: Any, now: Now | None) -> None:
    for duration in message.durations:
        _between("a duration", duration, 0.0, MAX_NOTE_S, "s")


def _wait(message: Any, now: Now | None) -> None:
    _between("time.sec", message.time.sec, 0, MAX_WAIT_S, "s")


def _straight(message: Any, now: Now | None) -> None:
    _place("target", message.target)
    _within("speed", message.speed, MAX_SPEED_MPS, "m/s")


_SPEED_LIMITS = (
    _range("max_lin_speed", 0.0, MAX_SPEED_MPS, "m/s"),
    _range("max_ang_speed", 0.0, MAX_TURN_RATE, "rad/s"),
)


def _zones(message: Any, now: Now | None) -> None:
    _between("the number of zones", len(message.zones), 0, MAX_ZONES)
    for zone in message.zones:
        _name("a label", zone.label)
        _between("kind", zone.kind, 0, 1)
        _between("the number of corners", len(zone.area.points), 3, MAX_CORNERS)
        for corner in zone.area.points:
            _place(f"a corner of {zone.label!r}", corner)
        if zone.kind == 1:
            greatest, unit = (100.0, "%") if zone.percentage else (MAX_SPEED_MPS, "m/s")
            if not zone.speed_limit > 0.0:
                raise BadMessage(f"the speed_limit of {zone.label!r} is {zone.speed_limit:g}", "more than 0")
            _between(f"the speed_limit of {zone.label!r}", zone.speed_limit, 0.0, greatest, unit)


def _run_tree(message: Any, now: Now | None) -> None:
    for name in ("run_id", "mission", "state"):
        _name(name, getattr(message, name))
    _between("seconds", message.seconds, -1.0, MAX_RUN_S, "s")
    outputs = len(message.output_names)
    _between("the number of output_values", len(message.output_values), outputs, outputs)
    deepest = 0
    for node in message.nodes:
        _between("status", node.status, 1, 4)
        _between("depth", node.depth, 0, deepest)
        _between("seconds of a node", node.seconds, -1.0, MAX_RUN_S, "s")
        deepest = node.depth + 1


CHECKS: Mapping[str, Check] = {
    "builtin_interfaces/Time": _date,
    "geometry_msgs/Twist": _twist,
    "geometry_msgs/PoseStamped": _pose_stamped,
    "geometry_msgs/PoseWithCovarianceStamped": _pose_with_covariance,
    "nav_msgs/Odometry": _odometry,
    "nav_msgs/OccupancyGrid": _map,
    "rcl_interfaces/SetParameters_Request": _parameters,
    "rcl_interfaces/SetParametersAtomically_Request": _parameters,
    "rosgraph_msgs/Clock": _clock,
    "sensor_msgs/LaserScan": _scan,
    "sensor_msgs/Image": _image,
    "sensor_msgs/CameraInfo": _camera,
    "sensor_msgs/Imu": _imu,
    "sensor_msgs/JointState": _joints,
    "sensor_msgs/BatteryState": _battery,
    "sensor_msgs/Joy": _joy,
    "std_msgs/Float64": _numbers(MAX_DISTANCE_M, "", "data"),
    "tf2_msgs/TFMessage": _transforms,
    "florence_interfaces/DetectedUser": _numbers(MAX_DISTANCE_M, "m", "user_position_x", "user_position_y"),
    # How old a report may be depends on the sensor: HomeSensors judges it.
    "florence_interfaces/HomeEvent": _all(_names("sensor"), _moment("stamp")),
    "florence_interfaces/RunTree": _run_tree,
    "florence_interfaces/RunState": _names("run_id", "mission", "state", "code"),
    "florence_interfaces/TurtlebotSensorState": _all(
        lambda message, now: _header(message.header, now),
        _numbers(MAX_DISTANCE_M, "m", "distance"),
        _numbers(MAX_ANGLE_RAD, "rad", "angle"),
    ),
    "florence_interfaces/UserSeen": _all(_names("room", "source"), _moment("since"), _moment("stamp")),
    "florence_interfaces/Zones": _zones,
    "florence_interfaces/GetHotspot_Request": _names("label"),
    "florence_interfaces/GetViews_Request": _names("room"),
    "florence_interfaces/GotoRoom_Request": _names("room"),
    "florence_interfaces/GotoXYPhi_Request": _PLANAR,
    "florence_interfaces/PlaySong_Request": _song,
    "florence_interfaces/ProposeApproach_Request": _all(
        _numbers(MAX_DISTANCE_M, "m", "user_x", "user_y", "robot_x", "robot_y"),
        _range("safe_distance", 0.0, MAX_DISTANCE_M, "m"),
    ),
    "florence_interfaces/SetHotspot_Request": _all(_names("label"), _PLANAR),
    "florence_interfaces/SetRoom_Request": _names("room"),
    "florence_interfaces/SetXYPhi_Request": _PLANAR,
    "florence_interfaces/ApproachMe_Goal": _all(
        _numbers(MAX_DISTANCE_M, "m", "x", "y"),
        _range("desired_distance", 0.0, MAX_DISTANCE_M, "m"),
        _numbers(MAX_ANGLE_RAD, "rad", "desired_p2r_orientation", "desired_r2p_orientation"),
        *_SPEED_LIMITS,
    ),
    "florence_interfaces/FollowMe_Goal": _all(
        _numbers(MAX_DISTANCE_M, "m", "x", "y"),
        _range("desired_follow_distance", 0.0, MAX_DISTANCE_M, "m"),
        *_SPEED_LIMITS,
    ),
    "florence_interfaces/FollowUser_Goal": _all(_range("distance", 0.0, MAX_DISTANCE_M, "m"), *_SPEED_LIMITS),
    "florence_interfaces/LookForUser_Goal": _all(
        _range("window", 0.0, MAX_LOOK_S, "s"), _numbers(MAX_DISTANCE_M, "m", "x", "y")
    ),
    "nav_msgs/GetPlan_Request": _all(
        lambda message, now: _pose_stamped(message.start, now),
        lambda message, now: _pose_stamped(message.goal, now),
        _range("tolerance", 0.0, MAX_DISTANCE_M, "m"),
    ),
    "nav2_msgs/BackUp_Goal": _straight,
    "nav2_msgs/ClearCostmapAroundRobot_Request": _range("reset_distance", 0.0, MAX_DISTANCE_M, "m"),
    "nav2_msgs/ClearCostmapExceptRegion_Request": _range("reset_distance", 0.0, MAX_DISTANCE_M, "m"),
    "nav2_msgs/ComputePathToPose_Goal": _all(
        lambda message, now: _pose_stamped(message.start, now),
        lambda message, now: _pose_stamped(message.goal, now),
    ),
    "nav2_msgs/DriveOnHeading_Goal": _straight,
    "nav2_msgs/FollowPath_Goal": _poses("path"),
    "nav2_msgs/NavigateThroughPoses_Goal": _poses("poses"),
    "nav2_msgs/NavigateToPose_Goal": lambda message, now: _pose_stamped(message.pose, now),
    "nav2_msgs/SaveMap_Request": _all(
        _range("free_thresh", 0.0, 1.0, ""), _range("occupied_thresh", 0.0, 1.0, "")
    ),
    "nav2_msgs/Wait_Goal": _wait,
    "nav2_msgs/Spin_Goal": _numbers(MAX_ANGLE_RAD, "rad", "target_yaw"),
}
"""Type -> its check. A type that is not here is not checked."""
