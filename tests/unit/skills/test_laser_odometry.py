"""The odometry that is corrected by the scans, without any map."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.sensing import LaserScan
from florence_bt.skills.navigation.localisation.laser_odometry import LaserOdometry
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, Box, World
from tests.unit.skills.test_localise_accuracy import raw

FURNITURE: tuple[Box, ...] = ((0.2, 2.9, 0.9, 3.3), (2.2, 0.2, 2.6, 0.6))
CORRIDOR: tuple[Box, ...] = ((-50.0, 1.0, 50.0, 1.1), (-50.0, -1.1, 50.0, -1.0))


def update(odometry: LaserOdometry, world: World, odom: Pose2) -> None:
    """Let it take the scan of this moment."""
    scan = raw(world.scan())
    odometry.update(points_of(scan), odom, len(scan.ranges))


def points_of(scan: LaserScan) -> NDArray[np.float64]:
    """Beam ends in the base frame, shape (n, 2)."""
    used = np.isfinite(scan.ranges)
    ranges, angles = scan.ranges[used].astype(float), scan.angles()[used]
    ends = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(ranges))], axis=1)
    return np.ascontiguousarray(UPSIDE_DOWN_LASER.apply(ends)[:, :2])


def drive(
    world: World, odometry: LaserOdometry, motion: Pose2, told: Pose2, scans: int
) -> tuple[float, float]:
    """Metres and radians by which the odometry is off after some equal motions."""
    update(odometry, world, world.odom)
    start, began = world.pose, odometry.pose
    for _ in range(scans):
        world.pose, world.odom = world.pose @ motion, world.odom @ told
        update(odometry, world, world.odom)
    error = (start.inverse() @ world.pose).inverse() @ (began.inverse() @ odometry.pose)
    return error.distance_to(Pose2()), abs(normalize_angle(error.yaw))


@pytest.mark.parametrize(
    ("motion", "told"),
    [
        (Pose2(0.06, 0.0, 0.05), Pose2(0.06, 0.0, 0.05)),
        # Wheels that slip; that do not know that the robot drives backwards; that tell too little of a turn.
        (Pose2(), Pose2(0.06)),
        (Pose2(-0.06), Pose2(0.06)),
        (Pose2(0.03, 0.0, 0.1), Pose2(0.03, 0.0, 0.05)),
    ],
)
def test_the_wheels_hardly_matter(motion: Pose2, told: Pose2) -> None:
    world = World(Pose2(2.0, 2.0, 0.3), boxes=[*WALLS, *FURNITURE], seed=2)
    metres, radians = drive(world, LaserOdometry(), motion, told, 20)
    assert metres < 0.05
    assert radians < 0.03


def test_along_a_bare_corridor_the_wheels_are_believed() -> None:
    world = World(Pose2(0.0, 0.2, 0.05), boxes=list(CORRIDOR), seed=2)
    metres, radians = drive(world, LaserOdometry(), Pose2(0.06), Pose2(0.06), 40)
    assert metres < 0.12
    assert radians < 0.02


def test_somebody_who_walks_through_an_empty_hall_does_not_take_the_robot_along() -> None:
    column = (2.0, 3.0, 2.3, 3.3)
    world, odometry = World(Pose2(), boxes=[column], seed=2), LaserOdometry()
    for step in range(40):
        x = -1.0 + 0.05 * step
        world.boxes = [column, (x, 0.7, x + 0.4, 1.0)]
        update(odometry, world, world.odom)
        world.pose, world.odom = world.pose @ Pose2(0.02), world.odom @ Pose2(0.02)
    assert odometry.pose.distance_to(Pose2(0.78)) < 0.02
    assert not odometry.broken


def test_a_robot_that_is_carried_notices_it() -> None:
    world = World(Pose2(1.0, 1.0, 0.4), boxes=[*WALLS, *FURNITURE], seed=2)
    odometry = LaserOdometry()
    drive(world, odometry, Pose2(0.05), Pose2(0.05), 5)
    assert not odometry.broken
    world.pose = Pose2(6.5, 3.5, -2.0)
    update(odometry, world, world.odom @ Pose2(0.05))
    assert odometry.broken
    update(odometry, world, world.odom @ Pose2(0.05))
    assert not odometry.broken
    # And follows from there on.
    world.odom = world.odom @ Pose2(0.05)
    assert drive(world, odometry, Pose2(0.05, 0.0, 0.05), Pose2(0.05, 0.0, 0.05), 10)[0] < 0.04


# Doors are set back in both walls; the rest of the corridor is bare.
DOORS: tuple[Box, ...] = tuple(
    piece
    for x in (-9.0, -2.5, 6.0, 10.0, 17.5, 24.0, 33.0)
    for piece in ((x, 1.0, x + 5.0, 1.1), (x - 3.0, -1.1, x + 3.5, -1.0))
)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scans_a_metre_apart_do_not_overrule_good_wheels_along_a_corridor(seed: int) -> None:
    back: tuple[Box, ...] = ((-50.0, 1.15, 50.0, 1.25), (-50.0, -1.25, 50.0, -1.15))
    world, odometry = World(Pose2(0.0, 0.2), boxes=[*DOORS, *back], seed=seed), LaserOdometry()
    metres, radians = drive(world, odometry, Pose2(1.0), Pose2(1.01), 24)
    assert metres < 0.4
    assert radians < 0.04
    assert not odometry.broken


def test_scans_a_metre_apart_are_followed_as_far_as_the_robot_drives() -> None:
    """Further than a submap reaches: what is seen from its end is no break."""
    niches = [(x, 1.0, x + 0.5, 1.5) for x in (-3.0, 2.0, 5.5, 11.0, 14.0, 20.5, 24.0, 31.0, 36.0)]
    world, odometry = World(Pose2(), boxes=[*CORRIDOR, *niches], seed=2), LaserOdometry()
    for _ in range(30):
        update(odometry, world, world.odom)
        assert not odometry.broken
        world.pose, world.odom = world.pose @ Pose2(1.0), world.odom @ Pose2(1.0)


def test_a_step_is_unsure_along_a_bare_corridor_and_sure_across() -> None:
    world, odometry = World(Pose2(0.0, 0.2, 0.6), boxes=list(CORRIDOR), seed=2), LaserOdometry()
    drive(world, odometry, Pose2(0.3, 0.0, -0.05), Pose2(0.3, 0.0, -0.05), 3)
    heading = np.array([np.cos(world.pose.yaw), -np.sin(world.pose.yaw)])  # the corridor, seen by the robot
    across = np.array([-heading[1], heading[0]])
    covariance = odometry.covariance[:2, :2]
    assert np.sqrt(heading @ covariance @ heading) > 1.5 * np.sqrt(across @ covariance @ across)
    room, there = World(Pose2(2.0, 2.0, 0.3), boxes=[*WALLS, *FURNITURE], seed=2), LaserOdometry()
    drive(room, there, Pose2(0.3), Pose2(0.3), 2)
    least, most = np.sqrt(np.linalg.eigvalsh(there.covariance[:2, :2]))
    assert most < 1.2 * least


def test_an_odometry_that_jumps_does_not_stop_the_robot() -> None:
    """A search as far as the wheels say would last for minutes."""
    world, odometry = World(Pose2(2.0, 2.0, 0.3), boxes=[*WALLS, *FURNITURE], seed=2), LaserOdometry()
    update(odometry, world, world.odom)
    world.pose = Pose2(6.0, 2.5, 1.5)
    began = time.process_time()
    update(odometry, world, Pose2(800.0, 0.0, 2.0))
    assert time.process_time() - began < 5.0
