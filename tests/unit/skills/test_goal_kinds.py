"""What the navigator does beside drives to one pose: several poses, given paths, straight drives, waiting."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import FramedPose, Pose2, angle_difference
from florence_bt.core.outcome import Outcome, Result
from florence_bt.skills.navigation.navigate.bindings import PRECISE
from florence_bt.skills.navigation.navigate.drive_actions import (
    PathGoal,
    PoseGoal,
    PosesGoal,
    WaitGoal,
)
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.planner import Plan
from tests.unit.skills.navigation_world import WALLS, Trip, ahead, make_map


def end_of(trip: Trip, limit: float, each: Callable[[], None] = lambda: None) -> Result:
    end = trip.world.now + limit
    while trip.world.now < end:
        each()
        result = trip.cycle()
        if result is not None:
            trip.world.advance(0.6)
            return result
    pytest.fail(f"not over after {limit} s: {trip.texts[-1]}")


def test_past_a_pose_without_a_stop() -> None:
    trip = Trip(Pose2(0.8, 1.0, 0.0))
    via, goal = Pose2(2.6, 1.2, 3.0), Pose2(2.6, 3.6, math.pi / 2)
    trip.navigator.start(PosesGoal([FramedPose(each) for each in [via, goal]]), trip.world.now)
    nearest, speeds, left = math.inf, [], []

    def look() -> None:
        nonlocal nearest
        distance = trip.world.pose.distance_to(via)
        nearest = min(nearest, distance)
        feedback = trip.feedback
        left.append((feedback.poses_remaining, feedback.distance_remaining))
        if len(trip.texts) > 1 and distance < 1.0:
            speeds.append(trip.world.twist.linear)

    assert end_of(trip, 60.0, look).succeeded
    trip.assert_at(goal)
    assert nearest < 0.71
    # It may turn towards the next pose, but it neither waits there nor turns to its heading.
    assert sum(speed > 0.1 for speed in speeds) > 0.5 * len(speeds)
    numbers = [number for number, _ in left[2:]]
    assert numbers == sorted(numbers, reverse=True) and set(numbers) == {1, 2}
    assert left[3][1] > 3.5


def test_a_pose_on_the_way_that_cannot_be_reached_is_named() -> None:
    trip = Trip(Pose2(0.8, 1.0, 0.0))
    for goals, code, part in (
        ([], "no_poses", "one or more"),
        ([Pose2(2.0, 1.0), Pose2(4.05, 1.0)], "goal_occupied", "pose 2 of 2"),
        ([Pose2(99.0, 1.0), Pose2(2.0, 1.0)], "goal_outside", "pose 1 of 2"),
        ([Pose2(8.35, 2.0)], "goal_outside", "the map knows nothing"),
    ):
        trip.navigator.start(PosesGoal([FramedPose(each) for each in goals]), trip.world.now)
        result = end_of(trip, 1.0)
        assert (result.code, part in result.reason) == (code, True)
    assert not any(trip.commands)


@pytest.mark.slow
def test_along_a_path_of_somebody_else() -> None:
    trip = Trip(Pose2(1.0, 1.0, 0.0))
    # A detour that no planner would take.
    corners = [(1.0, 1.0), (3.0, 1.0), (3.0, 3.5), (1.5, 3.5)]
    points = [
        Pose2(x0 + (x1 - x0) * k / 20, y0 + (y1 - y0) * k / 20)
        for (x0, y0), (x1, y1) in pairwise(corners)
        for k in range(20)
    ]
    goal = Pose2(1.5, 3.5, math.pi)
    trip.navigator.start(PathGoal([FramedPose(each) for each in [*points, goal]]), trip.world.now)
    farthest = 0.0

    def look() -> None:
        nonlocal farthest
        farthest = max(farthest, trip.world.pose.x)

    assert end_of(trip, 60.0, look).succeeded
    trip.assert_at(goal)
    assert farthest > 2.7
    assert trip.navigator.plan is None


@pytest.mark.slow
def test_a_path_that_is_blocked_ends_without_another_way() -> None:
    trip = Trip(Pose2(1.0, 1.5, 0.0))
    trip.world.boxes.append((2.2, 1.2, 2.4, 1.8))
    trip.navigator.start(
        PathGoal([FramedPose(Pose2(1.0 + 0.1 * k, 1.5)) for k in range(25)]),
        trip.world.now,
    )
    result = end_of(trip, 30.0)
    assert result.code in ("blocked", "no_progress")
    assert trip.world.hits == 0
    for path in ([], [Pose2(math.nan, 0.0)]):
        trip.navigator.start(PathGoal([FramedPose(each) for each in path]), trip.world.now)
        assert end_of(trip, 1.0).code == "bad_input"


@pytest.mark.parametrize(("distance", "yaw"), [(0.8, 0.3), (-0.6, 0.3), (0.0, 0.0)])
def test_straight_on_by_odometry(distance: float, yaw: float) -> None:
    trip = Trip(Pose2(2.2, 2.4, yaw))
    if distance < 0.0:
        trip.come(-distance)
    start = trip.world.pose
    trip.navigator.start(ahead(distance, 0.2, 20.0), trip.world.now)
    assert end_of(trip, 20.0).succeeded
    moved = start.inverse() @ trip.world.pose
    assert abs(moved.x - distance) < 0.03 and abs(moved.y) < 0.03
    assert abs(angle_difference(moved.yaw, 0.0)) < 0.03
    assert max(map(abs, trip.commands)) <= 0.2
    assert trip.feedback.travelled == pytest.approx(abs(distance), abs=0.03)


def test_a_straight_drive_goes_as_far_as_there_is_room() -> None:
    up = math.pi / 2
    for y, came, distance, room in ((3.0, 0.0, 3.0, 0.95), (0.4, 0.6, -3.0, 0.8)):
        trip = Trip(Pose2(1.0, y, up))
        if came:
            trip.come(came)
        start = trip.world.pose
        trip.navigator.start(ahead(distance, 0.3, 30.0), trip.world.now)
        result = end_of(trip, 30.0)
        assert (result.code, trip.world.hits) == ("collision_ahead", 0)
        assert room - 0.15 < trip.world.pose.distance_to(start) < room


def test_a_straight_drive_ends_with_the_time_the_bumper_or_bad_numbers() -> None:
    trip = Trip(Pose2(1.0, 1.0, 0.0))
    trip.navigator.start(ahead(2.0, 0.1, 3.0), trip.world.now)
    assert end_of(trip, 10.0).code == "time_allowance"
    trip.navigator.start(ahead(2.0, 0.1, 0.0), trip.world.now)
    for _ in range(50):
        assert trip.cycle() is None
    trip.navigator.base_stop = BaseStop("bumper", "the left bumper is pressed")
    assert end_of(trip, 1.0).code == "bumper"
    # Away from what the bumper feels it may drive.
    trip.navigator.start(ahead(-0.2, 0.1, 10.0), trip.world.now)
    assert end_of(trip, 10.0).succeeded
    for numbers in ((math.nan, 0.1, 1.0), (1.0, 0.0, 1.0), (1.0, 0.1, math.inf)):
        distance, speed, allowance = numbers
        trip.navigator.start(ahead(distance, speed, allowance), trip.world.now)
        assert end_of(trip, 1.0).code == "bad_input"


def test_waiting_needs_no_sensors_and_can_be_cancelled() -> None:
    navigator = Navigator(make_map())
    navigator.start(WaitGoal(2.0), 10.0)
    step = navigator.step(11.5, None, None)
    assert step.command is not None and step.command.is_zero()
    assert (step.result, step.feedback.time_remaining) == (None, 0.5)
    done = navigator.step(12.0, None, None)
    assert done.result is not None and done.result.succeeded
    navigator.start(WaitGoal(2.0), 20.0)
    navigator.cancel()
    over = navigator.step(20.1, None, None).result
    assert over is not None and over.outcome is Outcome.CANCELLED
    navigator.start(WaitGoal(-1.0), 30.0)
    refused = navigator.step(30.0, None, None).result
    assert refused is not None and refused.code == "bad_input"


def test_a_plan_that_nobody_drives() -> None:
    navigator = Navigator(make_map())
    plan = navigator.plan_between(Pose2(1.0, 1.0), Pose2(6.0, 3.0, 1.0))
    assert isinstance(plan, Plan)
    poses = plan.poses()
    assert len(poses) == len(plan.points) and poses[-1] == Pose2(6.0, 3.0, 1.0)
    assert 5.38 < plan.length < 6.5
    # Each heading leads to the next pose.
    for one, two in pairwise(poses):
        assert abs(one.bearing_to(two.x, two.y)) < 1e-6 or one.distance_to(two) < 1e-9
    for start, goal, code in (
        (Pose2(4.05, 1.0), Pose2(6.0, 3.0), "start_occupied"),
        (Pose2(99.0, 1.0), Pose2(6.0, 3.0), "start_outside"),
        (Pose2(1.0, 1.0), Pose2(99.0, 3.0), "goal_outside"),
        (Pose2(1.0, 1.0), Pose2(4.05, 1.0), "goal_occupied"),
        (Pose2(1.0, 1.0), Pose2(8.35, 2.0), "goal_outside"),
        (Pose2(math.nan, 1.0), Pose2(1.0, 2.0), "bad_input"),
        (Pose2(1.0, 1.0), Pose2(math.inf, 2.0), "bad_input"),
    ):
        failed = navigator.plan_between(start, goal)
        assert isinstance(failed, Result) and failed.code == code
    near = navigator.plan_between(Pose2(1.0, 1.0), Pose2(4.05, 1.0), tolerance=0.5)
    assert isinstance(near, Plan) and 0.1 < near.goal.distance_to(Pose2(4.05, 1.0)) <= 0.5
    assert not navigator.active


def test_parts_of_a_costmap_are_cleared() -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    costmap = trip.navigator.local_costmap
    marked = np.argwhere(costmap.master == 254)
    costmap.reset_inside(0.0, 0.0, 4.0)
    left = np.argwhere(costmap.master == 254)
    assert 0 < len(left) < len(marked)
    places = (left + 0.5) * costmap.resolution + (costmap.origin_y, costmap.origin_x)
    assert np.abs(places).max(axis=1).min() >= 1.99


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    "goal", [Pose2(3.0, 3.4, 0.0), Pose2(2.1, 1.0, 2.0), Pose2(1.2, 3.3, -1.6), Pose2(1.53, 2.44, 0.04)]
)
def test_a_precise_drive_ends_within_a_centimetre_and_half_a_degree(goal: Pose2, seed: int) -> None:
    trip = Trip(Pose2(1.5, 2.4, 0.0), seed=seed)
    trip.navigator.start(PoseGoal(FramedPose(goal), PRECISE), trip.world.now)
    assert end_of(trip, 60.0).succeeded
    assert trip.world.pose.distance_to(goal) <= 0.01
    assert math.degrees(abs(angle_difference(trip.world.pose.yaw, goal.yaw))) <= 0.5


def test_a_precise_drive_that_cannot_get_there_tells_how_far_off_it_is() -> None:
    """A box leaves room for the usual end, before the goal."""
    box = (2.0, 2.1, 2.1, 2.7)
    trip = Trip(Pose2(0.8, 2.4, 0.0), boxes=(*WALLS, box))
    goal = Pose2(1.77, 2.4, 0.0)
    results = []
    for precise in (False, True):
        trip.navigator.start(PoseGoal(FramedPose(goal), PRECISE if precise else ""), trip.world.now)
        results.append(end_of(trip, 60.0))
    assert results[0].succeeded and trip.world.hits == 0
    assert results[1].code in ("blocked", "no_progress") and " cm " in results[1].reason
