"""Interfaces of ROS by name, and the fields of their messages by path.

Nothing of ROS is imported before an interface is asked for by its name, and messages are read and written by
their attributes, so that the check works without ROS.

A path names a field of a field: ``pose.pose.position.x``; ``[0]`` takes an item of an array, and ``[*]`` the
same field of every item: ``plants[*].species`` is a list.
"""

from __future__ import annotations

import array
import enum
import importlib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2, yaw_of_quaternion


class _Now(enum.Enum):
    """One value that stays itself when it is copied."""

    NOW = "now"


NOW: Any = _Now.NOW
"""The value of a ``builtin_interfaces/Time`` that is the present when the message is sent."""
_NAME = re.compile(r"([a-z][a-z0-9_]*)/(msg|srv|action)/([A-Z][A-Za-z0-9]*)")
_USUAL_TYPES = (
    *("std_msgs/msg/Bool", "std_msgs/msg/String", "std_msgs/msg/Float64", "std_srvs/srv/Trigger"),
    *("std_srvs/srv/SetBool", "nav2_msgs/action/NavigateToPose"),
)
"""Types that much of a home is made of, for suggestions."""
_A = {"message": "a message", "service": "a service", "action": "an action"}
_STEP = re.compile(r"([a-z][a-z0-9_]*)(?:\[(\d+|\*)\])?")
_EVERY = -1
"""The index of ``[*]``."""
_LAST_ITEM = 9999
"""An array grows to have the item that is written to: a slip of a finger must not fill the memory."""
_SEQUENCE = re.compile(r"(?:sequence<(.+?)(?:, *(\d+))?>|(.+)\[(\d+)\])")
"""The type of the items, and how many there may be; or that type, and how many there are."""

_FLOATS = frozenset(("float", "double"))
_INTEGERS = frozenset(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_TEXTS = frozenset(("string", "wstring"))
_BOUND = re.compile(r"w?string<(\d+)>")
_MAX_FLOAT = (2.0 - 2.0**-23) * 2.0**127
"""The largest number of 32 bits (IEEE 754)."""
_POSES = frozenset(
    f"geometry_msgs/{name}"
    for name in ("PoseStamped", "Pose", "PoseWithCovarianceStamped", "Point", "Pose2D")
)
_QUATERNION, _DURATION = "geometry_msgs/Quaternion", "builtin_interfaces/Duration"
TIME = "builtin_interfaces/Time"
_HOLDS: dict[Kind, frozenset[str]] = {
    Kind.TEXT: _TEXTS,
    Kind.BOOLEAN: frozenset(("boolean",)),
    Kind.INTEGER: _INTEGERS | _FLOATS,
    Kind.NUMBER: _FLOATS,
    Kind.LENGTH: _FLOATS,
    Kind.SPEED: _FLOATS,
    Kind.ANGLE: _FLOATS | {_QUATERNION},
    Kind.DURATION: _FLOATS | {_DURATION},
    Kind.POSE: _POSES,
}
"""Kind -> the types of fields that hold such a value."""


def name_of_interface(interface: type) -> str:
    """Return the name by which :func:`load_interface` finds a class: ``nav2_msgs/action/Spin``."""
    package, kind = interface.__module__.split(".")[:2]
    return f"{package}/{kind}/{interface.__name__}"


def load_interface(name: str) -> Any:
    """Return the class of an interface, such as ``nav2_msgs/action/Spin``.

    Raises:
        ConfigError: The name has another form, or nothing of that name is installed.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        raise ConfigError(f"{name!r} is not the type of an interface", valid=_types_like(name))
    package, kind, last = match.groups()
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ImportError as error:
        problem = f"the interface package {package!r} is not installed: {error}"
        raise ConfigError(problem, valid=["florence interfaces add FOLDER"]) from error
    found = getattr(module, last, None)
    if found is None:
        names = [each for each in dir(module) if each[:1].isupper() and "_" not in each]
        raise ConfigError(f"{package} has no {kind} {last!r}", valid=closest_first(last, names))
    return found


def _types_like(name: str) -> tuple[str, ...]:
    """Suggest the whole name of a type for ``Bool`` or ``std_msgs/Bool``."""
    package, _, last = name.replace("::", "/").rpartition("/")
    package = package.split("/")[0]
    meant = [each for each in _USUAL_TYPES if each.rpartition("/")[2].lower() == last.lower()]
    if package and not meant:
        return tuple(f"{package}/{kind}/{last}" for kind in ("msg", "srv", "action"))
    return tuple(meant) or _USUAL_TYPES


def field_type(message_type: Any, path: str) -> str:
    """Return the type of a field, as the interface writes it (``sequence<geometry_msgs/PoseStamped>``).

    Raises:
        ConfigError: There is no such field; with the names that are near.
    """
    kind, steps = "", _steps(path)
    for number, (name, index) in enumerate(steps):
        if number:
            message_type = _nested(kind, path)
        fields = message_type.get_fields_and_field_types()
        if name not in fields:
            what = f"{message_type.__name__} has no field {name!r}"
            raise ConfigError(what, valid=closest_first(name, fields))
        kind = fields[name]
        if index is not None:
            kind = _item_type(kind, path, index)
    return f"sequence<{kind}>" if any(index == _EVERY for _, index in steps) else kind


def holder_of(message_type: Any, path: str) -> Any:
    """Return the type of the message that has a field itself, whose constants may be meant by its values.

    Raises:
        ConfigError: There is no such field.
    """
    above = path.rpartition(".")[0]
    if not above:
        return message_type
    written = field_type(message_type, above)
    return _nested(item_of_array(written) or written, path)


def holds(kind: Kind, written: str) -> bool:
    """Tell whether a field of a type, as the interface writes it, holds values of a kind."""
    if kind.item is not None:
        match = _SEQUENCE.fullmatch(written)
        return match is not None and holds(kind.item, match[1] or match[3])
    return re.sub(r"<\d+>", "", written) in _HOLDS[kind]


def integer_limits(written: str) -> tuple[int, int] | None:
    """Return the lowest and highest value of an integer field of a type; None for other fields."""
    if written not in _INTEGERS:
        return None
    bits = int(written.lstrip("uint"))
    return (0, 2**bits - 1) if written.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def kind_of_field(written: str) -> Kind | None:
    """Return the kind of what a field of a type gives to an expression, None for what has none."""
    sequence = _SEQUENCE.fullmatch(written)
    if sequence is not None:
        item = kind_of_field(sequence[1] or sequence[3])
        return item.list if item is not None and item.item is None else None
    plain = re.sub(r"<\d+>", "", written)
    for kind in (Kind.BOOLEAN, Kind.TEXT, Kind.NUMBER, Kind.DURATION, Kind.ANGLE, Kind.POSE):
        if plain in _HOLDS[kind]:
            return kind
    return Kind.INTEGER if plain in _INTEGERS or plain == "octet" else None


def item_of_array(written: str) -> str:
    """Return the type of the items of an array of a type; empty for what is none."""
    sequence = _SEQUENCE.fullmatch(written)
    return str(sequence[1] or sequence[3]) if sequence is not None else ""


def fields_below(message_type: Any, path: str) -> tuple[str, ...]:
    """Return the paths of the fields of a field that is a message; none when it is none."""
    written = field_type(message_type, path)
    if "/" not in written or _SEQUENCE.fullmatch(written):
        return ()
    return tuple(f"{path}.{name}" for name in _nested(written, path).get_fields_and_field_types())


def part_of(interface: Any, part: str) -> Any:
    """Return a part of an action or service (``Goal``, ``Result``, ``Response`` ...), or a message itself.

    Raises:
        ConfigError: The interface has no such part: it is of another kind.
    """
    is_one = (
        "action" if hasattr(interface, "Goal") else "service" if hasattr(interface, "Request") else "message"
    )
    if is_one == "message" and part == "":
        return interface
    found = getattr(interface, part, None) if part else None
    if found is None:
        wanted = (
            "message" if part == "" else "action" if part in ("Goal", "Result", "Feedback") else "service"
        )
        ways = ("condition", "wait_for", "publish") if is_one == "message" else (is_one,)
        problem = f"{interface.__name__} is not {_A[wanted]}, but {_A[is_one]}"
        raise ConfigError(problem, valid=[f"{way}: NAME" for way in ways])
    return found


def fill(message: Any, fields: Mapping[str, Any], stamp: Any) -> Any:
    """Write values into the fields of a message, and the stamp into its header; return the message.

    Args:
        message: The message, goal or request.
        fields: Path of a field -> value, as :func:`put` takes it.
        stamp: The present time as ``builtin_interfaces/Time``.

    Raises:
        ConfigError: There is no such field.
        ValueError: A field does not hold its value.
    """
    if hasattr(message, "header"):
        message.header.stamp = stamp
    for path, value in fields.items():
        put(message, path, value, stamp)
    return message


def put(message: Any, path: str, value: Any, stamp: Any) -> None:
    """Write a value into a field.

    Args:
        message: The message.
        path: The field.
        value: A value in SI units; a pose is of the frame ``map``.
        stamp: The ``builtin_interfaces/Time`` of poses that have one.

    Raises:
        ConfigError: There is no such field.
        ValueError: The field does not hold the value.
    """
    steps = _steps(path)
    if steps[-1][1] is not None:
        raise ConfigError(f"{path!r} names an item of an array, and a whole field is sent")
    try:
        _put(message, steps, value, stamp, path)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{path}: {error}") from error


def _put(message: Any, steps: Sequence[tuple[str, int | None]], value: Any, stamp: Any, path: str) -> None:
    (name, index), *below = steps
    if index == _EVERY:
        _put_every(message, name, below, value, stamp, path)
    elif below:
        _put(_entered(message, name, index, path), below, value, stamp, path)
    else:
        kind = field_type(type(message), name)
        setattr(message, name, _written(kind, getattr(message, name), value, stamp))


def _put_every(
    message: Any, name: str, below: Sequence[tuple[str, int | None]], values: Any, stamp: Any, path: str
) -> None:
    """Write a list into the same field of every item, of which there become as many as it has values."""
    there, size = getattr(message, name), len(values)
    others = len(there) if there else size
    least, most = length_limits(field_type(type(message), name)) or (0, max(size, others))
    if others != size or not least <= size <= most:
        wanted = f"{others} items are there" if others != size else f"{least} to {most} items have room"
        raise ValueError(f"{size} values, and {wanted}")
    for number, value in enumerate(values):
        _put(_entered(message, name, number, path), below, value, stamp, path)


def length_limits(written: str) -> tuple[int, int] | None:
    """Return the least and most items of an array of a type; None for what is no array, or has no limit."""
    sequence = _SEQUENCE.fullmatch(written)
    if sequence is None or not (sequence[2] or sequence[4]):
        return None
    return (int(sequence[4]), int(sequence[4])) if sequence[4] else (0, int(sequence[2]))


def get(message: Any, path: str, kind: Kind, *, any_number: bool = False) -> Any:
    """Read a field as a value of a kind, in SI units.

    Args:
        message: The message.
        path: The field.
        kind: The kind.
        any_number: Whether infinity and NaN may be read too.

    Raises:
        ConfigError: There is no such field or item, or it does not hold such a value.
    """
    value = _value_at(message, _steps(path), path)
    try:
        return _read(value, kind, any_number=any_number)
    except (TypeError, ValueError, OverflowError, AttributeError) as error:
        raise ConfigError(f"{path} holds no {kind.value}: {error}") from error


def _value_at(value: Any, steps: Sequence[tuple[str, int | None]], path: str) -> Any:
    for number, (name, index) in enumerate(steps):
        if not hasattr(value, name):
            raise ConfigError(f"{type(value).__name__} has no field {name!r}")
        value = getattr(value, name)
        if index == _EVERY:
            return [_value_at(each, steps[number + 1 :], path) for each in value]
        if index is not None:
            if index >= len(value):
                raise ConfigError(f"{path} is not there: {name} has {len(value)} items")
            value = value[index]
    return value


def _steps(path: str) -> list[tuple[str, int | None]]:
    steps: list[tuple[str, int | None]] = []
    for part in path.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise ConfigError(f"{path!r} is not the path of a field", valid=["pose.position.x", "poses[0]"])
        steps.append((match[1], None if not match[2] else _EVERY if match[2] == "*" else int(match[2])))
    if any(index is not None and index > _LAST_ITEM for _, index in steps):
        raise ConfigError(f"{path!r}: an item after number {_LAST_ITEM} of an array cannot be named")
    if sum(index == _EVERY for _, index in steps) > 1:
        raise ConfigError(f"{path!r} is a list of lists; no kind of value is one")
    return steps


def _entered(message: Any, name: str, index: int | None, path: str) -> Any:
    """Return a field, or an item of an array, which grows to have it."""
    value = getattr(message, name)
    if index is None:
        return value
    while len(value) <= index:
        value.append(_nested(_item_type(field_type(type(message), name), path, index), path)())
    return value[index]


def _nested(kind: str, path: str) -> Any:
    if "/" not in kind or _SEQUENCE.fullmatch(kind):
        array = _SEQUENCE.fullmatch(kind) is not None
        valid = ["[0] behind the array", "[*] there, in from: of an output"] if array else []
        raise ConfigError(f"a field of the type {kind} has no fields, in {path!r}", valid=valid)
    package, name = kind.split("/")[0], kind.split("/")[-1]
    return load_interface(f"{package}/msg/{name}")


def _item_type(kind: str, path: str, index: int) -> str:
    match = _SEQUENCE.fullmatch(kind)
    if match is None:
        raise ConfigError(f"a field of the type {kind} has no items, in {path!r}")
    if index >= int(match[2] or match[4] or index + 1):
        raise ConfigError(f"a field of the type {kind} has no item {index}, in {path!r}")
    return str(match[1] or match[3])


def _written(kind: str, there: Any, value: Any, stamp: Any) -> Any:
    """Convert the value of a field; nested messages are filled in where they are."""
    sequence = _SEQUENCE.fullmatch(kind)
    if sequence is not None:
        item, most, size = sequence[1] or sequence[3], sequence[2], sequence[4]
        if len(value) > int(most or len(value)) or len(value) != int(size or len(value)):
            # rclpy does not look, and would send what lies in the memory behind them.
            raise ValueError(f"{len(value)} items do not fit into {kind}")
        items = [
            _written(item, _nested(item, kind)() if "/" in item else None, each, stamp) for each in value
        ]
        return array.array(there.typecode, items) if isinstance(there, array.array) else items
    if isinstance(value, Pose2):
        _put_pose(there, value, stamp)
        return there
    if kind == _QUATERNION:
        there.z, there.w = math.sin(value / 2.0), math.cos(value / 2.0)
        return there
    if value is NOW:
        there.sec, there.nanosec = stamp.sec, stamp.nanosec
        return there
    if kind == _DURATION:
        there.sec, there.nanosec = divmod(round(value * 1e9), 1_000_000_000)
        return there
    _check_room(kind, value)
    return float(value) if kind in _FLOATS else value


def _check_room(kind: str, value: Any) -> None:
    """Raise ValueError when a field of a type has no room for a value; rclpy would cut it off, or send it."""
    limits = integer_limits(kind)
    if limits is not None and not limits[0] <= value <= limits[1]:
        raise ValueError(f"{value} is not between {limits[0]} and {limits[1]}, as {kind} is")
    if kind == "float" and math.isfinite(value) and abs(value) > _MAX_FLOAT:
        raise ValueError(f"{value:g} is not between {-_MAX_FLOAT:g} and {_MAX_FLOAT:g}, as {kind} is")
    bound = _BOUND.fullmatch(kind)
    length = len(value if kind.startswith("w") else value.encode()) if bound is not None else 0
    unit = "characters" if bound is None or kind.startswith("w") or value.isascii() else "bytes of UTF-8"
    if bound is not None and length > int(bound[1]):
        raise ValueError(f"{value!r} is longer than the {bound[1]} {unit} of {kind}")


def _put_pose(there: Any, pose: Pose2, stamp: Any) -> None:
    if hasattr(there, "header"):
        there.header.frame_id, there.header.stamp = "map", stamp
    while hasattr(there, "pose"):
        there = there.pose
    point = getattr(there, "position", there)
    point.x, point.y = pose.x, pose.y
    if hasattr(there, "orientation"):
        there.orientation.z, there.orientation.w = math.sin(pose.yaw / 2.0), math.cos(pose.yaw / 2.0)
    elif hasattr(there, "theta"):
        there.theta = pose.yaw


def _read(value: Any, kind: Kind, *, any_number: bool = False) -> Any:
    if kind.item is not None:
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise TypeError(f"{value!r} is no list")
        return tuple(_read(each, kind.item, any_number=any_number) for each in value)
    if isinstance(value, bytes) and len(value) == 1:
        value = value[0]
    match kind:
        case Kind.POSE:
            return _read_pose(value)
        case Kind.ANGLE if hasattr(value, "w"):
            value = yaw_of_quaternion(value.x, value.y, value.z, value.w)
        case Kind.DURATION if hasattr(value, "nanosec"):
            value = value.sec + value.nanosec * 1e-9
        case Kind.TEXT if not isinstance(value, str):
            raise TypeError(f"{value!r} is no text")
        case Kind.TEXT | Kind.BOOLEAN:
            return value
        case Kind.INTEGER:
            if int(value) != value:
                raise ValueError(f"{value} is no whole number")
            return int(value)
    number = float(value)
    if not any_number and not math.isfinite(number):
        raise ValueError(f"{number} is not finite")
    return number


def _read_pose(value: Any) -> Pose2:
    while hasattr(value, "pose"):
        value = value.pose
    point = getattr(value, "position", value)
    if hasattr(value, "orientation"):
        turned = value.orientation
        yaw = yaw_of_quaternion(turned.x, turned.y, turned.z, turned.w)
    else:
        yaw = float(getattr(value, "theta", 0.0))
    pose = Pose2(float(point.x), float(point.y), yaw)
    if not pose.is_finite():
        raise ValueError(f"{pose} is not finite")
    return pose
