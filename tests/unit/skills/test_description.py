"""The robot's xacro file, read by our own reader and by yourdfpy."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from florence_bt.core.errors import ConfigError
from florence_bt.core.transforms import TransformBuffer
from florence_bt.drivers.kinect.motor.driver import MotorParameters
from florence_bt.skills.robot_description.description import (
    DescriptionParameters,
    RobotDescription,
    default_file,
    load_description,
)
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, Footprint, corners_from_flat
from florence_bt.skills.robot_description.frames import static_frames, turning_joints


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_description()


@pytest.fixture(scope="module")
def buffer(robot) -> TransformBuffer:
    frames = TransformBuffer()
    robot.fill(frames)
    return frames


@pytest.mark.parametrize(
    ("child", "x", "y", "z"),
    [
        ("base_link", 0.0, 0.0, 0.017),
        ("gyro_link", 0.0, 0.0, 0.057),
        ("left_wheel_link", 0.0, 0.13, 0.032),
        ("right_wheel_link", 0.0, -0.13, 0.032),
        ("plate_0_link", -0.04334, 0.0, 0.0848),
        ("plate_1_link", -0.00266, 0.0, 0.1848),
        ("plate_2_link", -0.00266, 0.0, 0.4348),
        ("plate_3_link", -0.01582, 0.0, 0.9348),
        ("base_laser_link", 0.05734, 0.0, 0.1648),
        ("base_laser_round_link", 0.05734, 0.0, 0.1298),
        ("camera_link", -0.0871, 0.0, 0.5395),
        ("camera_depth_frame", -0.0871, 0.018, 0.5395),
        ("camera_depth_optical_frame", -0.0871, 0.018, 0.5395),
        ("camera_rgb_optical_frame", -0.0871, -0.005, 0.5395),
        ("wall_sensor_link", 0.09, -0.12, 0.059),
    ],
)
def test_where_the_parts_sit_above_the_floor(buffer, child, x, y, z):
    transform = buffer.lookup("base_footprint", child)
    assert transform.translation == pytest.approx([x, y, z], abs=1e-4)


def test_the_accelerometer_has_its_frame_y_up_and_z_forward(buffer):
    frame = buffer.lookup("base_footprint", MotorParameters().frame_id)
    left_up_forward = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert frame.rotation == pytest.approx(left_up_forward, abs=1e-9)


def test_the_laser_hangs_upside_down(buffer):
    rotation = buffer.lookup("base_footprint", "base_laser_round_link").rotation
    assert rotation == pytest.approx(np.diag([1.0, -1.0, -1.0]), abs=1e-9)


def test_the_camera_is_level_and_its_optical_frame_looks_along_z(buffer):
    assert buffer.lookup("base_footprint", "camera_depth_frame").rotation == pytest.approx(np.eye(3))
    optical = buffer.lookup("base_footprint", "camera_depth_optical_frame")
    assert optical.rotation @ [0.0, 0.0, 1.0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert optical.rotation @ [1.0, 0.0, 0.0] == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)
    assert optical.rotation @ [0.0, 1.0, 0.0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


def test_yourdfpy_agrees_on_every_frame(robot, buffer):
    yourdfpy = pytest.importorskip("yourdfpy")
    model = yourdfpy.URDF.load(
        io.BytesIO(robot.urdf_text.encode()),
        load_meshes=False,
        build_scene_graph=True,
        load_collision_meshes=False,
    )
    assert model.validate()
    assert model.base_link == "base_footprint"
    children = [child for _, child, _ in robot.frames]
    assert sorted(model.link_map) == sorted(["base_footprint", *children])
    for child in children:
        theirs = model.get_transform(child, "base_footprint")
        ours = buffer.lookup("base_footprint", child)
        assert theirs[:3, :3] == pytest.approx(ours.rotation, abs=1e-9)
        assert theirs[:3, 3] == pytest.approx(ours.translation, abs=1e-9)


def test_standoffs_have_the_heights_of_the_document_and_thin_collision_shapes(robot):
    yourdfpy = pytest.importorskip("yourdfpy")
    model = yourdfpy.URDF.load(
        io.BytesIO(robot.urdf_text.encode()), load_meshes=False, build_scene_graph=False
    )
    standoffs = {name: link for name, link in model.link_map.items() if name.startswith("standoff_")}
    assert len(standoffs) == 12
    for name, link in standoffs.items():
        length = float(name.split("_")[1].removesuffix("cm")) / 100
        for shape in (*link.visuals, *link.collisions):
            assert shape.geometry.cylinder.length == length
            assert shape.geometry.cylinder.radius == 0.005
    assert "standoff_25cm_4_link" in standoffs


def test_the_standoffs_that_the_laser_sees_are_within_the_robot_radius(robot, buffer):
    laser = buffer.lookup("base_footprint", "base_laser_round_link").translation
    for _, child, _ in robot.frames:
        if child.startswith("standoff_10cm"):
            foot = buffer.lookup("base_footprint", child).translation
            assert math.hypot(*(foot - laser)[:2]) < 0.25


def test_parents_come_before_their_children_and_the_text_tells_no_path(robot):
    known = {"base_footprint"}
    for parent, child, _ in robot.frames:
        assert parent in known
        known.add(child)
    assert str(default_file().parent) not in robot.urdf_text


def test_a_file_is_read_once(robot):
    assert load_description() is robot
    assert load_description(default_file()) is robot


def urdf(*lines: str) -> str:
    return "\n".join(("<robot name='r'>", *lines, "</robot>"))


LINKS = "<link name='a'/><link name='b'/><link name='c'/>"


def joint(name: str, parent: str, child: str, inside: str = "", kind: str = "fixed") -> str:
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
    )


def test_a_small_robot_by_hand():
    text = urdf(LINKS, joint("2", "b", "c", "<origin xyz='0 1 0'/>", "continuous"), joint("1", "a", "b"))
    (first, second) = static_frames(text)
    assert first[:2] == ("a", "b")
    assert second[:2] == ("b", "c")
    assert list(second[2].translation) == [0.0, 1.0, 0.0]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<robot><link></robot>", r"1:16: .*not XML"),
        ("<sdf/>", r"starts with <sdf>.*<robot>"),
        (urdf("<link/>"), "a <link> has no name"),
        (urdf("<link name='/a'/>"), r"no leading slash: '/a' \(would have worked: a\)"),
        (urdf("<link name='a'/><link name='a'/>"), "'a' is defined twice|exactly one"),
        (urdf(LINKS, joint("1", "a", "bb")), r"unknown link 'bb' \(would have worked: b"),
        (urdf(LINKS, joint("1", "a", "b", kind="floating")), "'floating'.*fixed"),
        (urdf(LINKS, "<joint name='1' type='fixed'><parent link='a'/></joint>"), "joint '1' has no child"),
        (urdf(LINKS, joint("1", "a", "b", "<origin xyz='1 2'/>")), "xyz='1 2' of joint '1' is not three"),
        (urdf(LINKS, joint("1", "a", "b", "<origin rpy='0 0 nan'/>")), "rpy='0 0 nan'"),
        (urdf(LINKS, joint("1", "a", "b", "<origin rpy='0 zero 0'/>")), "rpy='0 zero 0'"),
        (urdf(LINKS, joint("1", "a", "b"), joint("2", "c", "b")), "'b' hangs on both 'a' and 'c'"),
        (urdf(LINKS, joint("1", "a", "b")), "exactly one link without a parent; found a, c"),
        (urdf(LINKS, joint("1", "b", "c"), joint("2", "c", "b")), "loop apart from the robot: c, b|b, c"),
        (
            urdf(LINKS, joint("1", "a", "b"), joint("2", "b", "c"), joint("3", "c", "a")),
            "the joints form a loop",
        ),
    ],
)
def test_wrong_descriptions_are_explained(text, problem):
    with pytest.raises(ConfigError, match=problem):
        static_frames(text)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<robot name='r'>\n<link></robot>", r"robot.xacro:2:\d+: not well-formed XML"),
        (
            "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'><link name='${length}'/></robot>",
            "robot.xacro: xacro cannot expand it.*length",
        ),
        (urdf(LINKS, joint("1", "a", "bb")), "robot.xacro: .*unknown link 'bb'"),
    ],
)
def test_wrong_files_are_named(tmp_path: Path, text, problem):
    file = tmp_path / "robot.xacro"
    file.write_text(text)
    with pytest.raises(ConfigError, match=f"(?s){problem}"):
        load_description(file)


def test_a_missing_file_names_its_neighbours(tmp_path: Path):
    (tmp_path / "other.xacro").write_text("<robot/>")
    with pytest.raises(ConfigError, match=r"does not exist \(would have worked: .*other.xacro\)"):
        load_description(tmp_path / "robot.xacro")


def test_footprint_of_the_document():
    footprint = Footprint.from_corners(corners_from_flat(FLORENCE_FOOTPRINT))
    assert footprint.inscribed_radius == pytest.approx(0.16)
    assert footprint.circumscribed_radius == pytest.approx(0.2484, abs=1e-4)
    assert DescriptionParameters().footprint == FLORENCE_FOOTPRINT


@pytest.mark.parametrize(
    "numbers",
    [(0.0,) * 5, (0.0, 0.0, 1.0, 1.0), (0.0, 0.0, 1.0, 1.0, 2.0, 2.0), (0.0, 0.0, 1.0, 0.0, 1.0, math.nan)],
)
def test_wrong_footprints_are_refused(numbers):
    with pytest.raises(ConfigError, match="would have worked"):
        DescriptionParameters(footprint=numbers)


def test_the_robots_configuration_fits_its_description(buffer):
    footprint = Footprint.from_corners(corners_from_flat(FLORENCE_FOOTPRINT))
    file = default_file().parents[1] / "config" / "robot.yaml"
    config = yaml.safe_load(file.read_text(encoding="utf-8"))
    camera_height = buffer.lookup("base_footprint", "camera_depth_frame").translation[2]
    assert camera_height + config["kinect_laser"]["min_height"] == pytest.approx(0.15, abs=0.002)
    assert camera_height + config["kinect_laser"]["max_height"] == pytest.approx(1.0, abs=0.002)
    assert (
        DescriptionParameters(footprint=tuple(config["robot_description"]["footprint"]))
        == DescriptionParameters()
    )
    assert config["laser_filter"]["robot_radius"] >= footprint.circumscribed_radius


def test_wheels_turn_about_the_axle(robot):
    left, right = robot.joints
    assert (left.name, right.name) == ("left_wheel_joint", "right_wheel_joint")
    quarter = left.at(math.pi / 2)
    # A point ahead of the axle is below it after a quarter turn forward (about +y).
    assert quarter.apply(np.array([0.033, 0.0, 0.0])) == pytest.approx([0.0, 0.13, 0.015 - 0.033])
    assert np.allclose(left.at(0.0).translation, left.origin.translation)
    fixed = [child for _, child, _ in robot.fixed_frames]
    assert "left_wheel_link" not in fixed and len(fixed) == len(robot.frames) - 2


def test_a_joint_without_a_direction_is_refused():
    text = (
        "<robot><link name='a'/><link name='b'/><joint name='j' type='continuous'>"
        "<parent link='a'/><child link='b'/><axis xyz='0 0 0'/></joint></robot>"
    )
    with pytest.raises(ConfigError, match="'j' has no direction"):
        turning_joints(text)
