"""Goals without room to turn are entered straight."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.staging import (
    has_room_to_turn,
    is_lined_up,
    staging_pose,
    straight_way_in,
    turning_place,
)

GOAL = Pose2(3.0, 2.0, 0.0)
FAR = Pose2(1.0, 0.6, 1.0)
SPARE = 0.12


def costmap(*blocks: tuple[float, float, float, float]) -> Costmap:
    """5 m x 4 m of free floor with some blocks: x from, x to, y from, y to."""
    cells = np.zeros((80, 100), np.int8)
    for left, right, low, high in blocks:
        cells[round(low / 0.05) : round(high / 0.05), round(left / 0.05) : round(right / 0.05)] = 100
    return Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))


def test_a_goal_in_the_open_has_room_to_turn():
    assert has_room_to_turn(GOAL, costmap())


def test_what_stands_in_the_middle_of_a_place_leaves_no_room():
    """The outline of the robot passes round it."""
    assert not has_room_to_turn(GOAL, costmap((2.95, 3.0, 1.95, 2.0)))


def test_a_goal_before_a_person_is_entered_straight():
    near_person = (3.22, 3.6, 1.85, 2.15)
    stage = staging_pose(FAR, GOAL, costmap(near_person), SPARE)
    assert stage is not None
    assert stage.yaw == GOAL.yaw and stage.y == pytest.approx(GOAL.y)
    assert 0.2 <= GOAL.x - stage.x <= 0.5


def test_who_is_lined_up_already_drives_on():
    near_person = (3.22, 3.6, 1.85, 2.15)
    here = Pose2(2.6, 2.01, 0.05)
    assert is_lined_up(here, GOAL)
    assert staging_pose(here, GOAL, costmap(near_person), SPARE) is None


@pytest.mark.parametrize(
    "here",
    [
        Pose2(2.6, 2.0, 0.5),
        Pose2(2.6, 2.3, 0.0),
        Pose2(3.1, 2.0, 0.0),
        Pose2(1.0, 2.0, 0.0),
        Pose2(3.0, 2.0, math.pi),
    ],
)
def test_who_is_off_or_past_or_far_or_turned_away_is_not_lined_up(here):
    assert not is_lined_up(here, GOAL)


def test_a_blocked_run_up_is_no_way_in():
    near_person = (3.22, 3.6, 1.85, 2.15)
    behind = (2.4, 2.75, 1.6, 2.4)
    assert staging_pose(FAR, GOAL, costmap(near_person, behind), SPARE) is None


def test_the_last_part_of_the_way_may_be_blocked():
    # The nose would be 5 cm inside the person at the goal: as near as that is near enough.
    too_near = (3.15, 3.6, 1.85, 2.15)
    assert staging_pose(FAR, GOAL, costmap(too_near), SPARE) is not None
    assert staging_pose(FAR, GOAL, costmap(too_near), 0.0) is None


def test_from_the_run_up_the_way_in_is_straight():
    beside = (3.2, 3.3, 2.12, 2.22)
    here = Pose2(2.6, 2.02, 0.05)
    plan = straight_way_in(here, GOAL, costmap(beside), SPARE)
    assert plan is not None
    assert plan.goal is GOAL and plan.length == pytest.approx(here.distance_to(GOAL))
    assert plan.points[0] == pytest.approx((here.x, here.y)) and plan.points[-1] == pytest.approx((3.0, 2.0))
    line = np.interp(plan.points[:, 0], [here.x, GOAL.x], [here.y, GOAL.y])
    assert plan.points[:, 1] == pytest.approx(line)


def test_there_is_no_straight_way_in_elsewhere():
    beside, across = (3.2, 3.3, 2.12, 2.22), (2.85, 2.9, 1.9, 2.1)
    here = Pose2(2.6, 2.02, 0.05)
    assert straight_way_in(FAR, GOAL, costmap(beside), SPARE) is None
    assert straight_way_in(here, GOAL, costmap(beside, across), SPARE) is None


def test_who_is_at_the_goal_or_just_past_it_does_not_go_back_to_line_up():
    near_person = (3.22, 3.6, 1.85, 2.15)
    assert staging_pose(Pose2(3.03, 2.0, 0.1), GOAL, costmap(near_person), SPARE) is None


BESIDE_A_WALL = (1.0, 5.0, 2.25, 2.4)


def test_the_nearest_place_with_room_to_turn_is_on_the_side_where_nothing_is():
    room = costmap(BESIDE_A_WALL)
    assert not has_room_to_turn(GOAL, room)
    assert staging_pose(FAR, GOAL, room, SPARE) is None
    beside = turning_place(GOAL, room, SPARE)
    assert beside is not None and beside.yaw == GOAL.yaw
    assert beside.y < GOAL.y and 0.0 < beside.distance_to(GOAL) <= SPARE + 1e-9
    assert has_room_to_turn(beside, room)
    assert turning_place(GOAL, costmap((1.0, 5.0, 2.2, 2.4), (1.0, 5.0, 1.6, 1.8)), SPARE) is None
