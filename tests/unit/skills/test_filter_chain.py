"""Depth picture and laser scan to the filtered scan, with the robot's own description and configuration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import yaml

from florence_bt.core.sensing import CameraModel, DepthImage, LaserScan
from florence_bt.core.transforms import TransformBuffer
from florence_bt.simulation.rig.components import parameters_of
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser, FakeLaserParameters
from florence_bt.skills.filters.laser_combinator.combinator import LaserCombinator
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter
from florence_bt.skills.robot_description.description import default_file, load_description

CAMERA = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope="module")
def config() -> dict[str, dict[str, Any]]:
    return yaml.safe_load((default_file().parents[1] / "config" / "robot.yaml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def frames() -> TransformBuffer:
    buffer = TransformBuffer()
    load_description().fill(buffer)
    return buffer


@pytest.fixture
def fake_laser(config: dict[str, dict[str, Any]]) -> FakeLaser:
    return FakeLaser(parameters_of(FakeLaserParameters, config, "kinect_laser"))


@pytest.fixture
def combinator(config: dict[str, dict[str, Any]], frames: TransformBuffer) -> LaserCombinator:
    mounting = frames.lookup("base_laser_round_link", "camera_depth_frame")
    return LaserCombinator(CombinatorParameters(**config["laser_combinator"]), mounting)


def picture_of_wall(frames: TransformBuffer, x: float, low: float = -9.0, high: float = 9.0) -> DepthImage:
    """A wall across the way at x in base_footprint, between two heights above the floor; NaN elsewhere."""
    camera = frames.lookup("base_footprint", "camera_depth_optical_frame").translation
    depth = np.full((240, 320), x - camera[0], np.float32)
    height = camera[2] + depth * (CAMERA.cy - np.arange(240)[:, None]) / CAMERA.fy
    depth[(height < low) | (height > high)] = np.nan
    return DepthImage(5.0, "camera_depth_optical_frame", CAMERA, depth)


def laser_on_wall(frames: TransformBuffer, x: float) -> LaserScan:
    laser = frames.lookup("base_footprint", "base_laser_round_link").translation
    angles = -math.pi / 2 + math.pi / 511 * np.arange(512)
    with np.errstate(divide="ignore"):
        ranges = (x - laser[0]) / np.cos(angles)
    ranges[ranges > 5.6] = 0.001
    return LaserScan(
        5.0, "base_laser_round_link", -math.pi / 2, math.pi / 511, 0.02, 5.6, ranges.astype(np.float32)
    )


def test_both_sensors_agree_on_a_wall(frames, fake_laser, combinator):
    laser = laser_on_wall(frames, 2.5)
    combinator.update_laser(laser, 5.0)
    combined = combinator.update_kinect(fake_laser.project(picture_of_wall(frames, 2.5)), 5.0)
    assert combined is not None
    ahead = np.abs(laser.angles()) < math.radians(30)
    assert combined.ranges[ahead] == pytest.approx(laser.ranges[ahead], abs=0.03)


@pytest.mark.parametrize("x", [1.2, 2.0, 3.0])
def test_a_board_above_the_laser_plane_is_in_the_filtered_scan_where_it_is(frames, fake_laser, combinator, x):
    combinator.update_laser(laser_on_wall(frames, 4.5), 5.0)
    combined = combinator.update_kinect(fake_laser.project(picture_of_wall(frames, x, 0.5, 0.7)), 5.0)
    assert combined is not None
    filtered = LaserFilter().filter(combined)
    ahead = np.abs(filtered.angles()) < math.radians(25)
    ranges, angles = filtered.ranges[ahead].astype(float), filtered.angles()[ahead]
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(angles))], axis=1)
    in_base = frames.lookup("base_footprint", "base_laser_round_link").apply(points)
    assert in_base[:, 0] == pytest.approx(x, abs=0.03)
    # Out of the Kinect's view the laser still sees the wall behind.
    aside = filtered.valid() & (np.abs(np.abs(filtered.angles()) - math.radians(38)) < math.radians(2))
    assert filtered.ranges[aside].min() > 4.0


def test_a_board_on_the_left_is_on_the_left(frames, fake_laser, combinator):
    image = picture_of_wall(frames, 2.0, 0.5, 0.7)
    image.depth[:, 120:] = np.nan
    combinator.update_laser(laser_on_wall(frames, 4.5), 5.0)
    combined = combinator.update_kinect(fake_laser.project(image), 5.0)
    assert combined is not None
    near = combined.ranges < 2.5
    to_base = frames.lookup("base_footprint", "base_laser_round_link")
    angles, ranges = combined.angles()[near], combined.ranges[near].astype(float)
    points = to_base.apply(np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * ranges], axis=1))
    assert len(points) > 20
    assert (points[:, 1] > 0.2).all()


def test_the_kinect_alone_clears_only_what_it_saw(frames, fake_laser):
    image = picture_of_wall(frames, 3.0, -0.5, 0.1)  # only floor-high things: free, and seen
    filtered = LaserFilter().filter(fake_laser.project(image))
    half_view = math.atan(159.5 / 262.5)
    middle = np.abs(filtered.angles()) < half_view - 0.02
    assert np.all(filtered.ranges[middle] == np.float32(3.9999))
    assert np.isnan(filtered.ranges[np.abs(filtered.angles()) > half_view + 0.02]).all()
