"""A robot that is not where it is believed to be: carried away, misled by its odometry, or never told."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, Twist2, normalize_angle
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.skills.navigation.localisation.localiser import Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.relocaliser import Relocaliser
from florence_bt.skills.navigation.localisation.scan_match import Match
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, Box, World, make_map
from tests.unit.skills.test_localise_accuracy import raw

# What makes the two rooms different from each other, and from themselves the other way round.
FURNITURE: tuple[Box, ...] = ((0.2, 2.9, 0.9, 3.3), (2.2, 0.2, 2.6, 0.6), (5.0, 1.9, 5.5, 2.6))


def furnished(pose: Pose2) -> tuple[World, Localiser]:
    boxes = [*WALLS, *FURNITURE]
    world = World(pose, boxes=boxes, seed=4, odometry_noise=0.02)
    localiser = Localiser(make_map(boxes), seed=4)
    localiser.set_pose(pose, (0.1, 0.1, 0.05))
    return world, localiser


def take(world: World, localiser: Localiser, scan: LaserScan | None = None) -> None:
    localiser.update(raw(scan or world.scan()), UPSIDE_DOWN_LASER, world.odom)


def drive(world: World, localiser: Localiser, command: Twist2, seconds: float) -> bool:
    """Whether the robot was lost on the way."""
    world.command = command
    was_lost = False
    for _ in range(round(10.0 * seconds)):
        world.advance(0.1)
        take(world, localiser)
        was_lost |= localiser.lost
    return was_lost


def error(world: World, localiser: Localiser) -> float:
    assert localiser.map_from_odom is not None
    told = localiser.map_from_odom @ world.odom
    assert abs(normalize_angle(told.yaw - world.pose.yaw)) < 0.1
    return told.distance_to(world.pose)


@pytest.mark.slow
@pytest.mark.parametrize("there", [Pose2(1.4, 3.2, 2.0), Pose2(5.0, 1.2, -2.5)])
def test_who_is_carried_away_says_so_and_is_found(there: Pose2) -> None:
    world, localiser = furnished(Pose2(1.0, 1.0, 0.4))
    drive(world, localiser, Twist2(0.2, 0.3), 2.0)
    world.pose = there
    was_lost = drive(world, localiser, Twist2(0.1, 0.5), 14.0)
    assert error(world, localiser) < 0.1
    assert not localiser.lost
    assert was_lost


@pytest.mark.parametrize("told", [True, False])
def test_a_robot_of_which_nobody_knows_where_it_is_finds_itself(told: bool) -> None:
    world, localiser = furnished(Pose2(5.0, 1.2, -2.5))
    if told:
        localiser.set_pose(Pose2(1.0, 1.0, 0.4))
        localiser.lose()
    else:
        localiser = Localiser(make_map([*WALLS, *FURNITURE]), seed=4)
    assert localiser.lost
    assert localiser.map_from_odom is None
    drive(world, localiser, Twist2(0.1, 0.5), 4.0)
    assert error(world, localiser) < 0.1


def test_an_odometry_that_does_not_know_the_direction_of_a_drive_back() -> None:
    """As on the robot of a log from Freiburg: 0.2 m off with each scan that counts."""
    world, localiser = furnished(Pose2(2.5, 2.0, 0.3))
    take(world, localiser)
    for _ in range(10):
        world.pose = world.pose @ Pose2(-0.1, 0.0, 0.0)
        world.odom = world.odom @ Pose2(0.1, 0.0, 0.0)
        take(world, localiser)
        assert error(world, localiser) < 0.35
    drive(world, localiser, Twist2(0.0, 0.5), 1.0)
    assert error(world, localiser) < 0.05


@pytest.mark.parametrize("half_angle", [0.6, 1.7])
def test_who_stands_before_the_robot_does_not_unconfirm_the_pose(half_angle: float) -> None:
    """Also where most of the beams meet people: none goes through a wall."""
    world, localiser = furnished(Pose2(1.0, 1.0, 0.4))
    for _ in range(20):
        world.command = Twist2(0.0, 0.5)
        world.advance(0.1)
        scan = world.scan()
        crowd = np.abs(scan.angles()) < half_angle
        ranges = np.where(crowd, np.minimum(scan.ranges, 0.6), scan.ranges).astype(np.float32)
        take(world, localiser, dataclasses.replace(scan, ranges=ranges))
        assert not localiser.lost
    assert error(world, localiser) < 0.1


class Search:
    """Stands in for the search in the map: finds what it is told to find, with the robot at ``at``."""

    def __init__(self, *fits: float, contradicted: float = 0.5) -> None:
        self.fits, self.contradicted, self.at = fits, contradicted, Pose2()
        self.asked: list[int] = []

    def contradicted_part(self, points: NDArray[np.float64], pose: Pose2) -> float:
        return self.contradicted

    def around(self, points: NDArray[np.float64], centre: Pose2, reach: float, turn: float) -> Match | None:
        return None

    def everywhere(self, points: NDArray[np.float64]) -> list[Match]:
        self.asked.append(len(points))
        return [match(fit, Pose2(self.at.x + 3.0 * n, self.at.y)) for n, fit in enumerate(self.fits)]


def match(fit: float, pose: Pose2 | None = None) -> Match:
    return Match(pose or Pose2(), np.eye(3), fit)


def relocaliser_with(search: Search) -> Relocaliser:
    return Relocaliser(search, LocaliserParameters())  # type: ignore[arg-type]


POINTS, STEP = np.ones((30, 2)), Pose2(0.1)


def drive_lost(relocaliser: Relocaliser, search: Search, scans: int) -> list[Match | None]:
    """Forwards by 0.3 m a scan; what is found moves along."""
    found = []
    for number in range(scans):
        search.at = Pose2(0.3 * number)
        found.append(relocaliser.look_everywhere(POINTS, Pose2(0.3 * number)))
    return found


def test_two_searches_that_agree_find_who_is_lost() -> None:
    search = Search(0.9, 0.7, contradicted=0.0)
    relocaliser = relocaliser_with(search)
    relocaliser.lose()
    found = drive_lost(relocaliser, search, 7)
    assert search.asked == [150, 210]
    assert found[:-1] == [None] * 6
    assert found[-1] is not None
    assert found[-1].pose == search.at
    assert not relocaliser.lost


@pytest.mark.parametrize(
    ("fits", "contradicted"),
    [
        # Another place fits nearly as well; nothing fits well enough; nothing was found; through walls.
        ((0.9, 0.85), 0.0),
        ((0.6, 0.1), 0.0),
        ((), 0.0),
        ((0.9, 0.7), 0.2),
    ],
)
def test_who_is_not_sure_stays_lost(fits: tuple[float, ...], contradicted: float) -> None:
    search = Search(*fits, contradicted=contradicted)
    relocaliser = relocaliser_with(search)
    relocaliser.lose()
    assert drive_lost(relocaliser, search, 20) == [None] * 20
    assert relocaliser.lost
    assert len(search.asked) == 8


def test_searches_that_find_different_places_find_nothing() -> None:
    search = Search(0.9, contradicted=0.0)
    relocaliser = relocaliser_with(search)
    relocaliser.lose()
    for number in range(20):
        # The place stays, though the robot drives on.
        assert relocaliser.look_everywhere(POINTS, Pose2(0.3 * number)) is None
    assert relocaliser.lost


def test_what_was_seen_before_a_break_is_not_looked_for() -> None:
    search = Search(0.9, contradicted=0.0)
    relocaliser = relocaliser_with(search)
    relocaliser.lose()
    drive_lost(relocaliser, search, 5)
    relocaliser.unconfirm()
    assert drive_lost(relocaliser, search, 5) == [None] * 5
    assert search.asked == [150, 150]


@pytest.mark.parametrize(("fit", "contradicted"), [(0.1, 0.05), (0.5, 0.5)])
def test_what_says_little_of_the_place_makes_nobody_lost(fit: float, contradicted: float) -> None:
    """Hardly a beam goes through a wall, so what does not fit has met people; or half of the scan fits."""
    relocaliser = relocaliser_with(Search(0.9, contradicted=contradicted))
    for _ in range(5):
        relocaliser.look(POINTS, match(0.9), STEP)
    for _ in range(50):
        assert relocaliser.look(POINTS, match(fit), STEP) is None
    assert not relocaliser.lost


@pytest.mark.parametrize(("confirmed", "after"), [(True, 41), (False, 6)])
def test_who_knew_where_it_was_is_lost_later_than_who_was_only_told(confirmed: bool, after: int) -> None:
    """A room that the map does not know contradicts it for some metres."""
    relocaliser = relocaliser_with(Search())
    for _ in range(5 if confirmed else 0):
        relocaliser.look(POINTS, match(0.9), STEP)
    scans = 0
    while not relocaliser.lost:
        relocaliser.look(POINTS, match(0.1), STEP)
        scans += 1
    assert scans == pytest.approx(after, abs=1)


@pytest.mark.parametrize(("elsewhere", "lost"), [((), False), ((0.7,), False), ((0.8,), True)])
def test_who_was_told_a_place_is_lost_only_when_another_fits_better(
    elsewhere: tuple[float, ...], lost: bool
) -> None:
    """Much may have been moved since the map was made, where the robot starts."""
    relocaliser = relocaliser_with(Search(*elsewhere))
    for _ in range(20):
        relocaliser.look(POINTS, match(0.6), STEP)
    assert relocaliser.lost is lost


def test_a_map_without_surfaces_makes_nobody_lost() -> None:
    world, _ = furnished(Pose2(1.0, 1.0, 0.4))
    empty = Localiser(OccupancyGrid(0.05, Pose2(), np.zeros((100, 160), np.int8)))
    empty.set_pose(world.pose)
    drive(world, empty, Twist2(0.2, 0.3), 8.0)
    assert empty.map_from_odom is not None


def test_without_fits_nobody_can_be_found() -> None:
    localiser = Localiser(make_map(), LocaliserParameters(refine=False))
    with pytest.raises(ValueError, match="would have worked: refine"):
        localiser.lose()


def test_scans_that_fit_nowhere_tell_no_place() -> None:
    world, localiser = furnished(Pose2(1.0, 1.0, 0.4))
    take(world, localiser)
    random = np.random.default_rng(1)
    for _ in range(20):
        world.odom = world.odom @ Pose2(0.11, 0.0, 0.0)
        scan = world.scan()
        noise = random.uniform(0.3, 4.0, len(scan.ranges)).astype(np.float32)
        take(world, localiser, dataclasses.replace(scan, ranges=noise))
    assert localiser.lost
    assert localiser.map_from_odom is None
    localiser.set_pose(world.pose)
    localiser.believe(world.odom)
    assert not localiser.lost
    assert math.isclose(error(world, localiser), 0.0, abs_tol=1e-9)
