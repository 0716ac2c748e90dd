"""Gaps that the planner takes for wide enough and the controller cannot drive."""

from __future__ import annotations

import re

import numpy as np
import pytest

from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.navigate.costmap import TIGHT, Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.drive_actions import PoseGoal
from florence_bt.skills.navigation.navigate.planner import PlannerParameters
from florence_bt.skills.navigation.navigate.tight_ways import TightWays
from tests.unit.skills.navigation_world import WALLS, Box, Trip

NARROW = 0.40
"""Metres: the planner finds a way through, and the robot, 0.32 m wide, cannot keep to it."""
GAP: tuple[Box, ...] = (
    *WALLS[:4],
    (4.0, 0.0, 4.1, 1.2 - NARROW / 2),
    (4.0, 1.2 + NARROW / 2, 4.1, 5.0),
    *WALLS[6:],
)
WITH_DOOR: tuple[Box, ...] = (*GAP[:5], (4.0, 1.2 + NARROW / 2, 4.1, 4.2), *GAP[6:])
START, GOAL = Pose2(1.5, 1.2, 0.0), Pose2(6.0, 1.2, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_where_the_robot_does_not_get_through_it_takes_another_way(seed: int) -> None:
    trip = Trip(START, boxes=WITH_DOOR, on_map=WITH_DOOR, jitter=0.007, seed=seed)
    assert trip.go(GOAL).succeeded
    assert trip.world.hits == 0
    # From the other side it goes round at once: there is no reason to stand before the gap again.
    trip.texts.clear()
    assert trip.go(START).succeeded
    assert not any("waiting" in text for text in trip.texts)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_drive_whose_only_way_is_too_tight_ends_and_the_next_one_does_not_try_it(seed: int) -> None:
    trip = Trip(START, boxes=GAP, on_map=GAP, jitter=0.007, seed=seed)
    result = trip.go(GOAL)
    place = re.search(r"\((\d\.\d+), 1\.2\d\)", result.reason)
    assert result.code == "blocked" and place is not None and 3.7 <= float(place[1]) <= 4.1
    before, stood = trip.world.now, trip.world.pose
    again = trip.go(Pose2(5.5, 3.0, 0.0))
    assert again.code == "blocked"
    assert trip.world.now - before < 4.0
    assert trip.world.pose.distance_to(stood) < 0.1


@pytest.mark.slow
def test_a_gap_that_gets_wider_is_driven() -> None:
    """A box that is not on the map leaves the gap; while the robot stands before it, it is taken away."""
    chair: Box = (4.0, 1.4, 4.1, 1.9)
    wide = (*GAP[:5], (4.0, 1.9, 4.1, 5.0), *GAP[6:])
    trip = Trip(START, boxes=(*wide, chair), on_map=wide, jitter=0.007)
    trip.navigator.start(PoseGoal(FramedPose(GOAL)), 0.0)
    result = None
    while result is None and trip.world.now < 60.0:
        if trip.world.now > 18.0:
            trip.world.boxes = list(wide)
        result = trip.cycle()
    assert result is not None and result.succeeded, result


def corridor(width_cells: int) -> Costmap:
    """A corridor along x, in the middle of a map of 4 x 2 m."""
    cells = np.full((40, 80), 100, np.int8)
    cells[20 - width_cells // 2 : 20 - width_cells // 2 + width_cells] = 0
    return Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))


PATH = np.stack([np.arange(0.5, 3.5, 0.02), np.full(150, 1.0)], axis=1)
ROBOT, END = Pose2(0.5, 1.0), Pose2(3.4, 1.0)
PLANNER = PlannerParameters()


def closed(costmap: Costmap, path: np.ndarray = PATH, now: float = 0.0) -> TightWays:
    ways = TightWays(costmap)
    ways.close(path, ROBOT, costmap, Pose2(), now)
    return ways


def test_a_way_is_closed_for_the_planner_but_not_at_the_robot() -> None:
    costmap = corridor(8)
    closed(costmap)
    assert costmap.cost_at(0.8, 1.0) == 254
    assert costmap.cost_at(ROBOT.x, ROBOT.y) < 253


def test_what_closes_the_only_way_is_told() -> None:
    costmap = corridor(8)
    place = closed(costmap).only_way(ROBOT, END, PLANNER)
    assert place is not None and place.on_map
    assert place.width == pytest.approx(0.40, abs=0.03)
    assert TightWays(costmap).only_way(ROBOT, END, PLANNER) is None


def test_a_way_before_the_goal_is_not_closed() -> None:
    costmap = corridor(8)
    assert not TightWays(costmap).close(PATH[:30], ROBOT, costmap, Pose2(), 0.0)
    assert costmap.cost_at(0.8, 1.0) < 254


def test_a_place_opens_when_what_stood_there_has_gone() -> None:
    costmap = corridor(20)
    x = np.arange(0.5, 3.0, 0.02)
    costmap.mark("scan", np.concatenate([np.stack([x, np.full(len(x), y)], 1) for y in (0.77, 1.22)]), 0.0)
    ways = closed(costmap)
    ways.look()
    assert costmap.marked_at(TIGHT, PATH).any()
    place = ways.only_way(ROBOT, END, PLANNER)
    assert place is not None and not place.on_map
    costmap.reset_outside(0.0, 0.0, 0.1, ["scan"])
    assert costmap.marked_at(TIGHT, PATH).any()
    ways.look()
    assert not costmap.marked_at(TIGHT, PATH).any()


@pytest.mark.parametrize(("of_map", "stays"), [(False, True), (True, False)])
def test_what_the_map_shows_is_believed_longer(of_map: bool, stays: bool) -> None:
    costmap = corridor(8)
    ways = closed(costmap, now=10.0)
    ways.forget(before=10.0, of_map=of_map)
    assert costmap.marked_at(TIGHT, PATH).any()
    ways.forget(before=10.1, of_map=of_map)
    assert costmap.marked_at(TIGHT, PATH).any() is np.bool_(stays)


def test_clearing_the_costmap_opens_everything() -> None:
    costmap = corridor(8)
    ways = closed(costmap)
    costmap.reset_outside(0.0, 0.0, 0.0)
    ways.look()
    assert ways.only_way(ROBOT, END, PLANNER) is None
