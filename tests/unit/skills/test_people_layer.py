"""Driving near people: round who stands, not into the way of who walks, and on when they have passed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from florence_bt.core.geometry import STANDSTILL, FramedPose, Pose2, Twist2
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.drive_actions import FollowUserGoal, PoseGoal
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters, RecoveryParameters
from florence_bt.skills.navigation.navigate.people import SOMEBODY_IN_THE_WAY, People, PeopleParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from tests.unit.skills.navigation_world import WALLS, Box, Trip, World, make_map

Point = tuple[float, float]
SOMEBODY = 3
OFF = NavigatorParameters(
    costmap=CostmapParameters(proxemic_amplitude=0.0), people=PeopleParameters(people_distance=0.0)
)
CORRIDOR: tuple[Box, ...] = (*WALLS, (0.0, 0.0, 4.0, 1.7), (0.0, 2.9, 4.0, 5.0))
"""The first room is a corridor 1.2 m wide."""


class Encounter:
    """A drive on which the tracker sees somebody at 5 Hz, with an error, and the laser sees their legs.

    Attributes:
        distances: From the middle of the robot to that of the person, at each cycle, metres.
        speeds: Of the robot at the same time, m/s.
        ahead: Whether the person was before it, and not beside it.
    """

    def __init__(
        self,
        robot: Pose2,
        place: Callable[[float], Point],
        boxes: tuple[Box, ...] = WALLS,
        parameters: NavigatorParameters | None = None,
    ) -> None:
        self.trip = Trip(robot, boxes=boxes)
        self.trip.navigator = Navigator(make_map(boxes), parameters)
        self.place = place
        self.boxes = boxes
        self.random = np.random.default_rng(5)
        self.distances: list[float] = []
        self.speeds: list[float] = []
        self.ahead: list[bool] = []

    def go(self, goal: Pose2) -> Result:
        return self.trip.go(goal, each=self._meet)

    def _meet(self, world: World) -> None:
        x, y = self.place(world.now)
        world.boxes = [*self.boxes, (x - 0.12, y - 0.12, x + 0.12, y + 0.12)]
        if round(world.now * 10) % 2 == 0:
            dx, dy = 0.03 * self.random.standard_normal(2)
            seen = (world.odom @ world.pose.inverse()).apply(x + dx, y + dy)
            self.trip.navigator.saw_person(world.now, SOMEBODY, *seen)
        self.distances.append(math.dist((world.pose.x, world.pose.y), (x, y)))
        self.speeds.append(world.twist.linear)
        self.ahead.append(abs(world.pose.bearing_to(x, y)) < math.pi / 3)

    def nearest_driven(self) -> float:
        """The smallest distance at which the robot drove towards the person."""
        cycles = zip(self.distances, self.speeds, self.ahead, strict=True)
        return min(distance for distance, speed, ahead in cycles if ahead and speed > 0.02)


def crossing(seconds: float) -> Point:
    """Somebody who crosses the way at 1 m/s when the robot would be there."""
    return 2.2, 4.7 - max(0.0, min(seconds - 1.0, 4.4))


def oncoming(seconds: float) -> Point:
    """Somebody who walks towards the robot near one wall of the corridor, at 0.8 m/s."""
    return max(0.2, 3.7 - 0.8 * seconds), 1.95


def test_it_lets_somebody_cross_and_goes_on() -> None:
    meeting = Encounter(Pose2(0.6, 2.4), crossing)
    assert meeting.go(Pose2(3.4, 2.4)).succeeded
    meeting.trip.assert_at(Pose2(3.4, 2.4))
    assert min(meeting.distances) > 0.5
    assert meeting.speeds[int(np.argmin(meeting.distances))] < 0.1


def test_switched_off_it_drives_to_where_they_are_about_to_walk() -> None:
    meeting = Encounter(Pose2(0.6, 2.4), crossing, parameters=OFF)
    meeting.go(Pose2(3.4, 2.4))
    assert min(meeting.distances) < 0.4


@pytest.mark.slow
def test_it_waits_for_somebody_who_comes_towards_it_in_a_corridor() -> None:
    meeting = Encounter(Pose2(0.4, 2.3), oncoming, CORRIDOR)
    assert meeting.go(Pose2(3.4, 2.3)).succeeded
    assert f"waiting: {SOMEBODY_IN_THE_WAY}" in meeting.trip.texts
    assert min(meeting.distances) < 0.4
    assert meeting.nearest_driven() > 0.38
    assert meeting.trip.world.hits == 0


@pytest.mark.slow
def test_it_passes_somebody_who_stands_where_there_is_room() -> None:
    meeting = Encounter(Pose2(0.6, 2.4), lambda seconds: (2.0, 2.4))
    assert meeting.go(Pose2(3.4, 2.4)).succeeded
    meeting.trip.assert_at(Pose2(3.4, 2.4))
    assert min(meeting.distances) > 0.4


@pytest.mark.parametrize("seed", [1, 2])
def test_it_still_gets_to_half_a_metre_before_somebody(seed: int) -> None:
    meeting = Encounter(Pose2(0.8, 2.0), lambda seconds: (3.0, 2.4))
    meeting.random = np.random.default_rng(seed)
    assert meeting.go(Pose2(2.5, 2.4)).succeeded
    meeting.trip.assert_at(Pose2(2.5, 2.4))
    assert meeting.trip.texts[-1] == "arrived"


@pytest.mark.slow
def test_somebody_who_stays_in_the_only_door_ends_the_drive() -> None:
    quick = NavigatorParameters(
        recovery=RecoveryParameters(planner_patience=1.0, controller_patience=1.0, rotate_angle=1.0)
    )
    meeting = Encounter(Pose2(1.0, 2.4), lambda seconds: (4.05, 2.4), parameters=quick)
    result = meeting.go(Pose2(6.0, 2.4))
    assert (result.outcome, result.code) == (Outcome.FAILED, "blocked")
    assert 0.4 < meeting.nearest_driven() < 2.9
    assert meeting.trip.world.hits == 0


def test_one_who_is_followed_is_not_minded_but_others_are() -> None:
    trip = Trip(Pose2(1.0, 2.4))
    for others in ((), (SOMEBODY,)):
        trip.navigator.start(FollowUserGoal(7), trip.world.now)
        for _ in range(10):
            to_odom = trip.world.odom @ trip.world.pose.inverse()
            trip.navigator.saw_person(trip.world.now, 7, *to_odom.apply(3.4, 2.4))
            for other in others:
                trip.navigator.saw_person(
                    trip.world.now, other, *to_odom.apply(trip.world.pose.x + 0.45, 2.4)
                )
            assert trip.cycle() is None
        assert (trip.commands[-1] > 0.3) == (not others)


# The parts.


def people(
    *rows: tuple[float, ...], distance: float = 0.4, parameters: PeopleParameters | None = None
) -> People:
    array = np.array([(*row, distance) for row in rows]).reshape(-1, 5)
    return People(array, parameters or PeopleParameters())


def speed(near: People, command: float = 0.45) -> float:
    return near.slowed(Pose2(), Twist2(command, 0.0)).linear


def test_it_is_slower_the_nearer_somebody_is() -> None:
    speeds = [speed(people((away, 0.0, 0.0, 0.0))) for away in (2.0, 1.1, 0.8, 0.55, 0.41)]
    assert speeds[0] == 0.45
    assert sorted(speeds, reverse=True) == speeds
    assert len(set(speeds)) == len(speeds)
    assert speeds[-1] == 0.0


def test_it_is_slower_for_somebody_who_comes_towards_it() -> None:
    assert speed(people((2.0, 0.0, 0.0, 0.0))) == 0.45
    assert 0.0 < speed(people((2.0, 0.0, -0.6, 0.0))) < 0.25
    assert speed(people((1.2, 0.0, -0.8, 0.0))) == 0.0


def test_nobody_behind_it_counts_but_on_the_way_back() -> None:
    behind = people((-0.5, 0.0, 0.0, 0.0))
    assert speed(behind) == 0.45
    assert speed(behind, -0.2) == pytest.approx(-0.04)


def test_it_stops_for_who_will_be_in_its_way_and_not_for_who_will_be_gone() -> None:
    assert 0.0 < speed(people((0.6, 1.2, 0.0, -1.0))) < 0.1
    assert speed(people((0.42, 0.9, 0.0, -1.0))) == 0.0
    assert speed(people((0.42, 0.9, 0.0, 1.0))) > 0.3


def test_a_goal_may_be_nearer_than_the_distance_to_people() -> None:
    somebody = people((0.5, 0.0, 0.0, 0.0))
    assert speed(somebody, 0.1) < 0.05
    assert speed(somebody.around_goal(Pose2(0.1, 0.0)), 0.08) == 0.08
    assert somebody.around_goal(Pose2(9.0, 0.0)).rows[0, 4] == 0.4


def test_turning_in_place_and_zeros_are_left_alone() -> None:
    near = people((0.3, 0.0, 0.0, 0.0))
    assert near.slowed(Pose2(), Twist2(0.0, 0.5)) == Twist2(0.0, 0.5)
    assert near.slowed(Pose2(), STANDSTILL) == STANDSTILL
    assert speed(people((0.3, 0.0, 0.0, 0.0), parameters=PeopleParameters(people_distance=0.0))) == 0.45
    hasty = PeopleParameters(people_time_to_contact=0.0)
    assert speed(people((1.2, 0.0, 0.0, 0.0), parameters=hasty)) == 0.45


def test_who_was_not_seen_for_long_is_forgotten() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    tracks.saw(10.0, SOMEBODY, 1.0, 2.0)
    assert tracks.people(10.9).rows.tolist() == [[1.0, 2.0, 0.0, 0.0, 0.4]]
    assert len(tracks.people(10.9, without=SOMEBODY).rows) == 0
    assert len(tracks.people(11.1).rows) == 0
    # The clock was set back: what is of the future is not believed in, and what comes then is.
    tracks.saw(20.0, SOMEBODY, 1.0, 2.0)
    tracks.forget(5.0)
    assert len(tracks.people(5.0).rows) == 0
    tracks.saw(5.0, SOMEBODY, 1.0, 2.0)
    assert len(tracks.people(5.0).rows) == 1


def test_who_is_left_out_is_so_under_another_id_too() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    tracks.saw(1.0, 8, 1.2, 2.0)
    tracks.saw(1.0, 9, 1.5, 2.0)
    assert tracks.people(1.0, SOMEBODY, (1.0, 2.0)).rows[:, 0].tolist() == [1.5]
    assert len(tracks.people(1.0, SOMEBODY).rows) == 2


def test_sights_become_a_velocity_that_people_have() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    for count in range(12):
        tracks.saw(0.2 * count, 1, 0.2 * count, 0.0)
        tracks.saw(0.2 * count, 2, 0.02 * (-1) ** count, 3.0)
        tracks.saw(0.2 * count, 3, 5.0 * count, 0.0)
    walking, standing, jumping = tracks.people(2.2).rows
    assert walking[2:4] == pytest.approx((1.0, 0.0), abs=0.05)
    assert standing[2:4] == pytest.approx((0.0, 0.0))
    assert math.hypot(jumping[2], jumping[3]) == pytest.approx(2.0)


@pytest.mark.parametrize(
    "bad", [(math.nan, 1.0, 1.0), (1.0, math.nan, 1.0), (1.0, 1.0, math.inf), (math.inf, 0.0, 0.0)]
)
def test_sights_that_are_no_numbers_are_left_out(bad: tuple[float, float, float]) -> None:
    stamp, x, y = bad
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    tracks.saw(stamp, SOMEBODY, x, y)
    assert len(tracks.people(1.0).rows) == 0
    tracks.saw(0.8, SOMEBODY, 0.0, 0.0)
    tracks.saw(stamp, SOMEBODY, x, y)
    assert np.isfinite(tracks.people(1.0).rows).all()
    assert len(tracks.people(1.0).rows) == 1


def grid_with_wall() -> OccupancyGrid:
    cells = np.zeros((80, 120), np.int8)
    cells[:10, :] = 100
    cells[70:, :] = -1
    return OccupancyGrid(0.05, Pose2(-1.0, -2.0), cells)


def test_costs_reach_further_before_somebody_who_walks() -> None:
    costmap = Costmap(CostmapParameters(), grid_with_wall())
    alone = costmap.master.copy()
    costmap.set_people(np.array([(2.0, 0.0, 0.0, 0.0)]))
    standing = costmap.cost_at(2.9, 0.0)
    assert costmap.cost_at(2.0, 0.0) == pytest.approx(77, abs=2)
    assert costmap.cost_at(2.0, 0.9) == pytest.approx(standing, abs=3)
    assert costmap.cost_at(1.1, 0.0) == pytest.approx(standing, abs=3)
    costmap.set_people(np.array([(2.0, 0.0, 1.0, 0.0)]))
    assert costmap.cost_at(2.9, 0.0) > 3 * standing
    assert costmap.cost_at(1.1, 0.0) == pytest.approx(standing, abs=3)
    kept = alone >= INSCRIBED
    assert (costmap.master[kept] == alone[kept]).all()
    assert {LETHAL, UNKNOWN_COST} <= set(alone[kept].tolist())
    assert costmap.master[~kept].max() < INSCRIBED
    costmap.set_people(np.empty((0, 4)))
    assert (costmap.master == alone).all()


def test_people_outside_of_the_map_cost_nothing_and_a_layer_of_zero_is_off() -> None:
    costmap = Costmap(CostmapParameters(), grid_with_wall())
    alone = costmap.master.copy()
    costmap.set_people(np.array([(-50.0, 0.0, 1.0, 0.0), (50.0, 99.0, 0.0, 0.0)]))
    assert (costmap.master == alone).all()
    off = Costmap(CostmapParameters(proxemic_amplitude=0.0), grid_with_wall())
    off.set_people(np.array([(2.0, 0.0, 0.0, 0.0)]))
    assert (off.master == alone).all()


@pytest.mark.parametrize("parameters", [NavigatorParameters(), OFF])
def test_a_path_leads_round_somebody_whom_only_the_camera_sees(parameters: NavigatorParameters) -> None:
    trip = Trip(Pose2(0.6, 1.0), parameters=parameters)
    trip.navigator.start(PoseGoal(FramedPose(Pose2(3.4, 1.0))), 0.0)
    trip.navigator.saw_person(0.0, SOMEBODY, *trip.map_from_odom().inverse().apply(2.0, 1.0))
    assert trip.cycle() is None
    plan = trip.navigator.plan
    assert plan is not None
    away = np.hypot(plan[:, 0] - 2.0, plan[:, 1] - 1.0).min()
    assert (away > 0.4) == (parameters is not OFF)
