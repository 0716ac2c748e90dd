"""What is read from the bytes of a message is what rclpy reads; bytes that are no message are refused."""

from __future__ import annotations

import array
import math
from struct import pack, unpack_from
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from florence_bt.ros.raw_messages import UnreadableBytes, is_read_here, read_message

pytestmark = pytest.mark.ros

texts = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\0"), max_size=9)
numbers = st.floats()
singles = st.floats(width=32)
times = st.builds(Time, sec=st.integers(-(2**31), 2**31 - 1), nanosec=st.integers(0, 2**32 - 1))
headers = st.builds(Header, stamp=times, frame_id=texts)
vectors = st.builds(Vector3, x=numbers, y=numbers, z=numbers)
points = st.builds(Point, x=numbers, y=numbers, z=numbers)
quaternions = st.builds(Quaternion, x=numbers, y=numbers, z=numbers, w=numbers)
covariances = st.just(np.arange(36.0))
lists = st.lists(singles, max_size=9).map(lambda values: array.array("f", values))
transforms = st.builds(
    TransformStamped,
    header=headers,
    child_frame_id=texts,
    transform=st.builds(Transform, translation=vectors, rotation=quaternions),
)
messages = st.one_of(
    st.builds(TFMessage, transforms=st.lists(transforms, max_size=3)),
    st.builds(
        Odometry,
        header=headers,
        child_frame_id=texts,
        pose=st.builds(
            PoseWithCovariance,
            pose=st.builds(Pose, position=points, orientation=quaternions),
            covariance=covariances,
        ),
        twist=st.builds(
            TwistWithCovariance,
            twist=st.builds(Twist, linear=vectors, angular=vectors),
            covariance=covariances,
        ),
    ),
    st.builds(
        LaserScan,
        header=headers,
        angle_min=singles,
        angle_max=singles,
        angle_increment=singles,
        time_increment=singles,
        scan_time=singles,
        range_min=singles,
        range_max=singles,
        ranges=lists,
        intensities=lists,
    ),
)


def assert_same(read: Any, message: Any) -> None:
    """Compare what was read, field by field, with the message."""
    if isinstance(read, np.ndarray):
        np.testing.assert_array_equal(read, np.array(message, read.dtype))
    elif isinstance(read, list):
        assert len(read) == len(message)
        for one, other in zip(read, message, strict=True):
            assert_same(one, other)
    elif hasattr(read, "_fields"):
        assert set(read._fields) == set(message.get_fields_and_field_types())
        for name in read._fields:
            assert_same(getattr(read, name), getattr(message, name))
    else:
        assert read == message or (math.isnan(read) and math.isnan(message))


@given(message=messages)
def test_the_fields_are_those_of_rclpy(message):
    data = serialize_message(message)
    assert is_read_here(type(message))
    assert_same(read_message(data, type(message)), deserialize_message(data, type(message)))


def test_the_high_byte_may_be_first():
    header = pack(">iII", 7, 8, 5) + b"odom\0\0\0\0"
    child = pack(">I", 5) + b"base\0\0\0\0"
    place = pack(">7d", 1, 2, 3, 0, 0, 0.6, 0.8)
    body = pack(">I", 1) + header + child
    body += bytes(-len(body) % 8) + place
    ((read,),) = read_message(b"\0\0\0\0" + body, TFMessage)
    assert (read.header.stamp.sec, read.header.frame_id, read.child_frame_id) == (7, "odom", "base")
    assert read.transform.translation == (1, 2, 3)
    assert read.transform.rotation == (0, 0, 0.6, 0.8)


@given(message=messages, share=st.floats(0, 1, exclude_max=True))
def test_a_part_of_a_message_is_refused_or_has_all_that_is_read(message, share):
    data = serialize_message(message)
    part = data[: int(share * len(data))]
    try:
        read = read_message(part, type(message))
    except UnreadableBytes:
        return
    assert_same(read, message)


@given(data=st.binary(max_size=200), kind=st.sampled_from([TFMessage, Odometry, LaserScan]))
def test_other_bytes_are_refused_or_read_without_another_error(data, kind):
    try:
        read_message(b"\0\1\0\0" + data, kind)
    except UnreadableBytes:
        return


def test_another_encoding_is_refused():
    data = bytearray(serialize_message(TFMessage()))
    data[1] = 6  # of version 2
    with pytest.raises(UnreadableBytes, match="encoding"):
        read_message(bytes(data), TFMessage)


def test_a_list_that_is_longer_than_its_message_is_refused():
    data = bytearray(serialize_message(LaserScan(ranges=[1.0, 2.0])))
    place = data.index(pack("<2f", 1.0, 2.0)) - 4
    assert unpack_from("<I", data, place) == (2,)
    data[place : place + 4] = pack("<I", 2**32 - 1)
    with pytest.raises(UnreadableBytes, match="4294967295 numbers"):
        read_message(bytes(data), LaserScan)
