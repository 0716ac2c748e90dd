"""REP-117 wherever ranges are read: what is no measurement marks, clears, matches and maps nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, DepthImage, LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser, FakeLaserParameters
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters, merge_scans
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter
from florence_bt.skills.navigation.mapping.kept_scan import keep_scan
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, rays_of
from tests.sweeps import examples

NAN, INF = math.nan, math.inf
RANGE_MIN, RANGE_MAX, BEAMS = 0.1, 5.6, 80
MOUNT = Transform3.from_xyz_rpy((0.05, 0.0, 0.1), (math.pi, 0.0, 0.0))
NO_MEASUREMENT = st.one_of(
    st.floats(float(np.float32(5.61)), float(np.float32(1e30)), width=32),
    st.floats(float(np.float32(-1e30)), float(np.float32(-0.001)), width=32),
    st.floats(float(np.float32(0.03)), float(np.float32(0.09)), width=32),
    st.sampled_from([NAN, -INF]),
)
"""Beyond the limit, below zero, between error codes and the nearest range, or said to be none."""
RANGE = st.one_of(
    NO_MEASUREMENT, st.just(INF), st.floats(float(np.float32(0.3)), float(np.float32(5.5)), width=32)
)
KINECT = LaserScan(1.0, "camera", -0.5, 0.0125, 0.5, 4.0, np.full(BEAMS, INF, np.float32))


def scan_of(ranges: list[float]) -> LaserScan:
    return LaserScan(1.0, "laser", -0.5, 0.0125, RANGE_MIN, RANGE_MAX, np.array(ranges, np.float32))


def told(scan: LaserScan) -> LaserScan:
    """The same scan from a laser that says NaN whenever it measured nothing."""
    measured = scan.valid() | (scan.ranges == INF)
    return replace(scan, ranges=np.where(measured, scan.ranges, np.float32(NAN)))


def costs(scan: LaserScan) -> np.ndarray:
    """What is left of a wall all around, and what a scan marks, in a costmap."""
    costmap = Costmap(CostmapParameters())
    wall = replace(scan, ranges=np.full(BEAMS, 1.5, np.float32))
    for each in (wall, LaserFilter().filter(merge_scans(scan, KINECT, CombinatorParameters()))):
        costmap.add_rays("scan", rays_of(each, MOUNT), Pose2())
    return costmap.master.copy()


@settings(max_examples=examples(60))
@given(st.lists(RANGE, min_size=BEAMS, max_size=BEAMS))
def test_a_scan_says_no_more_than_one_with_nan_in_place_of_what_is_no_measurement(
    ranges: list[float],
) -> None:
    scan = scan_of(ranges)
    plain = told(scan)
    for of in (scan, merge_scans(scan, KINECT, CombinatorParameters())):
        filtered = LaserFilter().filter(of)
        assert not (np.isnan(plain.ranges) & filtered.valid()).any()
    np.testing.assert_array_equal(costs(scan), costs(plain))
    np.testing.assert_array_equal(beam_ends(scan, MOUNT, RANGE_MIN), beam_ends(plain, MOUNT, RANGE_MIN))
    kept, of_plain = keep_scan(scan, MOUNT, SlamParameters()), keep_scan(plain, MOUNT, SlamParameters())
    np.testing.assert_array_equal(kept.points, of_plain.points)
    np.testing.assert_array_equal(kept.clear, of_plain.clear)


@pytest.mark.parametrize(("answer", "stays"), [(INF, False), (RANGE_MAX, False), (6.6, True), (65.533, True)])
def test_only_a_laser_that_met_nothing_clears(answer: float, stays: bool) -> None:
    assert bool((costs(scan_of([answer] * BEAMS)) == LETHAL).any()) is stays


@pytest.mark.parametrize(
    ("depth", "clears"), [(9.0, True), (NAN, False), (0.0, False), (-INF, False), (INF, False)]
)
def test_a_depth_image_clears_where_it_saw_as_far_as_it_can(depth: float, clears: bool) -> None:
    """9 m is further than the scan reaches: nothing is nearer."""
    camera = CameraModel(320, 24, 262.5, 262.5, 159.5, 11.5)
    image = DepthImage(1.0, "camera", camera, np.full((24, 320), depth, np.float32))
    laser = FakeLaser(FakeLaserParameters(min_height=-9.0, max_height=9.0, unseen_as_nan=True))
    ahead = LaserFilter().filter(laser.project(image)).ranges[170:190]
    assert (ahead == np.float32(3.9999)).all() if clears else np.isnan(ahead).all()
