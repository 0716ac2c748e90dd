"""Reads the messages that come often from their bytes: transforms, odometry, laser scans.

rclpy makes a Python object with its defaults for every part of a message: 57 us for one transform and 201 us
for an odometry in place of 9 and 23, some hundred times a second in an idle system. What is read here has the
fields of the message by their names, but it is no object of the message's class, and cannot be changed.

Source: Common Data Representation, version 1 (DDSI-RTPS 2.2, chapter 10; CORBA 3.1, part 2, 9.3): four bytes
ahead, of which the second says whether the low byte is first; from there, each number at a multiple of its
size; a text and a list begin with their length, that of a text counts the zero behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from struct import Struct, error
from typing import Any, NamedTuple

import numpy as np
from nav_msgs.msg import Odometry as OdometryMsg
from numpy.typing import NDArray
from sensor_msgs.msg import LaserScan as LaserScanMsg
from tf2_msgs.msg import TFMessage

_AHEAD = 4
_COVARIANCE = 36
"""Numbers of a covariance over six axes."""


class UnreadableBytes(Exception):
    """The bytes are no message of their type."""


class Stamp(NamedTuple):
    """``builtin_interfaces/Time``."""

    sec: int
    nanosec: int


class Header(NamedTuple):
    """``std_msgs/Header``."""

    stamp: Stamp
    frame_id: str


class Vector(NamedTuple):
    """``geometry_msgs/Vector3`` and ``geometry_msgs/Point``."""

    x: float
    y: float
    z: float


class Rotation(NamedTuple):
    """``geometry_msgs/Quaternion``."""

    x: float
    y: float
    z: float
    w: float


class Transform(NamedTuple):
    """``geometry_msgs/Transform``."""

    translation: Vector
    rotation: Rotation


class StampedTransform(NamedTuple):
    """``geometry_msgs/TransformStamped``."""

    header: Header
    child_frame_id: str
    transform: Transform


class Transforms(NamedTuple):
    """``tf2_msgs/TFMessage``."""

    transforms: list[StampedTransform]


class Place(NamedTuple):
    """``geometry_msgs/Pose``."""

    position: Vector
    orientation: Rotation


class PlaceEstimate(NamedTuple):
    """``geometry_msgs/PoseWithCovariance``."""

    pose: Place
    covariance: NDArray[np.float64]


class Velocity(NamedTuple):
    """``geometry_msgs/Twist``."""

    linear: Vector
    angular: Vector


class VelocityEstimate(NamedTuple):
    """``geometry_msgs/TwistWithCovariance``."""

    twist: Velocity
    covariance: NDArray[np.float64]


class OdometryReading(NamedTuple):
    """``nav_msgs/Odometry``."""

    header: Header
    child_frame_id: str
    pose: PlaceEstimate
    twist: VelocityEstimate


class Scan(NamedTuple):
    """``sensor_msgs/LaserScan``."""

    header: Header
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]
    intensities: NDArray[np.float32]


class _Order:
    """The parts of a message in one order of bytes."""

    def __init__(self, sign: str) -> None:
        self.length = Struct(f"{sign}I")
        self.stamp_and_length = Struct(f"{sign}iII")
        self.place = Struct(f"{sign}7d")
        self.velocity = Struct(f"{sign}6d")
        self.scan = Struct(f"{sign}7f")
        self.floats = np.dtype(f"{sign}f4")
        self.doubles = np.dtype(f"{sign}f8")


_ORDERS = {0: _Order(">"), 1: _Order("<")}


def _text(data: bytes, place: int, length: int) -> tuple[str, int]:
    """Return a text, and where the next number of four bytes may be."""
    end = place + length
    if length == 0 or end > len(data):
        raise UnreadableBytes(f"a text of {length} bytes does not fit")
    return data[place : end - 1].decode(), (end + 3) & ~3


def _eightfold(place: int) -> int:
    return ((place - _AHEAD + 7) & ~7) + _AHEAD


def _header(data: bytes, place: int, order: _Order) -> tuple[Header, int]:
    sec, nanosec, length = order.stamp_and_length.unpack_from(data, place)
    frame_id, place = _text(data, place + order.stamp_and_length.size, length)
    return Header(Stamp(sec, nanosec), frame_id), place


def _header_and_child(data: bytes, place: int, order: _Order) -> tuple[Header, str, int]:
    header, place = _header(data, place, order)
    (length,) = order.length.unpack_from(data, place)
    child, place = _text(data, place + order.length.size, length)
    return header, child, _eightfold(place)


def _transforms(data: bytes, order: _Order) -> Transforms:
    (count,) = order.length.unpack_from(data, _AHEAD)
    place = _AHEAD + order.length.size
    transforms = []
    for _ in range(count):
        header, child, place = _header_and_child(data, (place + 3) & ~3, order)
        x, y, z, *rotation = order.place.unpack_from(data, place)
        place += order.place.size
        transforms.append(StampedTransform(header, child, Transform(Vector(x, y, z), Rotation(*rotation))))
    return Transforms(transforms)


def _odometry(data: bytes, order: _Order) -> OdometryReading:
    header, child, place = _header_and_child(data, _AHEAD, order)
    x, y, z, *rotation = order.place.unpack_from(data, place)
    of_place, place = _numbers(data, place + order.place.size, _COVARIANCE, order.doubles)
    velocity = order.velocity.unpack_from(data, place)
    of_velocity, _ = _numbers(data, place + order.velocity.size, _COVARIANCE, order.doubles)
    return OdometryReading(
        header,
        child,
        PlaceEstimate(Place(Vector(x, y, z), Rotation(*rotation)), of_place),
        VelocityEstimate(Velocity(Vector(*velocity[:3]), Vector(*velocity[3:])), of_velocity),
    )


def _numbers(data: bytes, place: int, count: int, kind: np.dtype[Any]) -> tuple[NDArray[Any], int]:
    """Return numbers that stand behind each other, in the order of bytes of this machine, and their end."""
    end = place + count * kind.itemsize
    if end > len(data):
        raise UnreadableBytes(f"{count} numbers do not fit")
    return np.frombuffer(data, kind, count, place).astype(kind.newbyteorder("=")), end


def _floats(data: bytes, place: int, order: _Order) -> tuple[NDArray[np.float32], int]:
    (count,) = order.length.unpack_from(data, place)
    return _numbers(data, place + order.length.size, count, order.floats)


def _scan(data: bytes, order: _Order) -> Scan:
    header, place = _header(data, _AHEAD, order)
    low, high, step, between_beams, scan_time, near, far = order.scan.unpack_from(data, place)
    ranges, place = _floats(data, place + order.scan.size, order)
    intensities, _ = _floats(data, place, order)
    return Scan(header, low, high, step, between_beams, scan_time, near, far, ranges, intensities)


_READERS: Mapping[type, Callable[[bytes, _Order], Any]] = {
    TFMessage: _transforms,
    OdometryMsg: _odometry,
    LaserScanMsg: _scan,
}


def is_read_here(message_type: type) -> bool:
    """Tell whether messages of a type are among those that come often."""
    return message_type in _READERS


def read_message(data: bytes, message_type: type) -> Any:
    """Read a serialised message of a type that :func:`is_read_here`.

    Raises:
        UnreadableBytes: It is none.
    """
    order = _ORDERS.get(data[1]) if len(data) > _AHEAD else None
    if order is None:
        raise UnreadableBytes("no message of this encoding is known")
    try:
        return _READERS[message_type](data, order)
    except (error, UnicodeDecodeError) as problem:
        raise UnreadableBytes(str(problem)) from problem
