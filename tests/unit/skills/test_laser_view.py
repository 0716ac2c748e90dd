"""What a laser scan says of a place: nobody stands there when its beams go through."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.laser_view import LaserView, laser_view

MOUNT = Transform3.from_xyz_rpy((0.1, 0.0, 0.3), (0.0, 0.0, 0.0))
ANGLES = np.radians(np.arange(-120.0, 120.0, 0.36))
Circle = tuple[float, float, float]
"""x, y and radius, metres, map frame."""


def legs(x: float, y: float) -> tuple[Circle, Circle]:
    return (x, y - 0.12, 0.06), (x, y + 0.12, 0.06)


def seen(*circles: Circle, robot: Pose2, mount: Transform3 = MOUNT, wall: float = 4.0) -> LaserView:
    """A scan of round things in an empty room with a wall all round."""
    origin = Transform3.from_pose2(robot) @ mount
    rays = np.stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros_like(ANGLES)], axis=1) @ origin.rotation.T
    ranges = np.full(len(ANGLES), wall)
    for x, y, radius in circles:
        dx, dy = x - origin.translation[0], y - origin.translation[1]
        along, beside = rays[:, 0] * dx + rays[:, 1] * dy, rays[:, 0] * dy - rays[:, 1] * dx
        hit = (np.abs(beside) < radius) & (along > 0.0)
        ranges = np.where(hit, np.minimum(ranges, along), ranges)
    scan = LaserScan(0.0, "laser", float(ANGLES[0]), math.radians(0.36), 0.02, 4.1, ranges.astype(np.float32))
    return laser_view(scan, mount, robot)


@pytest.mark.parametrize("away", [0.5, 0.8, 1.5, 3.0])
@pytest.mark.parametrize("robot", [Pose2(), Pose2(2.0, -1.0, 2.5)])
def test_where_legs_stand_it_is_not_free_and_where_they_left_it_is(away: float, robot: Pose2) -> None:
    x, y = robot.apply(away, 0.0)
    assert not seen(*legs(x, y), robot=robot).is_free(x, y)
    assert seen(robot=robot).is_free(x, y)
    assert seen(*legs(*robot.apply(away, 1.2)), robot=robot).is_free(x, y), "they went aside"


def test_a_stride_off_they_are_still_there() -> None:
    assert not seen(*legs(0.9, 0.1), robot=Pose2()).is_free(0.7, 0.0)


def test_through_what_stands_in_between_nothing_is_seen() -> None:
    assert not seen((0.7, 0.0, 0.2), robot=Pose2()).is_free(1.6, 0.0)


def test_before_a_wall_there_is_no_telling() -> None:
    assert not seen(robot=Pose2(), wall=1.0).is_free(1.0, 0.0)


def test_behind_the_robot_nothing_is_seen() -> None:
    assert not seen(robot=Pose2()).is_free(-1.0, 0.0)


def test_beams_without_a_measurement_show_nothing_and_those_without_an_end_go_through() -> None:
    view = seen(robot=Pose2())
    view.scan.ranges[:] = np.nan
    assert not view.is_free(1.0, 0.0)
    view.scan.ranges[:] = np.inf
    assert view.is_free(1.0, 0.0)


def test_a_laser_that_hangs_upside_down_sees_the_same() -> None:
    hanging = Transform3.from_xyz_rpy((0.1, 0.0, 0.3), (math.pi, 0.0, 0.0))
    view = seen(*legs(0.8, 0.6), robot=Pose2(), mount=hanging)
    assert not view.is_free(0.8, 0.6) and view.is_free(0.8, -0.6)
