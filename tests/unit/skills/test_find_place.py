"""A robot that has a goal and does not know where it is: it turns, and drives where its sensors see room."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.geometry import STANDSTILL, FramedPose, Pose2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.drive_actions import PoseGoal, WaitGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters, RecoveryParameters
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, WALLS, Box, Trip

START, GOAL = Pose2(1.0, 2.4, 0.0), Pose2(3.2, 3.4, 1.0)


class LostTrip(Trip):
    """Nobody knows where the robot is until it has turned and driven so far since it began."""

    turn_to_find, way_to_find = math.inf, 0.0

    def __init__(self, start: Pose2, *, boxes: tuple[Box, ...] = WALLS, find_s: float = 25.0) -> None:
        params = NavigatorParameters(recovery=RecoveryParameters(find_place_time=find_s))
        self.known, self.turned, self.driven = False, 0.0, 0.0
        super().__init__(start, boxes=boxes, parameters=params)

    def map_from_odom(self) -> Pose2 | None:  # type: ignore[override]
        self.known |= self.turned >= self.turn_to_find and self.driven >= self.way_to_find
        return super().map_from_odom() if self.known else None

    def cycle(self) -> Result | None:
        before = self.world.odom
        result = super().cycle()
        motion = before.inverse() @ self.world.odom
        self.turned += abs(motion.yaw)
        self.driven += math.hypot(motion.x, motion.y)
        return result


@pytest.mark.slow
@pytest.mark.parametrize(("turn", "way"), [(1.5, 0.0), (3.0, 1.8)])
def test_who_finds_its_place_by_turning_and_driving_arrives(turn: float, way: float) -> None:
    trip = LostTrip(START, find_s=60.0)
    trip.turn_to_find, trip.way_to_find = turn, way
    assert trip.go(GOAL).succeeded
    trip.assert_at(GOAL)
    assert any("looking for its place" in text for text in trip.texts)


def test_who_does_not_find_its_place_gives_up_in_time_and_says_so() -> None:
    trip = LostTrip(START)
    result = trip.go(GOAL)
    assert result.code == "no_pose"
    assert "does not know where it is" in result.reason
    assert 25.0 <= trip.world.now < 27.0
    assert trip.turned > math.tau
    assert trip.driven > 1.0
    assert trip.world.hits == 0


@pytest.mark.parametrize(
    "beside",
    [
        # As far from the robot's middle as the turn needs; all around; and a wall right before it.
        ((1.35, 2.0, 1.4, 2.8),),
        ((1.3, 2.0, 1.4, 2.8), (0.5, 2.0, 0.7, 2.8), (0.7, 2.62, 1.3, 2.7), (0.7, 2.1, 1.3, 2.18)),
    ],
)
def test_who_has_no_room_touches_nothing(beside: tuple[Box, ...]) -> None:
    trip = LostTrip(START, boxes=(*WALLS, *beside))
    assert trip.go(GOAL).code == "no_pose"
    assert trip.world.hits == 0


def test_without_a_goal_nothing_moves() -> None:
    trip = LostTrip(START)
    for _ in range(30):
        trip.see()
        step = trip.navigator.step(trip.world.now, trip.world.odometry(), None)
        assert step.command is None
        trip.world.advance(0.1)
    # Nor with one that needs no place.
    trip.navigator.start(WaitGoal(3.0), trip.world.now)
    for _ in range(29):
        trip.see()
        assert trip.navigator.step(trip.world.now, trip.world.odometry(), None).command == STANDSTILL
        trip.world.advance(0.1)


def test_nobody_is_turned_into() -> None:
    trip = LostTrip(START)
    trip.navigator.start(PoseGoal(FramedPose(GOAL)), 0.0)
    for _ in range(100):
        x, y = trip.world.odom.apply(0.35, 0.0)
        trip.navigator.saw_person(trip.world.now, 7, x, y)
        assert trip.cycle() is None
    assert trip.turned == pytest.approx(0.0, abs=1e-6)
    for _ in range(60):
        trip.cycle()
    assert trip.turned > 1.0


def test_a_place_that_is_late_for_a_moment_moves_nothing_more_than_the_drive() -> None:
    trip = LostTrip(START)
    trip.known = True
    trip.navigator.start(PoseGoal(FramedPose(GOAL)), 0.0)
    for _ in range(10):
        trip.cycle()
    for _ in range(8):
        trip.see()
        step = trip.navigator.step(trip.world.now, trip.world.odometry(), None)
        assert step.command == STANDSTILL
        trip.world.advance(0.1)
    assert trip.go(GOAL).succeeded


def test_what_was_marked_at_a_wrong_place_is_forgotten_when_the_right_one_is_found() -> None:
    box = (1.8, 2.2, 2.0, 2.6)
    trip = Trip(START, boxes=(*WALLS, box))
    trip.world.odometry_noise = 0.0
    elsewhere = Pose2(0.0, -1.2) @ trip.world.pose @ trip.world.odom.inverse()
    place = (1.82, 1.2)
    scan = trip.world.scan()
    navigator = trip.navigator
    navigator.add_scan("scan", scan, UPSIDE_DOWN_LASER, trip.world.odom, elsewhere)
    assert navigator.cost_at(*place) > 0
    navigator.add_scan("scan", scan, UPSIDE_DOWN_LASER, trip.world.odom, trip.map_from_odom())
    assert navigator.cost_at(*place) == 0
