import math

import numpy as np
import pytest

from florence_bt.drivers.kinect.camera import camera_model, depth_to_points


def test_the_cameras_of_the_reference() -> None:
    vga = camera_model(640, 480)
    assert (vga.fx, vga.fy, vga.cx, vga.cy) == (525.0, 525.0, 319.5, 239.5)
    half = camera_model(320, 240)
    assert (half.fx, half.fy, half.cx, half.cy) == (262.5, 262.5, 159.5, 119.5)
    across = 2 * math.degrees(math.atan(320 / 525.0))
    down = 2 * math.degrees(math.atan(240 / 525.0))
    assert (across, down) == (pytest.approx(62.7, abs=0.1), pytest.approx(49.1, abs=0.1))


def test_points_lie_on_the_rays_of_their_pixels() -> None:
    camera = camera_model(32, 24)
    depth = np.random.default_rng(1).uniform(0.5, 5.0, (24, 32)).astype(np.float32)
    points = depth_to_points(depth, camera)
    assert points.shape == (24, 32, 3)
    assert points.dtype == np.float32
    v, u = np.mgrid[:24, :32]
    np.testing.assert_allclose(points[..., 2], depth)
    np.testing.assert_allclose(points[..., 0] * camera.fx / depth + camera.cx, u, atol=1e-4)
    np.testing.assert_allclose(points[..., 1] * camera.fy / depth + camera.cy, v, atol=1e-4)


def test_signs_right_and_down_are_positive() -> None:
    points = depth_to_points(np.full((4, 4), 2.0, np.float32), camera_model(4, 4))
    assert points[0, 0, 0] < 0 < points[0, 3, 0]
    assert points[0, 0, 1] < 0 < points[3, 0, 1]


def test_nothing_measured_stays_nothing() -> None:
    depth = np.full((2, 2), np.nan, np.float32)
    assert np.isnan(depth_to_points(depth, camera_model(2, 2))).all()
