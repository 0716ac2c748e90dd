"""The laser combinator: the merge by equal angles, the merge with moved origin, and freshness."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.laser_combinator.combinator import LaserCombinator
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters, merge_scans
from tests.sweeps import examples

NAN, INF = math.nan, math.inf
DEGREE = math.pi / 180
SEED = CombinatorParameters()
UPSIDE_DOWN = Transform3.from_xyz_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))
# Kinect and laser of our robot: 0.1444 m apart, the laser rolled by pi.
MOUNTING = Transform3.from_xyz_rpy((-0.1444, -0.018, -0.41), (math.pi, 0.0, 0.0))


def laser_scan(ranges=None, stamp: float = 10.0, **changes) -> LaserScan:
    """512 beams over +-90 degrees, as the URG-04LX gives them."""
    values = np.full(512, 3.0) if ranges is None else np.asarray(ranges)
    scan = LaserScan(
        stamp=stamp,
        frame_id="base_laser_round_link",
        angle_min=-math.pi / 2,
        angle_increment=math.pi / 511,
        range_min=0.02,
        range_max=5.6,
        ranges=values.astype(np.float32),
        time_increment=0.0001,
        scan_time=0.1,
        intensities=np.arange(3, dtype=np.float32),
    )
    return replace(scan, **changes)


def kinect_scan(ranges=None, stamp: float = 10.0, **changes) -> LaserScan:
    """360 beams of half a degree, empty ones at range_max + 1 as the old nodelet wrote them."""
    values = np.full(360, 5.0) if ranges is None else np.asarray(ranges)
    scan = LaserScan(
        stamp=stamp,
        frame_id="camera_depth_frame",
        angle_min=-math.pi / 2,
        angle_increment=math.pi / 360,
        range_min=0.5,
        range_max=4.0,
        ranges=values.astype(np.float32),
    )
    return replace(scan, **changes)


def kinect_seeing(azimuth: float, distance: float, **changes) -> LaserScan:
    scan = kinect_scan(**changes)
    scan.ranges[round((azimuth - scan.angle_min) / scan.angle_increment)] = distance
    return scan


def test_the_grid_and_the_fields_come_from_the_laser():
    laser = laser_scan()
    result = merge_scans(laser, kinect_scan(stamp=10.4), SEED)
    for name in (
        "stamp",
        "frame_id",
        "angle_min",
        "angle_increment",
        "range_min",
        "time_increment",
        "scan_time",
    ):
        assert getattr(result, name) == getattr(laser, name)
    np.testing.assert_array_equal(result.intensities, laser.intensities)
    assert result.range_max == 5.6
    assert result.ranges.dtype == np.float32
    np.testing.assert_array_equal(result.ranges, laser.ranges)


def test_something_on_the_left_shows_at_a_negative_angle_of_the_laser():
    result = merge_scans(laser_scan(), kinect_seeing(20 * DEGREE, 1.5), SEED)
    hits = np.flatnonzero(result.ranges == 1.5)
    assert len(hits) in (1, 2)
    assert np.allclose(result.angles()[hits], -20 * DEGREE, atol=math.pi / 720)


def test_a_laser_that_stands_upright():
    result = merge_scans(
        laser_scan(), kinect_seeing(20 * DEGREE, 1.5), CombinatorParameters(upside_down=False)
    )
    hits = np.flatnonzero(result.ranges == 1.5)
    assert np.allclose(result.angles()[hits], 20 * DEGREE, atol=math.pi / 720)


@pytest.mark.parametrize(
    ("own", "kinects", "expected"),
    [
        (3.0, 2.0, 2.0),
        (1.0, 2.0, 1.0),
        (0.0, 2.0, 2.0),  # error code of the Hokuyo
        (0.019, 2.0, 2.0),
        (NAN, 2.0, 2.0),
        (INF, 2.0, 2.0),
        (5.6, 2.0, 2.0),
        (5.0, 5.0, 5.0),  # the Kinect is empty; the laser's far hit survives
        (3.0, 0.4, 3.0),  # nearer than the Kinect can measure
        (3.0, 4.0, 3.0),  # at range_max: not valid
        (3.0, NAN, 3.0),
        (3.0, INF, 3.0),
        (3.0, -INF, 3.0),
        (0.001, 5.0, INF),  # nothing within range, or an echo that was too weak
        (5.6, INF, INF),
        (INF, NAN, INF),
        (NAN, NAN, NAN),  # no measurement: nobody knows
        (NAN, INF, NAN),
        (-INF, 5.0, NAN),
        (6.0, 5.0, NAN),
        (-1.0, 5.0, NAN),
    ],
)
def test_nearest_valid_range(own, kinects, expected):
    result = merge_scans(laser_scan(np.full(512, own)), kinect_scan(np.full(360, kinects)), SEED)
    np.testing.assert_array_equal(result.ranges[1:-1], np.full(510, np.float32(expected)))


def test_an_empty_direction_of_the_old_kinect_is_invalid():
    kinect = kinect_scan(np.full(360, 11.0), range_max=10.0)
    result = merge_scans(laser_scan(np.full(512, 0.0)), kinect, SEED)
    assert not result.valid().any()
    assert result.range_max == 10.0


def test_range_max_of_the_kinect_as_the_old_component_did():
    result = merge_scans(
        laser_scan(np.full(512, 5.0)), kinect_scan(), CombinatorParameters(range_max_source="kinect")
    )
    assert result.range_max == 4.0
    assert result.empty().all(), "nothing is nearer than the Kinect reaches"


def test_the_kinect_counts_only_up_to_max_ang():
    result = merge_scans(laser_scan(), kinect_scan(np.full(360, 1.0)), CombinatorParameters(max_ang=0.5))
    inside = np.abs(result.angles()) <= 0.5
    assert np.all(result.ranges[inside] == 1.0)
    assert np.all(result.ranges[~inside] == 3.0)


def test_a_wider_laser_keeps_its_own_ranges_outside_the_kinects_grid():
    laser = laser_scan(np.full(683, 3.0), angle_min=-120 * DEGREE, angle_increment=240 * DEGREE / 682)
    result = merge_scans(laser, kinect_scan(np.full(360, 1.0)), CombinatorParameters(max_ang=math.pi))
    wide = np.abs(laser.angles()) > 91 * DEGREE
    assert np.all(result.ranges[wide] == 3.0)
    assert np.all(result.ranges[np.abs(laser.angles()) < 89 * DEGREE] == 1.0)


def test_a_reversed_kinect_scan_means_the_same():
    kinect = kinect_seeing(20 * DEGREE, 1.5)
    back = replace(
        kinect,
        angle_min=kinect.angle_max,
        angle_increment=-kinect.angle_increment,
        ranges=kinect.ranges[::-1].copy(),
    )
    for mounting in (None, MOUNTING):
        one = merge_scans(laser_scan(), kinect, SEED, mounting)
        other = merge_scans(laser_scan(), back, SEED, mounting)
        # Directions exactly between two beams may round to either.
        assert np.count_nonzero(one.ranges != other.ranges) <= 1


def test_indices_are_rounded_as_floor_of_x_plus_a_half():
    # Laser beams at 0.5 and 1.5 of the Kinect's beams: half to even would give 0 and 2.
    kinect = kinect_scan([1.0, 2.0, 3.0], angle_min=0.0, angle_increment=0.5)
    laser = laser_scan([9.0, 9.0], angle_min=0.25, angle_increment=0.5)
    result = merge_scans(laser, kinect, CombinatorParameters(upside_down=False))
    assert list(result.ranges) == [2.0, 3.0]


@pytest.mark.parametrize(
    "broken",
    [
        {"ranges": np.empty(0, np.float32)},
        {"angle_increment": 0.0},
        {"angle_increment": NAN},
        {"angle_increment": 1e-300},
        {"angle_min": INF},
    ],
)
@pytest.mark.parametrize("mounting", [None, MOUNTING])
def test_broken_scans_do_no_harm(broken, mounting):
    kinect = replace(kinect_scan(np.full(360, 2.0)), **broken)
    assert np.all(merge_scans(laser_scan(), kinect, SEED, mounting).ranges >= 1.8)
    laser = replace(laser_scan(), **broken)
    assert len(merge_scans(laser, kinect_scan(), SEED, mounting).ranges) == len(laser.ranges)


def test_with_both_in_one_place_the_moved_origin_changes_next_to_nothing():
    kinect = kinect_scan()
    kinect.ranges[120:240] = np.linspace(1.0, 2.0, 120)
    same = merge_scans(laser_scan(), kinect, SEED)
    moved = merge_scans(laser_scan(), kinect, SEED, UPSIDE_DOWN)
    assert np.count_nonzero(~np.isclose(same.ranges, moved.ranges, atol=0.02)) <= 2


def test_a_point_ahead_is_nearer_to_the_laser_than_to_the_kinect():
    mounting = Transform3.from_xyz_rpy((-0.1444, 0.0, -0.41), (math.pi, 0.0, 0.0))
    result = merge_scans(laser_scan(), kinect_seeing(0.0, 1.5), SEED, mounting)
    hits = np.flatnonzero(result.ranges < 2.9)
    assert result.ranges[hits] == pytest.approx(1.3556, abs=1e-4)
    assert np.all(np.abs(result.angles()[hits]) < 0.5 * DEGREE)


@settings(max_examples=examples(50))
@given(st.floats(-28.0, 28.0), st.floats(0.6, 3.5), st.floats(-0.4, 0.4), st.floats(-0.3, 0.3))
def test_a_moved_point_lands_where_geometry_says(azimuth_deg, distance, x, y):
    mounting = Transform3.from_xyz_rpy((x, y, -0.4), (math.pi, 0.0, 0.0))
    kinect = kinect_seeing(azimuth_deg * DEGREE, distance)
    (hit,) = np.flatnonzero(kinect.valid())
    angle = kinect.angles()[hit]
    true_x, true_y, _ = mounting.apply(
        np.array([distance * math.cos(angle), distance * math.sin(angle), 0.0])
    )
    true_distance, true_angle = math.hypot(true_x, true_y), math.atan2(true_y, true_x)
    if true_distance < 0.05 or abs(true_angle) > 1.5:
        return
    result = merge_scans(laser_scan(np.full(512, INF)), kinect, SEED, mounting)
    hits = np.flatnonzero(result.valid())
    assert result.ranges[hits] == pytest.approx(true_distance, rel=1e-5)
    assert np.abs(result.angles()[hits] - true_angle).min() <= result.angle_increment / 2 + 1e-6
    # The arc of one beam, half a degree wide, seen from another distance.
    widest = 0.25 * DEGREE * distance / true_distance * 1.5 + result.angle_increment
    assert np.abs(result.angles()[hits] - true_angle).max() <= widest


def test_a_wall_has_no_gaps_after_moving_the_origin():
    kinect = kinect_scan()
    centre = np.abs(kinect.angles()) < 28 * DEGREE
    kinect.ranges[centre] = 0.8 / np.cos(kinect.angles()[centre])
    result = merge_scans(laser_scan(), kinect, SEED, MOUNTING)
    ahead = np.abs(result.angles()) < 28 * DEGREE
    wall = (0.8 - 0.1444) / np.cos(result.angles()[ahead])
    assert result.ranges[ahead] == pytest.approx(wall, abs=0.01)


def test_the_combined_scan_needs_both_scans_younger_than_a_second():
    combinator = LaserCombinator()
    assert combinator.update_kinect(kinect_scan(stamp=10.0), 10.0) is None
    assert combinator.update_laser(laser_scan(stamp=10.0), 10.0) is None
    assert combinator.update_kinect(kinect_scan(stamp=10.1), 10.1) is not None
    assert combinator.update_kinect(kinect_scan(stamp=10.9), 10.99) is not None
    assert combinator.update_kinect(kinect_scan(stamp=11.0), 11.0) is None
    combinator.update_laser(laser_scan(stamp=11.1), 11.1)
    assert combinator.update_kinect(kinect_scan(stamp=10.0), 11.1) is None
    assert combinator.update_kinect(kinect_scan(stamp=11.15), 11.2) is not None


def test_scans_from_before_the_clock_was_set_back_are_stale():
    combinator = LaserCombinator()
    combinator.update_laser(laser_scan(stamp=500.0), 500.0)
    assert combinator.update_kinect(kinect_scan(stamp=1.0), 1.0) is None


@pytest.mark.parametrize(("source", "stamp"), [("laser", 10.0), ("kinect", 10.2)])
def test_whose_stamp(source, stamp):
    combinator = LaserCombinator(CombinatorParameters(stamp_source=source, frame_id="elsewhere"))
    combinator.update_laser(laser_scan(stamp=10.0), 10.0)
    result = combinator.update_kinect(kinect_scan(stamp=10.2), 10.2)
    assert result is not None
    assert (result.stamp, result.frame_id) == (stamp, "elsewhere")


def test_with_moved_origin_nothing_comes_before_the_mounting_is_known():
    combinator = LaserCombinator(CombinatorParameters(project_origin=True))
    combinator.update_laser(laser_scan(), 10.0)
    kinect = kinect_seeing(0.0, 1.5)
    assert combinator.update_kinect(kinect, 10.0) is None
    combinator.laser_from_kinect = MOUNTING
    result = combinator.update_kinect(kinect, 10.0)
    assert result is not None
    assert result.ranges.min() == pytest.approx(1.3557, abs=1e-3)


def test_partial_laser_alone():
    combinator = LaserCombinator(CombinatorParameters(allow_partial=True))
    alone = combinator.update_laser(laser_scan(), 10.0)
    assert alone is not None
    assert (alone.range_max, alone.ranges[0]) == (5.6, 3.0)
    combinator.update_kinect(kinect_scan(np.full(360, 2.0), stamp=10.1), 10.1)
    assert combinator.update_laser(laser_scan(stamp=10.2), 10.2) is None
    later = combinator.update_laser(laser_scan(stamp=12.0), 12.0)
    assert later is not None
    assert np.all(later.ranges == 3.0)
    assert combinator.update_laser(laser_scan(stamp=12.0), 14.0) is None


def test_partial_kinect_alone_on_the_lasers_grid():
    combinator = LaserCombinator(CombinatorParameters(allow_partial=True))
    assert combinator.update_kinect(kinect_scan(stamp=9.0), 9.0) is None
    combinator.update_laser(laser_scan(np.full(512, 1.0)), 10.0)
    result = combinator.update_kinect(kinect_scan(np.full(360, 2.0), stamp=15.0), 15.0)
    assert result is not None
    assert result.stamp == 15.0
    assert np.all(result.ranges[1:-1] == 2.0)


@pytest.mark.parametrize(
    ("wrong", "hint"),
    [
        ({"range_max_source": "kinekt"}, "kinect"),
        ({"stamp_source": ""}, "kinect, laser"),
        ({"max_ang": 0.0}, "1.57 "),
        ({"freshness": NAN}, "1.0"),
    ],
)
def test_wrong_parameters_are_refused_with_what_would_work(wrong, hint):
    with pytest.raises(ConfigError, match=f"would have worked.*{hint}"):
        CombinatorParameters(**wrong)
