"""The laser filter against the test vectors of REFERENCE, section 13."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import LaserScan
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter, LaserFilterParameters

NAN, INF = math.nan, math.inf
VECTOR = (0.1, 0.5, 5.6, 0.0, NAN, INF)


def scan_of(ranges, range_max: float = 5.6) -> LaserScan:
    return LaserScan(3.0, "laser", -1.0, 0.1, 0.02, range_max, np.array(ranges, np.float32), 0.001, 0.1)


def filtered(ranges, range_max: float = 5.6, **parameters) -> np.ndarray:
    return LaserFilter(LaserFilterParameters(**parameters)).filter(scan_of(ranges, range_max)).ranges


def test_vector_in_the_default_order():
    result = filtered(VECTOR)
    assert result.dtype == np.float32
    np.testing.assert_array_equal(result, np.float32([NAN, 0.5, 5.5999, 5.5999, NAN, 5.5999]))


def test_vector_in_the_old_order():
    result = filtered(VECTOR, legacy_sequential=True)
    np.testing.assert_array_equal(result, np.float32([5.5999, 0.5, 5.5999, 5.5999, NAN, 5.5999]))


@pytest.mark.parametrize("range_max", [4.0, 5.6, float(np.float32(5.6)), 60.0, 1e5, 1e30])
@pytest.mark.parametrize("legacy", [False, True])
def test_a_far_beam_is_valid_for_every_range_max(range_max, legacy):
    result = LaserFilter(LaserFilterParameters(legacy_sequential=legacy)).filter(scan_of([INF], range_max))
    assert result.valid().all()
    assert result.ranges[0] == pytest.approx(range_max - 1e-4, rel=2e-7)


def test_far_beams_at_the_kinects_reach():
    assert filtered([4.0], 4.0)[0] == np.float32(3.9999)


@pytest.mark.parametrize("useless", [5.61, 6.6, 65.533, 1e30, -0.5, 0.3])
def test_no_measurement_does_not_clear(useless):
    """REP-117: beyond range_max, below 0, or nearer than the sensor can measure."""
    scan = replace(scan_of([useless]), range_min=0.45)
    assert np.isnan(LaserFilter().filter(scan).ranges).all()


def test_the_limits_themselves():
    # At a limit is out of range, at the robot's radius is outside the robot.
    result = filtered([np.float32(5.6), np.nextafter(np.float32(5.6), np.float32(0)), 0.02, 0.25, 0.2499])
    np.testing.assert_array_equal(
        result,
        [np.float32(5.5999), np.nextafter(np.float32(5.6), np.float32(0)), np.float32(5.5999), 0.25, NAN],
    )


def test_too_close_to_measure_does_not_clear():
    assert np.isnan(filtered([-INF]))[0]


def test_the_old_order_clears_with_every_range_beyond_the_limit():
    np.testing.assert_array_equal(filtered([6.6, 1e30], legacy_sequential=True), np.float32([5.5999] * 2))


def test_error_codes_of_the_laser_clear():
    np.testing.assert_array_equal(filtered([0.0, 0.001, 0.019]), np.float32([5.5999] * 3))


def test_only_the_ranges_change():
    scan = scan_of(VECTOR)
    before = scan.ranges.copy()
    result = LaserFilter().filter(scan)
    np.testing.assert_array_equal(scan.ranges, before)
    for name in ("stamp", "frame_id", "angle_min", "angle_increment", "range_min", "range_max", "scan_time"):
        assert getattr(result, name) == getattr(scan, name)


def test_an_empty_scan():
    assert filtered([]).shape == (0,)


@given(hnp.arrays(np.float32, st.integers(0, 30), elements=st.floats(width=32)))
def test_what_comes_out_is_valid_or_nan_and_filtering_twice_changes_nothing(ranges):
    once = LaserFilter().filter(scan_of(ranges))
    assert np.all(once.valid() | np.isnan(once.ranges))
    np.testing.assert_array_equal(LaserFilter().filter(once).ranges, once.ranges)


@pytest.mark.parametrize("wrong", [{"robot_radius": -0.1}, {"robot_radius": NAN}, {"far_epsilon": 0.0}])
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(ConfigError, match="would have worked"):
        LaserFilterParameters(**wrong)
