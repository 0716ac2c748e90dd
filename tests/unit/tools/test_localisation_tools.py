"""Generated logs, and what is counted of robots that had to be found."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from florence_bt.app.maps.recordings.carmen import FRAME
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from tests.unit.skills.navigation_world import make_map
from tools.carmen_log import Record, build_map, thinned
from tools.generated_log import HOKUYO, Conditions, Place, corridors, drive
from tools.localisation import FOUND_HEAD, Followed, Search, figures, found_row, row, searched, worst


@pytest.fixture
def two_rooms() -> Place:
    grid = make_map()
    return Place("two rooms", grid, grid, HOKUYO)


def turns(records: list[Record]) -> tuple[float, float]:
    """How far the robot turned in truth, and by its odometry, all turns to one side."""
    pairs = list(pairwise(records))
    true = [(one.reference.inverse() @ two.reference).yaw for one, two in pairs]
    told = [two.motion.yaw * math.copysign(1.0, turn) for (_, two), turn in zip(pairs, true, strict=True)]
    return sum(map(abs, true)), sum(told)


@pytest.mark.slow
def test_a_generated_drive_is_a_drive_through_free_space(two_rooms: Place) -> None:
    records = drive(two_rooms, Conditions(noise=0.0), 300, seed=1)
    assert len(records) == 300
    for one, two in pairwise(records):
        motion = one.reference.inverse() @ two.reference
        assert math.hypot(motion.x, motion.y) <= 0.07
        assert abs(motion.yaw) <= 0.13
        # Without noise the odometry is right.
        assert two.motion.distance_to(motion) < 0.005
        assert two.motion.yaw == pytest.approx(motion.yaw)
    places = {(math.floor(each.reference.x), math.floor(each.reference.y)) for each in records}
    assert len(places) >= 5
    # The map that its scans make has the walls of the first one: x = 4 is between the rooms.
    made = build_map(records)
    _, columns = np.nonzero(made.cells == 100)
    x = made.origin.x + (columns + 0.5) * made.resolution
    assert np.mean(np.abs(x - 4.05) < 0.1) > 0.05


def test_the_same_seed_gives_the_same_drive(two_rooms: Place) -> None:
    conditions = Conditions(people=2, boxes=1)
    one, two = (drive(two_rooms, conditions, 40, seed=3) for _ in range(2))
    assert all(a.reference == b.reference and a.motion == b.motion for a, b in zip(one, two, strict=True))
    assert np.array_equal(one[-1].scan.ranges, two[-1].scan.ranges)


def test_an_odometry_with_a_wrong_scale(two_rooms: Place) -> None:
    true, told = turns(drive(two_rooms, Conditions(noise=0.0, turn_scale=0.8), 200, seed=1))
    assert told == pytest.approx(0.8 * true)


def test_people_are_seen_where_the_map_is_free(two_rooms: Place) -> None:
    alone, among = (drive(two_rooms, Conditions(people=n), 50, seed=2) for n in (0, 6))
    nearest = [min(float(each.scan.ranges.min()) for each in log) for log in (alone, among)]
    assert nearest[1] < nearest[0]


def test_a_robot_that_is_walled_in_says_so() -> None:
    grid = OccupancyGrid(0.05, Pose2(), np.zeros((60, 60), np.int8))
    with pytest.raises(ValueError, match="fewer boxes"):
        drive(Place("small", grid, grid, HOKUYO), Conditions(), 5, seed=1)


def records_along(steps: int) -> list[Record]:
    scan = LaserScan(0.0, FRAME, 0.0, 0.1, 0.0, 5.0, np.ones(3, np.float32))
    return [Record(scan, Pose2(0.5 * n), Pose2(0.5)) for n in range(steps)]


def test_a_thinned_log_has_the_same_way_in_fewer_scans() -> None:
    records = records_along(9)
    few = thinned(records, 1.0)
    assert [each.reference.x for each in few] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert [each.motion.x for each in few[1:]] == [1.0] * 4
    assert thinned(records, 0.1) == records


def test_a_generated_corridor_is_a_ring_between_walls() -> None:
    grid = corridors(5).grid
    assert np.array_equal(grid.cells, corridors(5).grid.cells)
    assert not np.array_equal(grid.cells, corridors(6).grid.cells)
    free = grid.cells == 0
    assert not (np.roll(free, 1, axis=0) & (grid.cells == -1)).any()
    assert 230.0 < free.sum() * grid.resolution**2 < 330.0


NAN = math.nan


@pytest.mark.parametrize(
    ("metres", "found", "wrong", "again"),
    [
        ([0.1] * 8, 0.0, 0.0, 0.0),
        ([3.0, 3.0, 3.0, NAN, NAN, 0.1, 0.1, 0.1], 2.5, 1.0, 0.0),
        ([3.0, 3.0, NAN, 2.0, NAN, 0.1, 0.1, 0.1], 2.5, 0.5, 0.5),
        # Right for half a metre only.
        ([NAN, 0.1, 0.1, NAN, NAN, NAN, NAN, NAN], math.inf, 0.0, 0.0),
        ([NAN] * 8, math.inf, 0.0, 0.0),
    ],
)
def test_when_a_robot_counts_as_found(metres: list[float], found: float, wrong: float, again: float) -> None:
    followed = Followed(np.array(metres), np.zeros(len(metres)))
    search = searched(records_along(len(metres)), followed)
    assert (search.found_m, search.wrong_m, search.wrong_again_m) == pytest.approx((found, wrong, again))


def test_of_several_places_each_figure_is_the_worst() -> None:
    near = figures([Followed(np.array([0.01, 0.02]), np.radians([3.0, 3.0]))])
    lost = figures([Followed(np.array([0.03, NAN]), np.radians([1.0, NAN]))])
    assert row("both", worst([near, lost])) == ("both", "3.0", "3.0", "3.0", "3.0", "3.00", "3.00", "50.0 %")


def test_robots_that_were_found_are_counted_over_all_places() -> None:
    easy = [Search(1.0, 0.0, 0.0), Search(2.0, 0.0, 0.5), Search(3.0, 0.0, 0.0)]
    hard = [Search(4.0, 2.0, 0.0), Search(math.inf, 0.0, 1.5)]
    told = dict(zip(FOUND_HEAD, found_row("homes", [easy, hard]), strict=True))
    assert (told["found within 20 m"], told["worst"], told["wrong again"]) == ("4 of 5", "never", "2")
    assert told["m before it was noticed"] == "1.0"
    assert dict(zip(FOUND_HEAD, found_row("homes", [easy]), strict=True))["median"] == "2.0 m"
