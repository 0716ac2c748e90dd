"""The fake laser, on synthetic pictures of walls, table tops and floors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser, FakeLaserParameters
from tests.sweeps import examples

CAMERA = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)
CAMERA_HEIGHT = 0.54
ROBOT = FakeLaserParameters(min_height=0.15 - CAMERA_HEIGHT, max_height=1.0 - CAMERA_HEIGHT)
EMPTY = math.inf


def picture(depth: np.ndarray, camera: CameraModel = CAMERA, stamp: float = 7.0) -> DepthImage:
    return DepthImage(stamp, "camera_depth_optical_frame", camera, depth.astype(np.float32))


def rays() -> tuple[np.ndarray, np.ndarray]:
    """Per pixel: metres to the right and downwards per metre of depth."""
    right = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    down = (np.arange(CAMERA.height) - CAMERA.cy) / CAMERA.fy
    return np.broadcast_to(right, (240, 320)), np.broadcast_to(down[:, None], (240, 320))


def floor(tilt: float = 0.0) -> np.ndarray:
    """Depth of the floor, NaN above the horizon; the camera tilted downwards by some radians."""
    _, down = rays()
    slope = np.tan(np.arctan(down) + tilt)
    with np.errstate(divide="ignore"):
        depth = CAMERA_HEIGHT / slope
    return np.where((slope > 0) & (depth < 9.0), depth, np.nan)


def table_top(height: float, near: float, far: float) -> np.ndarray:
    """Depth of a board at a height, between two distances, as wide as the view; NaN elsewhere."""
    _, down = rays()
    with np.errstate(divide="ignore"):
        depth = (CAMERA_HEIGHT - height) / down
    return np.where((depth >= near) & (depth <= far), depth, np.nan)


def by_point_cloud(image: DepthImage, parameters: FakeLaserParameters) -> np.ndarray:
    """The old nodelet's way, point by point (REFERENCE 6.1)."""
    camera, ranges = image.camera, np.full(parameters.beam_count, math.inf)
    for v in range(camera.height):
        for u in range(camera.width):
            z = float(image.depth[v, u])
            if math.isnan(z) or not 0.0 < z < math.inf:
                continue
            x, y = (u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy
            angle, distance = -math.atan2(x, z), math.hypot(x, z)
            if not parameters.min_height <= -y <= parameters.max_height or distance < parameters.range_min:
                continue
            if not parameters.angle_min <= angle <= parameters.angle_max:
                continue
            beam = int((angle - parameters.angle_min) / parameters.angle_increment)
            beam = min(beam, parameters.beam_count - 1)
            if distance < parameters.range_max:
                ranges[beam] = min(ranges[beam], distance)
    return ranges


def test_a_flat_wall_gives_the_distance_along_every_beam():
    scan = FakeLaser().project(picture(np.full((240, 320), 2.0)))
    assert (scan.stamp, scan.frame_id) == (7.0, "camera_depth_frame")
    assert len(scan.ranges) == 360 and scan.ranges.dtype == np.float32
    assert (scan.angle_min, scan.angle_increment) == (-math.pi / 2, math.pi / 360)
    assert (scan.time_increment, scan.scan_time) == (0.0, pytest.approx(1 / 30))
    half_view = math.atan(159.5 / 262.5)
    for angle, distance in zip(scan.angles(), scan.ranges, strict=True):
        if abs(angle + math.pi / 720) > half_view + math.pi / 720:
            assert distance == EMPTY
        elif abs(angle) < half_view - math.pi / 180:
            # The nearest point of a beam is at its inner edge.
            inner = min(abs(angle), abs(angle + math.pi / 360))
            assert distance == pytest.approx(2.0 / math.cos(inner), abs=0.012)


def test_something_on_the_left_is_at_positive_angles():
    depth = np.full((240, 320), np.nan)
    depth[:, 20] = 1.5
    scan = FakeLaser().project(picture(depth))
    (hit,) = np.flatnonzero(scan.ranges < 4.0)
    true_angle = math.atan((159.5 - 20) / 262.5)
    assert scan.angles()[hit] <= true_angle < scan.angles()[hit] + scan.angle_increment
    assert scan.ranges[hit] == pytest.approx(1.5 / math.cos(true_angle), rel=1e-6)


def test_the_floor_is_no_obstacle():
    for tilt in (0.0, math.radians(1.5)):
        scan = FakeLaser(ROBOT).project(picture(floor(tilt)))
        assert not scan.valid().any()


def test_the_floor_would_be_one_without_the_lower_edge():
    low = replace(ROBOT, min_height=-0.6)
    assert FakeLaser(low).project(picture(floor())).valid().any()


def test_a_table_top_above_the_laser_is_seen_at_its_edge():
    scan = FakeLaser(ROBOT).project(picture(np.fmin(table_top(0.35, 1.3, 2.0), floor())))
    ahead = scan.ranges[179:181]
    assert ahead == pytest.approx(1.3, abs=0.05)
    assert np.all(ahead >= np.float32(1.3))


def test_a_lamp_above_the_robot_is_no_obstacle():
    assert not FakeLaser(ROBOT).project(picture(table_top(1.05, 1.2, 2.5))).valid().any()
    assert FakeLaser(ROBOT).project(picture(table_top(0.95, 1.2, 2.5))).valid().any()


@pytest.mark.parametrize("hole", [np.nan, np.inf, 0.0, -1.0])
def test_holes_are_no_points(hole):
    scan = FakeLaser().project(picture(np.full((240, 320), hole)))
    assert np.all(scan.ranges == EMPTY)


def test_too_near_points_do_not_hide_what_is_behind():
    depth = np.full((240, 320), 2.0)
    depth[110:130] = 0.3
    assert FakeLaser().project(picture(depth)).ranges[180] == pytest.approx(2.0, abs=0.01)


def test_points_beyond_range_max_are_no_measurements():
    scan = FakeLaser().project(picture(np.full((240, 320), 4.5)))
    assert not scan.valid().any()


@pytest.mark.parametrize(
    ("angle_max", "expected_beam"), [(math.atan(0.5), -1), (math.atan(0.5) - 1e-9, None)], ids=["at", "past"]
)
def test_an_angle_of_exactly_angle_max_falls_into_the_last_beam(angle_max, expected_beam):
    camera = CameraModel(1, 1, 1.0, 1.0, 0.5, 0.0)
    parameters = FakeLaserParameters(angle_min=angle_max - 0.4, angle_max=angle_max, angle_increment=0.1)
    scan = FakeLaser(parameters).project(picture(np.full((1, 1), 2.0), camera))
    hits = np.flatnonzero(scan.ranges < 4.0)
    assert list(hits) == ([] if expected_beam is None else [len(scan.ranges) - 1])


def test_directions_without_any_measurement_can_be_nan():
    depth = floor()
    depth[:, :160] = np.nan
    scan = FakeLaser(replace(ROBOT, unseen_as_nan=True)).project(picture(depth))
    half_view = math.atan(159.5 / 262.5)
    seen = ~np.isnan(scan.ranges)
    centres = scan.angles() + scan.angle_increment / 2
    assert not seen[centres > 0.0].any()
    assert not seen[centres < -half_view - 0.01].any()
    inside = (centres < 0.0) & (centres > -half_view + 0.01)
    assert np.all(scan.ranges[inside] == EMPTY)


@settings(max_examples=examples(25))
@given(st.integers(0, 2**32 - 1), st.floats(-0.5, 0.0), st.floats(0.01, 0.5))
def test_it_equals_the_point_cloud_way(seed, low, high):
    generator = np.random.default_rng(seed)
    camera = CameraModel(24, 18, 20.0, 21.0, 11.3, 8.6)
    depth = generator.uniform(0.2, 6.0, (18, 24))
    depth[generator.random((18, 24)) < 0.3] = np.nan
    parameters = FakeLaserParameters(min_height=low, max_height=high)
    image = picture(depth, camera)
    scan = FakeLaser(parameters).project(image)
    assert scan.ranges == pytest.approx(by_point_cloud(image, parameters), rel=1e-5)


def test_a_new_camera_is_noticed():
    laser = FakeLaser()
    laser.project(picture(np.full((240, 320), 2.0)))
    small = CameraModel(160, 120, 131.25, 131.25, 79.5, 59.5)
    assert laser.project(picture(np.full((120, 160), 2.0), small)).ranges[180] == pytest.approx(2.0, abs=0.01)


def test_a_picture_that_does_not_fit_its_camera_is_refused():
    with pytest.raises(FrameError, match="240 rows and 320 columns"):
        FakeLaser().project(picture(np.full((120, 160), 2.0)))
    with pytest.raises(FrameError, match="focal lengths"):
        FakeLaser().project(picture(np.full((240, 320), 2.0), replace(CAMERA, fx=0.0)))
    with pytest.raises(FrameError, match="finite"):
        FakeLaser().project(picture(np.full((240, 320), 2.0), replace(CAMERA, cx=math.nan)))


@pytest.mark.parametrize(
    "wrong",
    [
        {"min_height": 0.2},
        {"range_min": 0.0},
        {"range_min": 5.0},
        {"range_max": math.inf},
        {"angle_min": 2.0},
        {"angle_increment": 0.0},
        {"angle_min": -0.2, "angle_max": 0.2, "angle_increment": 0.5},
        {"angle_increment": math.nan},
        {"scan_time": -1.0},
    ],
)
def test_wrong_parameters_are_refused_with_what_would_work(wrong):
    with pytest.raises(ConfigError, match="would have worked"):
        FakeLaserParameters(**wrong)


def test_one_beam_may_be_as_wide_as_the_scan():
    assert FakeLaserParameters(angle_min=-0.25, angle_max=0.25, angle_increment=0.5).beam_count == 1


def test_the_defaults_have_360_beams():
    assert FakeLaserParameters().beam_count == 360
