"""Messages there and back again; nothing here starts DDS."""

from __future__ import annotations

import array
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy")
from geometry_msgs.msg import Pose, Quaternion, TransformStamped
from sensor_msgs.msg import CameraInfo, Image

from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, Twist2, normalize_angle
from florence_bt.core.sensing import (
    CameraModel,
    ColourImage,
    DepthImage,
    LaserScan,
    OccupancyGrid,
    Odometry,
)
from florence_bt.core.transforms import Transform3
from florence_bt.ros import conversions as c

metres = st.floats(-1e3, 1e3)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(Pose2, metres, metres, angles)
stamps = st.floats(0.0, 2e9)
CAMERA = CameraModel(4, 3, 262.5, 262.5, 1.5, 1.0)


def same_pose(a: Pose2, b: Pose2) -> bool:
    return a.x == b.x and a.y == b.y and abs(normalize_angle(a.yaw - b.yaw)) < 1e-9


def random() -> np.random.Generator:
    return np.random.default_rng(7)


@given(stamps)
def test_stamps(seconds: float) -> None:
    assert c.stamp_from_ros(c.stamp_to_ros(seconds)) == pytest.approx(seconds, abs=1e-6)


@pytest.mark.parametrize(
    ("seconds", "sec", "nanosec"),
    [(0.0, 0, 0), (1.25, 1, 250_000_000), (1.9999999999, 2, 0), (-0.25, -1, 750_000_000)],
)
def test_stamps_are_rounded_and_carried(seconds: float, sec: int, nanosec: int) -> None:
    for message in (c.stamp_to_ros(seconds), c.duration_to_ros(seconds)):
        assert (message.sec, message.nanosec) == (sec, nanosec)


@pytest.mark.parametrize("seconds", [math.nan, math.inf, 3e9, -3e9])
def test_times_that_do_not_fit(seconds: float) -> None:
    with pytest.raises(FrameError):
        c.stamp_to_ros(seconds)


@given(poses)
def test_poses(pose: Pose2) -> None:
    assert same_pose(c.pose_from_ros(c.pose_to_ros(pose)), pose)


def test_pose_of_a_tilted_body_and_of_no_quaternion() -> None:
    x, y, z, w = Transform3.from_xyz_rpy((0, 0, 0), (math.pi, 0.0, 0.7)).quaternion()
    assert c.pose_from_ros(Pose(orientation=Quaternion(x=x, y=y, z=z, w=w))).yaw == pytest.approx(0.7)
    assert c.pose_from_ros(Pose(orientation=Quaternion(w=0.0))) == Pose2()


@given(poses, stamps)
def test_stamped_poses_and_paths(pose: Pose2, stamp: float) -> None:
    stamped = c.pose_stamped_to_ros(pose, "/map", stamp)
    assert same_pose(c.pose_from_ros(stamped.pose), pose)
    assert c.frame_from_ros(stamped.header.frame_id) == "map"
    assert c.stamp_from_ros(stamped.header.stamp) == pytest.approx(stamp, abs=1e-6)
    path = c.path_to_ros([pose, Pose2()], "map", stamp)
    assert same_pose(c.pose_from_ros(path.poses[0].pose), pose)
    assert len(c.pose_array_to_ros([pose] * 3, "map", stamp).poses) == 3


def test_covariances() -> None:
    covariance = [float(i) for i in range(36)]
    message = c.pose_with_covariance_to_ros(Pose2(1.0, 2.0, 3.0), covariance, "map", 4.0)
    assert list(message.pose.covariance) == covariance
    assert message.header.frame_id == "map"
    with pytest.raises(FrameError, match="36"):
        c.pose_with_covariance_to_ros(Pose2(), [1.0], "map", 0.0)


@given(poses, metres, metres)
def test_odometry(pose: Pose2, linear: float, angular: float) -> None:
    odometry = Odometry(12.5, pose, Twist2(linear, angular))
    message = c.odometry_to_ros(odometry, "odom", "base_footprint", [0.1] * 36)
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_footprint")
    assert list(message.pose.covariance) == [0.1] * 36
    back = c.odometry_from_ros(message)
    assert (back.stamp, back.twist) == (12.5, odometry.twist)
    assert same_pose(back.pose, pose)
    assert c.twist_from_ros(c.twist_to_ros(odometry.twist)) == odometry.twist


@given(metres, metres, metres, angles, angles, angles)
def test_transforms(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> None:
    transform = Transform3.from_xyz_rpy((x, y, z), (roll, pitch, yaw))
    parent, child, stamp, back = c.transform_from_ros(
        c.transform_to_ros("base_link", "/laser", 1.5, transform)
    )
    assert (parent, child, stamp) == ("base_link", "laser", 1.5)
    np.testing.assert_allclose(back.rotation, transform.rotation, atol=1e-9)
    np.testing.assert_allclose(back.translation, transform.translation)


@given(poses)
def test_transforms_in_the_plane(pose: Pose2) -> None:
    back = c.transform_from_ros(c.transform_to_ros("odom", "base_footprint", 0.0, pose))[3]
    assert same_pose(back.to_pose2(), pose)


@given(metres, metres, metres, angles, angles, angles)
def test_the_part_in_the_plane_of_any_transform(
    x: float, y: float, z: float, roll: float, pitch: float, yaw: float
) -> None:
    message = c.transform_to_ros(
        "odom", "/laser", 1.5, Transform3.from_xyz_rpy((x, y, z), (roll, pitch, yaw))
    )
    *names, pose = c.planar_transform_from_ros(message)
    *expected, transform = c.transform_from_ros(message)
    assert names == expected
    if math.hypot(*transform.rotation[:2, 0]) > 1e-6:  # else the x axis points up or down, and has no heading
        assert same_pose(pose, transform.to_pose2())


@pytest.mark.parametrize("bad", [{"w": 0.0}, {"x": math.nan}])
def test_a_transform_that_is_none(bad: dict[str, float]) -> None:
    message = TransformStamped(child_frame_id="laser")
    message.transform.rotation = Quaternion(**bad)
    with pytest.raises(FrameError, match="'laser'"):
        c.transform_from_ros(message)


def test_scans() -> None:
    ranges = random().uniform(0.02, 5.6, 683).astype(np.float32)
    ranges[:3] = [np.nan, np.inf, -np.inf]
    scan = LaserScan(3.5, "laser", -2.0, 0.006, 0.02, 5.6, ranges, 1e-4, 0.1, ranges[:5])
    message = c.scan_to_ros(scan)
    assert message.angle_max == pytest.approx(scan.angle_max)
    back = c.scan_from_ros(message)
    np.testing.assert_array_equal(back.ranges, ranges)
    np.testing.assert_array_equal(back.intensities, ranges[:5])
    for name in ("angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time"):
        assert getattr(back, name) == pytest.approx(getattr(scan, name), rel=1e-6)
    empty = c.scan_from_ros(c.scan_to_ros(LaserScan(0.0, "laser", 0, 1, 0, 1, np.empty(0, np.float32))))
    assert empty.ranges.shape == (0,)


def test_every_echo() -> None:
    nan, first = np.nan, np.array([1.0, 2.0], np.float32)
    echoes = np.array([[1.0, nan], [2.0, 2.5]], np.float32)
    scan = LaserScan(3.0, "laser", -0.5, 1.0, 0.02, 30.0, first)
    message = c.echoes_to_ros(scan, echoes, np.empty((2, 0), np.float32))
    assert [list(beam.echoes) for beam in message.ranges] == [[1.0], [2.0, 2.5]]
    assert (message.header.frame_id, message.angle_max, message.intensities) == ("laser", 0.5, [])
    both = c.echoes_to_ros(scan, echoes, echoes)
    assert [list(beam.echoes) for beam in both.intensities] == [[1.0], [2.0, 2.5]]


def test_scans_from_other_kinds_of_arrays() -> None:
    strided = np.linspace(0.0, 5.0, 20)[::2]
    assert list(c.scan_to_ros(LaserScan(0.0, "laser", 0, 1, 0, 9, strided)).ranges) == pytest.approx(strided)


def test_depth() -> None:
    depth = random().uniform(0.5, 4.0, (3, 4)).astype(np.float32)
    depth[1, 2] = np.nan
    message = c.depth_to_ros(DepthImage(2.0, "camera_depth_optical_frame", CAMERA, depth))
    assert (message.encoding, message.step, len(message.data)) == ("32FC1", 16, 48)
    back = c.depth_from_ros(message, CAMERA)
    np.testing.assert_array_equal(back.depth, depth)
    assert (back.stamp, back.frame_id, back.camera) == (2.0, "camera_depth_optical_frame", CAMERA)


@pytest.mark.parametrize("order", ["<", ">"])
def test_depth_in_millimetres_with_padding(order: str) -> None:
    rows = np.array([[1000, 0], [2500, 65535]], f"{order}u2")
    padded = b"".join(row.tobytes() + b"\xff\xff" for row in rows)
    message = Image(height=2, width=2, encoding="16UC1", step=6, is_bigendian=int(order == ">"))
    message.data = array.array("B", padded)
    depth = c.depth_from_ros(message, CAMERA).depth
    np.testing.assert_allclose(depth, [[1.0, np.nan], [2.5, 65.535]], rtol=1e-6)
    assert depth.dtype == np.float32


def test_colour() -> None:
    pixels = random().integers(0, 256, (3, 4, 3), np.uint8)
    message = c.colour_to_ros(ColourImage(2.0, "camera_rgb_optical_frame", CAMERA, pixels))
    assert (message.encoding, message.step) == ("rgb8", 12)
    np.testing.assert_array_equal(c.colour_from_ros(message, CAMERA).pixels, pixels)


@pytest.mark.parametrize(
    ("encoding", "stored", "expected"),
    [
        ("bgr8", [3, 2, 1], [1, 2, 3]),
        ("bgra8", [3, 2, 1, 9], [1, 2, 3]),
        ("rgba8", [1, 2, 3, 9], [1, 2, 3]),
        ("mono8", [7], [7, 7, 7]),
    ],
)
def test_other_colours(encoding: str, stored: list[int], expected: list[int]) -> None:
    message = Image(height=1, width=2, encoding=encoding, step=2 * len(stored))
    message.data = array.array("B", stored * 2)
    assert c.colour_from_ros(message, CAMERA).pixels.tolist() == [[expected, expected]]


def test_images_that_are_none() -> None:
    short = Image(height=2, width=2, encoding="32FC1", step=8, data=array.array("B", bytes(15)))
    narrow = Image(height=2, width=2, encoding="32FC1", step=4, data=array.array("B", bytes(8)))
    strange = Image(encoding="yuv422")
    for image in (short, narrow, strange):
        with pytest.raises(FrameError):
            c.depth_from_ros(image, CAMERA)
    with pytest.raises(FrameError, match="rgb8, rgba8"):
        c.colour_from_ros(strange, CAMERA)


def test_camera_models() -> None:
    message = c.camera_info_to_ros(CAMERA, "optical", 1.0)
    assert c.camera_model_from_ros(message) == CAMERA
    assert list(message.p[:7]) == [262.5, 0.0, 1.5, 0.0, 0.0, 262.5, 1.0]
    with pytest.raises(FrameError, match="not calibrated"):
        c.camera_model_from_ros(CameraInfo())


def test_maps() -> None:
    cells = random().choice(np.array([-1, 0, 100], np.int8), (5, 7))
    grid = OccupancyGrid(0.05, Pose2(-1.0, -2.0, 0.0), cells)
    message = c.grid_to_ros(grid, "map", 9.0)
    assert (message.info.width, message.info.height) == (7, 5)
    assert message.data[7] == cells[1, 0], "row after row from the lowest y"
    back = c.grid_from_ros(message)
    np.testing.assert_array_equal(back.cells, cells)
    assert back.resolution == pytest.approx(0.05)
    assert back.origin == grid.origin
    message.info.width = 8
    with pytest.raises(FrameError, match="5 x 8"):
        c.grid_from_ros(message)
