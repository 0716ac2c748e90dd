"""Where the robot stands in front of a person, and what the approach says about itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.people.approach_user.approach_status import ApproachStatus
from florence_bt.skills.people.approach_user.polite_pose import (
    RESERVE,
    Proposals,
    polite_pose,
    propose_approach,
)
from florence_bt.skills.robot_description.room import DEFAULT_ROOM, RoomParameters
from florence_bt.trees.language.declarations import own_declarations

PROPOSE_APPROACH_POSE = own_declarations()["propose_approach_pose"]

USER, ROBOT = Pose2(3.0, 2.0), Pose2(1.0, 2.0)


@pytest.mark.parametrize(
    ("trial", "x", "y", "yaw_deg"), [(1, 2.5, 2.0, 0.0), (2, 2.646, 1.646, 45.0), (3, 2.646, 2.354, -45.0)]
)
def test_the_vectors_of_the_reference(trial: int, x: float, y: float, yaw_deg: float) -> None:
    pose = polite_pose(USER, ROBOT, trial, 0.5)
    assert (pose.x, pose.y) == pytest.approx((x, y), abs=5e-4)
    assert math.degrees(pose.yaw) == pytest.approx(yaw_deg)


NUMBERS = st.floats(-20, 20)
POSES = st.builds(Pose2, NUMBERS, NUMBERS, st.floats(-7, 7))


@given(POSES, POSES, st.integers(1, 3), st.floats(0.3, 2.0))
def test_every_proposal_is_at_the_distance_and_faces_the_person(
    user: Pose2, robot: Pose2, trial: int, distance: float
) -> None:
    pose = polite_pose(user, robot, trial, distance)
    assert pose.distance_to(user) == pytest.approx(distance)
    assert abs(pose.bearing_to(user.x, user.y)) < 1e-6
    assert -math.pi < pose.yaw <= math.pi
    if robot.distance_to(user) > 1e-3:
        seen_from_user = math.atan2(pose.y - user.y, pose.x - user.x)
        towards_robot = math.atan2(robot.y - user.y, robot.x - user.x)
        offset = (0.0, math.pi / 4, -math.pi / 4)[trial - 1]
        assert angle_difference(seen_from_user, towards_robot) == pytest.approx(offset, abs=1e-6)


@pytest.mark.parametrize("trial", [0, 4, -1])
def test_three_trials_are_at_the_safe_distance(trial: int) -> None:
    with pytest.raises(ValueError, match="1 to 3"):
        polite_pose(USER, ROBOT, trial)


@pytest.mark.parametrize("trial", [0, 7, -1])
def test_there_are_six_trials(trial: int) -> None:
    assert propose_approach(USER, ROBOT, trial).code == "bad_input"


def costmap(marks: dict[tuple[float, float], int]) -> OccupancyGrid:
    """6 m by 4 m of free cells of 5 cm, but for some."""
    grid = OccupancyGrid(0.05, Pose2(), np.zeros((80, 120), np.int8))
    for place, cost in marks.items():
        grid.cells[grid.cell_of(*place)] = cost
    return grid


def test_a_free_place_is_proposed_and_a_taken_one_refused_with_its_pose() -> None:
    grid = costmap({(2.501, 2.001): 99})
    taken = propose_approach(USER, ROBOT, 1, 0.5, grid)
    assert taken.code == "pose_occupied" and "cost 99" in taken.reason
    assert taken.outputs["pose"].x == pytest.approx(2.5)
    assert propose_approach(USER, ROBOT, 2, 0.5, grid).succeeded


@pytest.mark.parametrize(("cost", "free"), [(0, True), (98, True), (-1, True), (99, False), (100, False)])
def test_only_what_touches_is_not_free(cost: int, free: bool) -> None:
    assert propose_approach(USER, ROBOT, 1, 0.5, costmap({(2.501, 2.001): cost})).succeeded is free


def block(grid: OccupancyGrid, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Something that the robot must not touch, with the cells in which its middle cannot be."""
    for cost, margin in ((99, 0.16), (100, 0.0)):
        (low_row, low_column) = grid.cell_of(x[0] - margin, y[0] - margin)
        (row, column) = grid.cell_of(x[1] + margin, y[1] + margin)
        cells = grid.cells[max(low_row, 0) : row, max(low_column, 0) : column]
        np.maximum(cells, cost, out=cells)


def test_somebody_on_a_sofa_is_met_as_near_as_the_robot_gets() -> None:
    grid = costmap({})
    block(grid, (2.6, 3.4), (1.0, 3.0))
    assert propose_approach(USER, ROBOT, 1, 0.5, grid).code == "pose_occupied"
    pose = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert 0.4 + 0.2625 + RESERVE - 0.03 <= pose.distance_to(USER) <= 0.4 + 0.2625 + RESERVE + 0.03
    assert pose.x < 2.6, "on the side of the robot"
    assert abs(pose.bearing_to(USER.x, USER.y)) < 0.05


def test_in_the_open_the_nearest_place_is_at_the_safe_distance() -> None:
    pose = propose_approach(USER, ROBOT, 4, 0.5, costmap({})).outputs["pose"]
    assert pose.distance_to(USER) == pytest.approx(0.5, abs=0.05)


def test_nobody_is_met_through_a_wall() -> None:
    grid = costmap({})
    block(grid, (3.3, 3.4), (-1.0, 5.0))
    block(grid, (2.5, 3.3), (1.0, 3.0))
    pose = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert pose.x < 2.5, "0.66 m away is the other side of the wall"


def test_somebody_in_a_bed_at_a_wall_is_not_met_from_behind_it_through_a_door_nearby() -> None:
    grid = costmap({})
    block(grid, (3.3, 3.4), (-1.0, 3.0))
    block(grid, (2.35, 3.3), (1.0, 3.0))
    pose = propose_approach(USER, Pose2(1.9, 2.0), 4, 0.5, grid).outputs["pose"]
    assert pose.x < 2.35, "0.75 m away is the next room"


@pytest.mark.parametrize("trial", [1, 4])
@pytest.mark.parametrize("away", [0.6, 1.6])
def test_a_robot_that_is_too_near_gets_to_the_largest_safe_distance(away: float, trial: int) -> None:
    pose = propose_approach(USER, Pose2(USER.x - away, USER.y), trial, 2.0, costmap({})).outputs["pose"]
    assert pose.distance_to(USER) == pytest.approx(2.0, abs=0.05)


def test_nobody_is_looked_at_through_a_wall() -> None:
    grid = costmap({})
    block(grid, (3.3, 3.4), (-1.0, 3.0))
    refused = propose_approach(USER, Pose2(3.2, 3.6), 3, 1.2, grid)
    assert refused.code == "pose_occupied" and "does not see" in refused.reason
    pose = propose_approach(USER, Pose2(4.6, 3.6), 4, 1.2, grid).outputs["pose"]
    assert pose.x < 3.3 or pose.y > 3.0, "beside the wall, although it is nearer behind it"


def test_a_place_without_room_to_turn_is_entered_straight_or_not_at_all() -> None:
    grid = costmap({})
    block(grid, (2.0, 3.3), (2.25, 2.3))
    block(grid, (2.0, 3.3), (1.75, 1.8))
    assert propose_approach(USER, Pose2(1.95, 2.0), 1, 0.5, grid).succeeded, "lined up already"
    refused = propose_approach(USER, ROBOT, 1, 0.5, grid)
    assert refused.code == "pose_occupied" and "no room" in refused.reason


@pytest.mark.parametrize(("gap", "behind"), [(0.8, True), (0.42, False), (0.56, True)])
def test_a_place_to_which_only_a_narrow_way_leads_is_taken_when_it_is_much_nearer(gap, behind) -> None:
    grid = costmap({})
    block(grid, (2.4, 3.2), (0.0, 2.8))
    block(grid, (2.0, 4.0), (2.8 + gap, 4.0))
    pose = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert (pose.x > 3.2) is behind, "the other side is 0.3 m nearer"
    block(grid, (1.2, 2.4), (0.0, 2.4))
    block(grid, (1.2, 2.0), (2.8, 4.0))
    pose = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert pose.x > 3.2, "before it there is no room"


def test_the_last_three_trials_are_different_places() -> None:
    proposals, grid = Proposals(), costmap({})
    poses = [
        proposals.propose(USER, ROBOT, trial, 0.5, grid, DEFAULT_ROOM).outputs["pose"] for trial in (4, 5, 6)
    ]
    apart = [one.distance_to(other) for one, other in zip(poses, poses[1:] + poses[:1], strict=True)]
    assert min(apart) >= 0.3


def test_after_a_place_that_was_seen_to_be_occupied_the_best_of_what_is_left_is_next() -> None:
    """Before, the second best of what was left: the next trial skipped the first one of the new map."""
    proposals, grid = Proposals(), costmap({})
    block(grid, (2.3, 3.7), (1.3, 2.7))
    occupied = proposals.propose(USER, ROBOT, 4, 0.5, grid, DEFAULT_ROOM).outputs["pose"]
    block(grid, (occupied.x - 0.2, occupied.x + 0.2), (occupied.y - 0.2, occupied.y + 0.2))
    best = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert best.distance_to(occupied) > 0.3
    following = proposals.propose(USER, ROBOT, 5, 0.5, grid, DEFAULT_ROOM).outputs["pose"]
    assert following.distance_to(best) < 0.1
    last = proposals.propose(USER, ROBOT, 6, 0.5, grid, DEFAULT_ROOM).outputs["pose"]
    assert min(last.distance_to(occupied), last.distance_to(following)) >= 0.3
    again = proposals.propose(USER, ROBOT, 4, 0.5, grid, DEFAULT_ROOM).outputs["pose"]
    assert again == best, "another approach begins anew"


def test_a_robot_that_stands_too_near_to_something_gets_away_from_it() -> None:
    grid = costmap({})
    block(grid, (0.8, 1.2), (2.12, 2.3))
    assert grid.cells[grid.cell_of(ROBOT.x, ROBOT.y)] == 99
    assert propose_approach(USER, ROBOT, 4, 0.5, grid).succeeded


def test_where_no_place_is_left_there_is_no_proposal() -> None:
    grid = costmap({})
    block(grid, (0.5, 5.5), (-1.0, 5.0))
    refused = propose_approach(USER, Pose2(0.2, 2.0), 4, 0.5, grid)
    assert refused.code == "pose_occupied" and "2.5 m" in refused.reason
    assert propose_approach(USER, Pose2(-3.0, 2.0), 4, 0.5, grid).code == "pose_occupied"
    assert propose_approach(USER, ROBOT, 4, 0.5).code == "pose_occupied"


@pytest.mark.parametrize(("y", "reason"), [(0.3, "beyond the map"), (0.45, "no room for the robot")])
def test_a_place_beyond_the_map_or_on_its_edge_is_not_proposed(y: float, reason: str) -> None:
    user, robot = Pose2(3.0, y), Pose2(1.0, y)
    assert propose_approach(user, robot, 3, 0.5, costmap({})).succeeded
    refused = propose_approach(user, robot, 2, 0.5, costmap({}))
    assert refused.code == "pose_occupied" and reason in refused.reason


def test_without_a_costmap_the_proposal_passes() -> None:
    result = propose_approach(USER, ROBOT, 1)
    assert result.succeeded
    assert set(result.outputs) == set(PROPOSE_APPROACH_POSE.outputs)


@pytest.mark.parametrize(
    ("user", "robot", "distance"),
    [
        (Pose2(math.nan, 0.0), ROBOT, 0.5),
        (USER, Pose2(0.0, math.inf), 0.5),
        (USER, ROBOT, 0.2),
        (USER, ROBOT, 2.5),
        (USER, ROBOT, math.nan),
    ],
)
def test_bad_input_is_refused(user: Pose2, robot: Pose2, distance: float) -> None:
    assert propose_approach(user, robot, 1, distance).code == "bad_input"


def test_the_declaration_has_the_defaults_of_the_document() -> None:
    completed = PROPOSE_APPROACH_POSE.complete({"user": USER, "robot": ROBOT})
    assert (completed["trial"], completed["safe_distance"]) == (1, 0.5)
    assert PROPOSE_APPROACH_POSE.problems_with({"user": USER, "robot": ROBOT, "trial": 7})


def words(status: ApproachStatus, number: int) -> list[str | None]:
    return [status.next_word() for _ in range(number)]


def test_the_status_repeats_active_and_ends_with_six_last_words() -> None:
    status = ApproachStatus()
    assert status.next_word() is None
    assert not status.take("", "", "IDLE")
    assert status.take("1", "goto_user", "ACTIVE")
    assert words(status, 20) == ["ACTIVE"] * 20
    assert status.take("1", "goto_user", "ABORTED")
    assert words(status, 7) == ["ABORTED"] * 6 + [None]
    assert not status.take("1", "goto_user", "ABORTED"), "told already"


def test_a_run_whose_start_was_missed_is_told_but_an_old_one_is_not() -> None:
    status = ApproachStatus()
    assert not status.take("0", "detect_user", "SUCCEEDED"), "latched from before"
    assert status.take("1", "detect_user", "PREEMPTED")
    assert words(status, 1) == ["ABORTED"]
    assert status.take("2", "approach_user", "ACTIVE")
    assert words(status, 2) == ["ACTIVE"] * 2


def test_other_missions_say_nothing_here() -> None:
    status = ApproachStatus()
    status.take("", "", "IDLE")
    assert not status.take("1", "goto_room", "ACTIVE")
    assert status.next_word() is None


def test_a_place_that_something_keeps_the_robot_from_is_not_proposed() -> None:
    # Something before somebody: it would stop too early; to the side it is free.
    grid = costmap({})
    block(grid, (2.72, 3.1), (1.85, 2.15))
    refused = propose_approach(USER, ROBOT, 1, 0.5, grid)
    assert refused.code == "pose_occupied" and "no room" in refused.reason
    pose = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    assert pose.distance_to(USER) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize(("nearer", "stays"), [(0.04, True), (0.12, False)])
def test_a_robot_that_stands_well_already_stays(nearer: float, stays: bool) -> None:
    grid = costmap({})
    block(grid, (2.6, 3.4), (1.0, 3.0))
    best = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    robot = Pose2(best.x - nearer, best.y + 0.1, 0.4)
    pose = propose_approach(USER, robot, 4, 0.5, grid).outputs["pose"]
    assert (pose.distance_to(robot) < 1e-9) is stays
    assert abs(pose.bearing_to(USER.x, USER.y)) < 0.05


def test_a_larger_robot_stands_further_from_a_sofa() -> None:
    grid = costmap({})
    block(grid, (2.6, 3.4), (1.0, 3.0))
    large = RoomParameters(footprint=(-0.3, -0.3, -0.3, 0.3, 0.3, 0.3, 0.3, -0.3))
    ours = propose_approach(USER, ROBOT, 4, 0.5, grid).outputs["pose"]
    theirs = propose_approach(USER, ROBOT, 4, 0.5, grid, large).outputs["pose"]
    assert theirs.distance_to(USER) > ours.distance_to(USER) + 0.1
