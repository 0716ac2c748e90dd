"""The scan of obstacles that are too low for the laser, on synthetic pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters, LowObstacles
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, rays_of
from tests.unit.skills.depth_pictures import CAMERA_HEIGHT, MIDDLE, WHOLE_BAND, floor, picture, with_box

LOW = LowObstacleParameters(low_min_height=-0.48)


def low_scan(depth: np.ndarray) -> LaserScan:
    image = picture(depth)
    return LowObstacles(WHOLE_BAND, LOW).project(image, FakeLaser(WHOLE_BAND).project(image))


def hits(scan: LaserScan) -> np.ndarray:
    """Indices of the directions in which something low is."""
    return np.flatnonzero(scan.ranges < scan.range_max)


def test_without_a_height_band_of_its_own_there_is_no_scan_of_what_is_low() -> None:
    assert LowObstacles.between(WHOLE_BAND, LOW) is not None
    edge = WHOLE_BAND.min_height
    assert LowObstacles.between(WHOLE_BAND, LowObstacleParameters(low_min_height=edge)) is None


@pytest.mark.parametrize("tilt", [-0.02, 0.0, 0.02])
def test_the_floor_is_no_thing(tilt: float) -> None:
    assert len(hits(low_scan(floor(tilt)))) == 0


@pytest.mark.parametrize("away", [0.98, 1.15, 1.35, 1.6, 1.85])
def test_a_shoe_is_seen_in_the_ring(away: float) -> None:
    found = low_scan(with_box(floor(), away, (0.0, 0.1), 0.1, -0.1))
    assert found.ranges[MIDDLE] == pytest.approx(away, abs=0.02)
    beams = hits(found)
    width = 2 * np.arctan(0.1 / away) / WHOLE_BAND.angle_increment
    assert len(beams) == pytest.approx(width, abs=2)
    assert np.diff(beams).max() == 1


@pytest.mark.parametrize(("away", "height"), [(0.9, 0.1), (2.0, 0.1), (1.6, 0.04), (1.2, 0.04)])
def test_what_is_elsewhere_or_flat_is_not(away: float, height: float) -> None:
    assert len(hits(low_scan(with_box(floor(), away, (0.0, height), 0.1, -0.1)))) == 0


def test_the_feet_of_something_tall_are_left_out_and_nothing_is_said_of_what_it_hides() -> None:
    leg = with_box(floor(), 1.6, (0.0, 1.2), 0.06, -0.06)
    person = with_box(leg, 1.45, (0.0, 0.1), 0.1, -0.1)
    assert len(hits(low_scan(person))) == 0
    assert np.isnan(low_scan(person).ranges[MIDDLE])
    beside = with_box(leg, 1.45, (0.0, 0.1), 0.6, 0.4)
    assert len(hits(low_scan(beside))) > 10, "a shoe that nobody wears"


def test_only_what_is_taller_is_left_to_the_other_band() -> None:
    assert len(hits(low_scan(with_box(floor(), 1.6, (0.0, 0.3), 0.1, -0.1)))) == 0


def test_a_costmap_keeps_what_was_low_until_the_ring_shows_that_it_is_gone() -> None:
    costmap = Costmap(CostmapParameters())
    sensor = Transform3.from_xyz_rpy((0.0, 0.0, CAMERA_HEIGHT), (0.0, 0.0, 0.0))

    def look(depth: np.ndarray, robot: Pose2) -> int:
        scan = LaserFilter().filter(low_scan(depth))
        costmap.add_rays("low", rays_of(scan, Transform3.from_pose2(robot) @ sensor), robot)
        return costmap.cost_at(1.6, 0.0)

    shoe, nothing, here = with_box(floor(), 1.6, (0.0, 0.1), 0.1, -0.1), floor(), Pose2()
    assert look(nothing, here) == 0
    assert look(shoe, here) >= INSCRIBED
    assert look(nothing, Pose2(0.5, 0.0)) >= INSCRIBED, "the camera looks over it"
    assert look(nothing, Pose2(-0.5, 0.0)) >= INSCRIBED, "too far away"
    assert look(nothing, here) == 0


def test_without_a_height_band_there_is_no_such_scan() -> None:
    assert LowObstacles.between(WHOLE_BAND, LowObstacleParameters()) is None
    assert LowObstacles.between(WHOLE_BAND, LOW) is not None


def test_senseless_parameters_are_refused() -> None:
    with pytest.raises(ConfigError):
        replace(LOW, low_range_max=0.8)
