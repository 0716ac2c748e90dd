"""Where to look next while a map grows, and navigation on such a map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap, GrowingMapParameters
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, Rays
from florence_bt.skills.navigation.navigate.drive_actions import FollowUserGoal, PoseGoal
from florence_bt.skills.navigation.navigate.exploration import (
    Exploration,
    ExplorationParameters,
    frontiers,
)
from florence_bt.skills.navigation.navigate.glass import GlassMemory
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, Trip, World, make_map

GROWS = ExplorationParameters(map_grows=True)
ROBOT = Pose2(2.0, 2.5, 0.0)
DOOR = (4.0, 2.4)


def first_room() -> OccupancyGrid:
    """Return the map of two rooms as it is known from the first one: the other is unknown behind the door."""
    grid = make_map()
    _, column = grid.cell_of(4.1, 0.0)
    cells = grid.cells.copy()
    cells[:, column:] = UNKNOWN
    return replace(grid, cells=cells)


def test_the_next_place_is_before_the_door_and_looks_through_it() -> None:
    (found,) = frontiers(Costmap(CostmapParameters(), first_room()), ROBOT, GROWS)
    assert math.dist((found.x, found.y), DOOR) < 0.3
    assert found.length == pytest.approx(0.8, abs=0.1)
    assert found.view.x < 4.0 and math.dist((found.view.x, found.view.y), DOOR) < 0.8
    assert abs(found.view.yaw) < 0.5
    assert found.way == pytest.approx(found.view.distance_to(ROBOT), rel=0.2)


def test_a_map_that_is_complete_leaves_nothing() -> None:
    assert list(frontiers(Costmap(CostmapParameters(), make_map()), ROBOT, GROWS)) == []


def test_a_small_hole_is_not_looked_at_and_a_large_one_is() -> None:
    for side, count in ((0.3, 0), (1.0, 1)):
        grid = make_map()
        row, column = grid.cell_of(2.5, 1.0)
        cells = grid.cells.copy()
        cells[row : row + round(side / 0.05), column : column + round(side / 0.05)] = UNKNOWN
        found = list(frontiers(Costmap(CostmapParameters(), replace(grid, cells=cells)), ROBOT, GROWS))
        assert (len(found) > 0) == bool(count)


def test_what_only_the_camera_sees_is_in_the_way() -> None:
    costmap = Costmap(CostmapParameters(), first_room())
    across = np.array([(3.9, y) for y in np.arange(2.0, 2.85, 0.02)])
    ranges = np.hypot(*(across - (2.0, 2.5)).T)
    costmap.add_rays("low", Rays(2.0, 2.5, across, ranges, 0.0, 5.0), ROBOT)
    assert all(each.view is None for each in frontiers(costmap, ROBOT, GROWS))
    # It may be gone by the time that the robot is there, which is sent there twice.
    exploration = Exploration(costmap, GROWS)
    assert all(exploration.next_view(ROBOT, number).succeeded for number in (1, 2))
    end = exploration.next_view(ROBOT, 3)
    assert end.code == "out_of_reach" and "0.8 m wide" in end.reason


def test_a_place_is_given_twice_at_most_and_a_new_exploration_begins_anew() -> None:
    exploration = Exploration(Costmap(CostmapParameters(), first_room()), GROWS)
    for number in (1, 2):
        assert exploration.next_view(ROBOT, number).succeeded
    end = exploration.next_view(ROBOT, 3)
    assert end.code == "out_of_reach" and "1 place" in end.reason
    assert exploration.next_view(ROBOT, 1).succeeded


@pytest.mark.parametrize(
    ("depth", "code"), [(0.6, "nothing_left"), (1.1, "nothing_left"), (1.4, "out_of_reach")]
)
def test_a_hole_that_holds_no_room_does_not_leave_the_map_open(depth: float, code: str) -> None:
    """The inside of a cupboard whose door stands open: 0.8 m wide, and walls of furniture round it."""
    grid = make_map()
    cells = grid.cells.copy()
    row, column = grid.cell_of(2.5, 1.0)
    high, wide = round(depth / 0.05), round(0.8 / 0.05)
    cells[row - 1 : row + high + 1, column : column + wide + 2] = OCCUPIED
    cells[row : row + high, column : column + wide] = UNKNOWN
    cells[row : row + high, column - 1] = OCCUPIED
    cells[row - 1, column : column + wide] = FREE  # where it is open
    exploration = Exploration(Costmap(CostmapParameters(), replace(grid, cells=cells)), GROWS)
    number = 1
    while (result := exploration.next_view(ROBOT, number)).succeeded:
        number += 1
    assert result.code == code, result.reason


def test_a_robot_that_was_stuck_has_used_up_no_chances() -> None:
    exploration = Exploration(Costmap(CostmapParameters(), first_room()), GROWS)
    away = Pose2(1.0, 2.5)
    assert exploration.next_view(ROBOT, 1).succeeded
    assert exploration.next_view(ROBOT, 2).succeeded
    assert exploration.next_view(ROBOT, 3).code == "out_of_reach", "as long as it stands there"
    view = exploration.next_view(away, 4).outputs["pose"]
    assert exploration.next_view(view, 5).code == "out_of_reach", (
        "the second drive got it away, the next arrived"
    )


def test_a_place_that_is_not_reached_gives_way_to_the_next_one() -> None:
    grid = first_room()
    _, column = grid.cell_of(0.7, 0.0)
    cells = grid.cells.copy()
    cells[:, :column] = UNKNOWN  # unknown on both sides
    exploration = Exploration(Costmap(CostmapParameters(), replace(grid, cells=cells)), GROWS)
    views = [exploration.next_view(ROBOT, number).outputs["pose"] for number in (1, 2)]
    assert views[0].distance_to(views[1]) > 0.5


def test_what_lies_behind_a_gap_without_room_to_turn_comes_last() -> None:
    grid = first_room()
    cells = grid.cells.copy()
    (low, column), (high, _) = grid.cell_of(2.8, 0.3), grid.cell_of(2.8, 0.75)
    cells[:low, column], cells[high:, column] = OCCUPIED, OCCUPIED
    far_end = cells.copy()
    far_end[:, : grid.cell_of(0.7, 0.0)[1]] = UNKNOWN
    exploration = Exploration(Costmap(CostmapParameters(), replace(grid, cells=far_end)), GROWS)
    beyond: list[bool] = []
    while (result := exploration.next_view(ROBOT, len(beyond) + 1)).succeeded:
        beyond.append(result.outputs["pose"].x > 2.8)
    assert beyond == sorted(beyond), "first all on this side of the gap"
    assert set(beyond) == {False, True}, "then the door"


def test_a_map_that_does_not_grow_is_not_explored() -> None:
    answer = Exploration(Costmap(CostmapParameters(), first_room()), ExplorationParameters()).next_view(
        ROBOT, 1
    )
    assert answer.code == "map_is_fixed" and "--mapping" in answer.reason


def grown(grid: OccupancyGrid, cells: int) -> OccupancyGrid:
    """Return the same map with more unknown cells all around."""
    corner = grid.resolution * cells
    origin = Pose2(grid.origin.x - corner, grid.origin.y - corner)
    return OccupancyGrid(grid.resolution, origin, np.pad(grid.cells, cells, constant_values=UNKNOWN))


@pytest.mark.parametrize("cells", [7, 0, -3])
def test_marks_stay_where_they_are_when_the_map_grows_or_shrinks(cells: int) -> None:
    costmap = Costmap(CostmapParameters(), make_map())
    ends = np.array([[2.5, 2.5]])
    for source in ("low", "scan"):
        costmap.add_rays(source, Rays(2.0, 2.5, ends, np.array([0.5]), 0.0, 5.0), ROBOT)
    newer = make_map()
    if cells < 0:
        part = np.s_[-cells:cells, -cells:cells]
        shift = -cells * newer.resolution
        newer = OccupancyGrid(
            newer.resolution, Pose2(newer.origin.x + shift, newer.origin.y + shift), newer.cells[part]
        )
    else:
        newer = grown(newer, cells)
    costmap.replace_static(newer, forget="scan")
    assert costmap.shape == newer.cells.shape
    assert costmap.cost_at(2.52, 2.52) == 254
    assert costmap.cost_at(4.05, 1.0) == 254, "the wall of the map"
    costmap.reset_inside(2.5, 2.5, 1.0)
    assert costmap.cost_at(2.52, 2.52) == 0


def test_cells_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match=r"0.1 m"):
        Costmap(CostmapParameters(), make_map()).replace_static(make_map(resolution=0.1), forget="scan")


def test_a_drive_goes_on_while_the_map_grows() -> None:
    trip = Trip(ROBOT, parameters=NavigatorParameters(exploration=GROWS))
    trip.navigator.replace_map(first_room())
    assert trip.navigator.cost_at(6.0, 4.0) == UNKNOWN_COST
    maps = [grown(make_map(), 9)]

    def grow(world: World) -> None:
        if world.now > 2.0 and maps:
            trip.navigator.replace_map(maps.pop())

    goal = Pose2(3.3, 1.0, 0.0)
    assert trip.go(goal, each=grow).succeeded
    trip.assert_at(goal)
    assert trip.navigator.cost_at(6.0, 4.0) == 0, "the other room is known by now"


def test_where_the_robot_stood_is_no_wall_whatever_a_newer_map_shows() -> None:
    trip = Trip(ROBOT, parameters=NavigatorParameters(exploration=GROWS))
    trip.navigator.replace_map(first_room())
    assert trip.go(Pose2(3.0, 2.5, 0.0)).succeeded
    grid, here = first_room(), trip.world.pose
    cells = grid.cells.copy()
    cells[:, grid.cell_of(here.x, here.y)[1]] = OCCUPIED  # a pane is drawn right through it
    trip.navigator.replace_map(replace(grid, cells=cells))
    assert not trip.navigator._walls.touches(here)
    assert trip.navigator._walls.free_part(here, -0.4, 0.0) == 1.0
    assert trip.navigator.cost_at(here.x, here.y + 0.5) == LETHAL


def test_a_robot_that_does_not_get_away_forgets_what_it_touched() -> None:
    navigator = Trip(ROBOT, parameters=NavigatorParameters(exploration=GROWS)).navigator
    navigator.replace_map(first_room())
    touched = ROBOT.apply(0.21, 0.0)
    for place, cost in ((ROBOT, LETHAL), (Pose2(2.3, 2.5), LETHAL), (Pose2(2.31, 2.5), 0)):
        navigator.global_costmap.add_contact(ROBOT, 1.0)
        navigator.next_view(place, 2)
        assert navigator.cost_at(*touched) == cost, place


def test_who_is_followed_is_followed_on_the_older_map() -> None:
    trip = Trip(ROBOT, parameters=NavigatorParameters(exploration=GROWS))
    trip.navigator.start(FollowUserGoal(1, 1.0, 0.3, 0.5), trip.world.now)
    trip.navigator.replace_map(grown(make_map(), 9))
    assert trip.navigator.global_costmap.shape == make_map().cells.shape
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.3, 1.0, 0.0))), trip.world.now)
    assert trip.navigator.global_costmap.shape == grown(make_map(), 9).cells.shape


def test_glass_is_remembered_where_the_map_is_free() -> None:
    grid, memory = make_map(), GlassMemory()
    pane = np.array([(2.02, y) for y in np.arange(2.0, 2.2, 0.02)])
    memory.saw(0.0, pane, Pose2(1.0, 2.1))
    assert (memory.added_to(grid).cells == grid.cells).all(), "once is no proof"
    memory.saw(0.1, pane, Pose2(1.01, 2.1))
    assert (memory.added_to(grid).cells == grid.cells).all(), "the robot stood at the same place"
    memory.saw(1.0, pane, Pose2(1.2, 2.1))
    seen = memory.added_to(grid)
    assert seen.cells[seen.cell_of(2.02, 2.1)] == OCCUPIED
    assert grid.cells[grid.cell_of(2.02, 2.1)] == FREE
    memory.saw(400.0, np.empty((0, 2)), Pose2(2.0, 2.0))
    assert (memory.added_to(grid).cells == grid.cells).all(), "it may have been somebody"


def test_beside_a_wall_nothing_is_glass() -> None:
    grid, memory = make_map(), GlassMemory()
    off_by_two_cells = np.array([(3.93, 1.0)])
    for number in range(4):
        memory.saw(float(number), off_by_two_cells, Pose2(2.5 + 0.2 * number, 1.0))
    assert (memory.added_to(grid).cells == grid.cells).all()


class Maker:
    """Makes a map of one free cell for each scan, and keeps every second scan."""

    def __init__(self) -> None:
        self.loops = self.scans = 0
        self.pose = self.map_from_odom = Pose2(1.0, 0.0)

    def update(self, scan: object, laser_in_base: Transform3, odom_pose: Pose2) -> bool:
        """Take a scan."""
        self.scans += 1
        return self.scans % 2 == 1

    def touched(self, odom_pose: Pose2) -> None:
        """Remember where."""
        self.touch = odom_pose

    def grid(self) -> OccupancyGrid:
        """Draw the map."""
        return OccupancyGrid(0.1, Pose2(), np.zeros((1, self.scans), np.int8))


@pytest.mark.parametrize(
    ("left", "right", "turn"), [(True, True, 0.0), (True, False, 45.0), (False, True, -45.0)]
)
def test_what_half_of_the_bumper_met_is_on_that_side(*, left: bool, right: bool, turn: float) -> None:
    maker = Maker()
    growing = GrowingMap(maker, GrowingMapParameters())  # type: ignore[arg-type]
    growing.touched(Pose2(1.0, 2.0, math.pi / 2.0), left=left, right=right)
    assert maker.touch.distance_to(Pose2(1.0, 2.0)) < 1e-9
    assert math.degrees(maker.touch.yaw) == pytest.approx(90.0 + turn)


def test_a_newer_map_comes_only_when_there_is_more_in_it_and_not_too_often() -> None:
    growing = GrowingMap(Maker(), GrowingMapParameters(map_update_period=1.0))  # type: ignore[arg-type]
    assert growing.map_from_odom is None
    scan = World(pose=ROBOT).scan()
    drawn = [
        growing.update(scan, UPSIDE_DOWN_LASER, Pose2(0.1 * number, 0.0), 0.25 * number) is not None
        for number in range(9)
    ]
    assert drawn == [True, False, False, False, True, False, False, False, True]
    assert growing.progress.way == pytest.approx(0.8)
    assert growing.progress.area == pytest.approx(0.09)
    assert growing.map_from_odom == Pose2(1.0, 0.0)
    assert growing.update(scan, UPSIDE_DOWN_LASER, Pose2(math.nan, 0.0), 9.0) is None
