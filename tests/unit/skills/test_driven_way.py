"""Backing over floor where the robot was, and over no other."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, FramedPose, Pose2, Twist2, integrate_twist
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.contact import BackUp
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.drive_actions import PoseGoal, SpinGoal
from florence_bt.skills.navigation.navigate.driven_way import DrivenWay
from florence_bt.skills.navigation.navigate.parameters import RecoveryParameters
from florence_bt.skills.navigation.navigate.state import CycleState
from tests.sweeps import examples
from tests.unit.skills.navigation_world import WALLS, Box, Trip, World, ahead, outline

GAP: tuple[Box, ...] = (*WALLS[:4], (4.0, 0.0, 4.1, 1.0), (4.0, 1.4, 4.1, 5.0), *WALLS[6:])
"""Of 0.40 m, at y = 1.2: the robot stops before it, and backs up."""
FOOT: Box = (2.80, 1.05, 2.95, 1.35)
"""Of a lamp, behind a robot at (3.2, 1.2) that looks along x: lower than the laser."""
BUMPER = BaseStop("bumper", "the left bumper is pressed")


def way(*poses: Pose2) -> DrivenWay:
    driven = DrivenWay(CostmapParameters().make_true_footprint())
    for pose in poses:
        driven.saw(pose)
    return driven


def straight(length: float) -> list[Pose2]:
    return [Pose2(0.02 * step, 0.0, 0.0) for step in range(round(length / 0.02) + 1)]


def touches_foot(world: World) -> bool:
    x0, y0, x1, y1 = FOOT
    points = (world.pose.apply(*point) for point in outline(0.01))
    return any(x0 < x < x1 and y0 < y < y1 for x, y in points)


def test_backing_up_ends_where_the_robot_was_not() -> None:
    """It came along x, and has turned on the spot: the way that it came lies beside it."""
    turned = way(*straight(1.0), *(Pose2(1.0, 0.0, 0.1 * step) for step in range(17)))
    for driven, heading, backs in ((way(*straight(1.0)), 0.0, True), (turned, 1.6, False)):
        state = CycleState(
            now=0.0,
            pose=Pose2(1.0, 0.0, heading) @ Pose2(-0.1, 0.0),
            twist=STANDSTILL,
            map_from_odom=Pose2(),
            clearance=Clearance(Costmap(CostmapParameters()), Pose2(), None, None),
            stop=BaseStop(),
            driven=driven,
        )
        command = BackUp(state, RecoveryParameters(back_up_distance=0.3), 10.0).step(state)
        assert (command.linear < 0.0) is backs


@pytest.mark.slow
def test_a_recovery_backs_where_the_robot_came_from() -> None:
    trip = Trip(Pose2(2.0, 1.2, 0.0), boxes=GAP, on_map=GAP, jitter=0.007)
    farthest = 0.0
    trip.navigator.start(PoseGoal(FramedPose(Pose2(6.0, 1.2, 0.0))), 0.0)
    while trip.world.pose.x > farthest - 0.07:
        farthest = max(farthest, trip.world.pose.x)
        assert trip.cycle() is None, "it has not backed"


def test_backing_off_from_a_contact_goes_no_further_than_the_robot_came() -> None:
    trip = Trip(Pose2(3.2, 1.2, math.pi / 2), boxes=WALLS[:4], on_map=WALLS[:4])
    trip.navigator.start(SpinGoal(-math.pi / 2, 0.0), trip.world.now)
    while trip.cycle() is None:
        pass
    trip.navigator.base_stop = BUMPER
    trip.navigator.start(PoseGoal(FramedPose(Pose2(6.0, 1.2, 0.0))), trip.world.now)
    trip.cycle()
    while trip.texts[-1].startswith("backing off"):
        trip.navigator.base_stop = BUMPER if trip.world.pose.x > 3.18 else BaseStop()
        trip.cycle()
        assert not touches_foot(trip.world)
    assert 3.1 < trip.world.pose.x < 3.18


@pytest.mark.parametrize("asked", [0.15, 0.4, 2.0])
def test_a_straight_drive_backs_over_floor_where_the_robot_was_and_no_other(asked: float) -> None:
    """It has turned by a quarter: the foot of a lamp stands behind it, which nothing sees."""
    trip = Trip(Pose2(3.2, 1.2, math.pi / 2), boxes=WALLS[:4], on_map=WALLS[:4])
    trip.navigator.start(SpinGoal(-math.pi / 2, 0.0), trip.world.now)
    while trip.cycle() is None:
        pass
    trip.navigator.start(ahead(-asked, 0.1, 0.0), trip.world.now)
    result = None
    while result is None:
        result = trip.cycle()
        assert not touches_foot(trip.world)
    got = 3.2 - trip.world.pose.x
    assert result.code == "collision_ahead"
    assert f"{got:.2f} m far" in result.reason and f"{asked - got:.2f} m were left" in result.reason


@pytest.mark.parametrize("asked", [0.4, 2.0])
def test_a_straight_drive_backs_as_far_as_the_robot_came(asked: float) -> None:
    trip = Trip(Pose2(1.0, 2.4, 0.0))
    trip.come(1.0)
    start = trip.world.pose
    trip.navigator.start(ahead(-asked, 0.2, 0.0), trip.world.now)
    result = None
    while result is None:
        result = trip.cycle()
    # Where it was switched on it had 0.3 m behind it, and some centimetres are as good.
    assert trip.world.pose.distance_to(start) == pytest.approx(min(asked, 1.32), abs=0.04)
    assert result.succeeded if asked < 1.0 else result.code == "collision_ahead"


@settings(max_examples=examples(40))
@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0), st.floats(-3.0, 3.0), st.floats(0.05, 1.5))
def test_the_way_back_ends_on_floor_where_the_robot_was(
    turn: float, on: float, bend: float, most: float
) -> None:
    """Straight on, a turn on the spot, and on along an arc."""
    poses = straight(0.8)
    poses += [poses[-1] @ Pose2(0.0, 0.0, turn * step / 40) for step in range(41)]
    at = poses[-1]
    poses += [integrate_twist(at, Twist2(on, on * bend), 0.02 * step) for step in range(51)]
    driven, robot = way(*poses), poses[-1]
    back = driven.way_back(robot, most)
    assert 0.0 <= back <= most
    assert back == 0.0 or driven.covers(robot, back)
    assert back == most or not driven.covers(robot, min(most, back + 0.02))


@pytest.mark.parametrize(("back", "covered"), [(0.0, True), (0.3, True), (1.2, True), (1.4, False)])
def test_the_way_back_is_as_long_as_the_way_there(back: float, covered: bool) -> None:
    assert way(*straight(1.0)).covers(Pose2(1.0, 0.0, 0.0), back) is covered


def test_a_robot_that_was_switched_on_where_it_stands_has_room_behind_it() -> None:
    assert way(Pose2()).covers(Pose2(), 0.15)
    assert not way(Pose2()).covers(Pose2(), 0.5)


def test_after_a_turn_the_way_lies_beside_the_robot() -> None:
    driven = way(*straight(1.0), *(Pose2(1.0, 0.0, 0.1 * step) for step in range(16)))
    assert not driven.covers(Pose2(1.0, 0.0, math.pi / 2), 0.3)
    assert driven.covers(Pose2(1.0, 0.0, 0.05), 0.3)


def test_backing_gives_no_leave_to_back_on() -> None:
    driven = way(Pose2(), *(Pose2(-0.008 * step, 0.0, 0.0) for step in range(60)))
    assert not driven.covers(Pose2(-0.48, 0.0, 0.0), 0.0)
    assert driven.covers(Pose2(-0.28, 0.0, 0.0), 0.0)


def test_it_backs_along_the_arc_that_it_came() -> None:
    """On a circle of 1 m to the left, from the origin on; straight on, the bend is none."""
    arc = [Pose2(math.sin(turn), 1.0 - math.cos(turn), turn) for turn in (0.02 * step for step in range(40))]
    assert way(*arc).curvature(arc[-1]) == pytest.approx(1.0, abs=0.05)
    assert way(*straight(1.0)).curvature(Pose2(1.0, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-9)
