"""The localisation as a whole on exactly cast scans: 3 cm and 1 degree are wanted at rest."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.core.sensing import LaserScan
from florence_bt.skills.navigation.localisation.localiser import Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, Box, World, make_map

CLUTTER: tuple[Box, ...] = ((2.5, 1.0, 2.8, 1.3), (1.5, 2.8, 1.7, 3.0), (3.0, 3.5, 3.5, 4.0))


def raw(scan: LaserScan) -> LaserScan:
    """The scan as the laser gives it: nothing in range reads as infinity."""
    ranges = np.where(scan.ranges >= scan.range_max - 1e-3, np.inf, scan.ranges)
    return dataclasses.replace(scan, ranges=ranges.astype(np.float32))


def drive(world: World, localiser: Localiser) -> list[tuple[float, float]]:
    """Errors (metres, radians) at every stop of a drive through the left room."""
    errors = []
    for command in (
        Twist2(0.3, 0.4),
        Twist2(0.0, 0.8),
        Twist2(0.3, -0.3),
        Twist2(0.25, 0.5),
        Twist2(0.0, -0.8),
    ):
        for part in (command, STANDSTILL):
            world.command = part
            for _ in range(15):
                world.advance(0.1)
                localiser.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
        assert localiser.map_from_odom is not None
        estimate = localiser.map_from_odom @ world.odom
        errors.append((estimate.distance_to(world.pose), abs(normalize_angle(estimate.yaw - world.pose.yaw))))
    return errors


@pytest.mark.parametrize(
    ("boxes", "limit"),
    [
        (WALLS, 0.02),
        ((*WALLS, *CLUTTER), 0.03),
        # Walls that do not lie on the borders of the cells.
        (tuple((x0 + 0.02, y0 + 0.02, x1 + 0.02, y1 + 0.02) for x0, y0, x1, y1 in WALLS), 0.035),
    ],
)
def test_typical_error_at_rest(boxes: tuple[Box, ...], limit: float) -> None:
    world = World(Pose2(1.0, 1.0, 0.4), boxes=list(boxes), seed=4, odometry_noise=0.05)
    known = [box for box in boxes if box not in CLUTTER]
    localiser = Localiser(make_map(known), seed=4)
    localiser.set_pose(world.pose @ Pose2(0.15, -0.1, 0.1), (0.2, 0.2, 0.15))
    errors = drive(world, localiser)
    assert max(distance for distance, _ in errors) < limit
    assert max(angle for _, angle in errors) < math.radians(1.0)
    assert localiser.covariance.shape == (3, 3)
    assert np.all(np.linalg.eigvalsh(localiser.covariance) > 0.0)


def test_the_plain_filter_works_too() -> None:
    world = World(Pose2(1.0, 1.0, 0.4), seed=4)
    localiser = Localiser(make_map(), LocaliserParameters(refine=False), seed=4)
    localiser.set_pose(world.pose, (0.2, 0.2, 0.1))
    assert max(distance for distance, _ in drive(world, localiser)) < 0.12


@pytest.mark.slow
def test_the_same_seed_gives_the_same_poses() -> None:
    poses = []
    for _ in range(2):
        world = World(Pose2(1.0, 1.0, 0.4), seed=4)
        localiser = Localiser(make_map(), seed=7)
        localiser.set_pose(world.pose)
        drive(world, localiser)
        poses.append(localiser.pose)
    assert poses[0] == poses[1]


def test_a_scan_counts_first_after_motion_and_once_at_rest() -> None:
    """What does not count only corrects the odometry, and leaves the particles alone."""
    world = World(Pose2(1.0, 1.0, 0.4), odometry_noise=0.0)
    localiser = Localiser(make_map())
    localiser.set_pose(world.pose, (0.1, 0.1, 0.05))

    def update(forwards: float = 0.0) -> tuple[bool, bool]:
        """Whether a pose is told, and whether the scan counts."""
        world.pose, world.odom = world.pose @ Pose2(forwards), world.odom @ Pose2(forwards)
        before = localiser.particles.copy()
        told = localiser.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom) is not None
        return told, not np.array_equal(before, localiser.particles)

    assert update() == (True, True)
    assert update() == (False, False)
    assert update(0.05) == (True, False)  # moved too little, and still moving
    assert update() == (True, True)  # has come to rest
    assert update() == (False, False)
    assert update(0.11) == (True, True)


def test_the_place_is_right_also_between_the_scans_that_count() -> None:
    """Wheels that turn without moving the robot."""
    world = World(Pose2(1.0, 1.0, 0.4), odometry_noise=0.0)
    localiser = Localiser(make_map(), seed=4)
    localiser.set_pose(world.pose, (0.05, 0.05, 0.03))
    for _ in range(4):
        world.odom = world.odom @ Pose2(0.06)
        localiser.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
        assert localiser.map_from_odom is not None
        assert (localiser.map_from_odom @ world.odom).distance_to(world.pose) < 0.03


def test_useless_scans_change_nothing() -> None:
    world = World(Pose2(1.0, 1.0, 0.4))
    localiser = Localiser(make_map())
    scan = world.scan()
    for value in (math.nan, math.inf, 0.0, 0.1):
        useless = dataclasses.replace(scan, ranges=np.full(len(scan.ranges), value, np.float32))
        assert localiser.update(useless, UPSIDE_DOWN_LASER, Pose2()) is None
    assert localiser.update(scan, UPSIDE_DOWN_LASER, Pose2(math.nan, 0.0, 0.0)) is None
    assert localiser.map_from_odom is None


def test_a_pose_must_be_finite() -> None:
    localiser = Localiser(make_map())
    with pytest.raises(ValueError, match="cannot be at"):
        localiser.set_pose(Pose2(math.nan, 0.0, 0.0))
    with pytest.raises(ValueError, match="cannot be at"):
        localiser.set_pose(Pose2(), (-0.1, 0.1, 0.1))
