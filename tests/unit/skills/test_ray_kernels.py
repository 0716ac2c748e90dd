"""Beams and points in another frame: what the compiled loops give is what plain numpy gives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate.costmap import moved_points, rays_of


def a_scan(ranges: list[float]) -> LaserScan:
    values = np.array(ranges, np.float32)
    return LaserScan(0.0, "laser", -1.0, 0.01, 0.02, 5.6, values)


@pytest.mark.parametrize("roll", [0.0, math.pi])
def test_beams_end_where_their_sensor_says(roll: float) -> None:
    ranges = [1.0, math.nan, 0.019, 0.02, 5.6, 5.599, math.inf, -math.inf, 2.5]
    scan = a_scan(ranges)
    mount = Transform3.from_xyz_rpy((0.1, -0.2, 0.3), (roll, 0.0, 0.4))
    rays = rays_of(scan, mount)
    valid = scan.valid()
    points = np.column_stack([scan.ranges[valid, None] * scan.directions()[valid], np.zeros(valid.sum())])
    np.testing.assert_allclose(rays.ends, mount.apply(points)[:, :2], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(rays.ranges, scan.ranges[valid])


def test_a_scan_without_a_usable_beam_has_no_rays() -> None:
    rays = rays_of(a_scan([math.nan, 9.0]), Transform3.identity())
    assert rays.ends.shape == (0, 2) and rays.ranges.shape == (0,)


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int64])
def test_points_move_whatever_they_are_kept_in(dtype: type) -> None:
    rows = np.arange(12).reshape(3, 4).astype(dtype)
    motion = Pose2(1.0, -2.0, 0.7)
    expected = [motion.apply(float(x), float(y)) for x, y in rows[:, :2]]
    np.testing.assert_allclose(moved_points(rows[:, :2], motion), expected, rtol=0.0, atol=1e-12)
    assert moved_points(np.empty((0, 2)), motion).shape == (0, 2)
