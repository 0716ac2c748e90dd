"""The scan of what hangs over, on synthetic pictures."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaser
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters, Overhangs
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, rays_of
from tests.unit.skills.depth_pictures import CAMERA_HEIGHT, MIDDLE, WHOLE_BAND, floor, picture, with_box

OVER = OverhangParameters(overhang_min_height=0.21)
CARRIED = (0.89, 1.15)


def scan_of(depth: np.ndarray) -> LaserScan:
    return Overhangs(WHOLE_BAND, OVER).project(picture(depth))


def somebody(away: float, carries: bool = True) -> np.ndarray:
    """Somebody this many metres away; what they carry reaches 0.4 m nearer."""
    body = with_box(floor(), away, (0.0, 1.4), 0.2, -0.2)
    return with_box(body, away - 0.4, CARRIED, 0.2, -0.2) if carries else body


def test_a_carried_box_is_seen_where_it_is() -> None:
    assert scan_of(somebody(1.8)).ranges[MIDDLE] == pytest.approx(1.4, abs=0.01)


def test_who_carries_nothing_does_not_hang_over_and_neither_does_what_is_higher_than_the_robot() -> None:
    shelf = with_box(floor(), 1.5, (1.05, 1.3), 0.2, -0.2)
    for depth in (somebody(1.8, carries=False), shelf, floor()):
        ranges = scan_of(depth).ranges
        assert (ranges[~np.isnan(ranges)] > WHOLE_BAND.range_max).all()


def test_nothing_is_said_of_what_is_too_near_to_be_seen_for_sure() -> None:
    assert np.isnan(scan_of(somebody(1.5)).ranges[MIDDLE])


def test_a_costmap_keeps_the_box_when_the_camera_sees_the_legs_below_it() -> None:
    camera = Transform3.from_xyz_rpy((0.0, 0.0, CAMERA_HEIGHT), (0.0, 0.0, 0.0))
    costmap = Costmap(CostmapParameters())

    def look(robot: Pose2, carries: bool = True) -> int:
        image = picture(somebody(2.0 - robot.x, carries))
        for source, scan in (
            ("depth", FakeLaser(WHOLE_BAND).project(image)),
            ("overhangs", Overhangs(WHOLE_BAND, OVER).project(image)),
        ):
            scan = LaserFilter().filter(scan)
            costmap.add_rays(source, rays_of(scan, Transform3.from_pose2(robot) @ camera), robot)
        return costmap.cost_at(1.6, 0.0)

    for x in np.arange(0.0, 1.2, 0.02):
        assert look(Pose2(x, 0.0)) >= INSCRIBED, f"at {x:.2f} m"
    assert look(Pose2(), carries=False) < INSCRIBED, "put down"


def test_without_a_height_band_there_is_no_such_scan() -> None:
    assert Overhangs.within(WHOLE_BAND, OverhangParameters()) is None
    assert Overhangs.within(WHOLE_BAND, OVER) is not None
