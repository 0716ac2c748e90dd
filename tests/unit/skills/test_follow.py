"""Following somebody who walks through two rooms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.sensing import Odometry
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.controller import Control, Controller
from florence_bt.skills.navigation.navigate.costmap import BODIES, Rays
from florence_bt.skills.navigation.navigate.drive_actions import FollowUserGoal, SearchGoal, SpinGoal
from florence_bt.skills.navigation.navigate.following import give_way
from florence_bt.skills.navigation.navigate.following.motions import Motions
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import FollowParameters, NavigatorParameters
from florence_bt.skills.navigation.navigate.people import PeopleParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from florence_bt.skills.navigation.navigate.person_belief import PersonBelief
from florence_bt.skills.navigation.navigate.person_track import PersonTrack
from florence_bt.skills.navigation.navigate.person_trail import PersonTrail
from florence_bt.skills.navigation.navigate.search import Search
from florence_bt.skills.navigation.navigate.state import CycleResult
from tests.unit.skills.navigation_world import WALLS, Box, Trip, cast, make_map

Point = tuple[float, float]
FIRST_ROOM: Point = (2.2, 2.4)
LEADER = 7


def along(points: list[Point], speed: float) -> Callable[[float], Point]:
    """Where somebody is after some seconds who walks along a line and then stands."""
    legs = [math.dist(a, b) for a, b in itertools.pairwise(points)]

    def place(seconds: float) -> Point:
        left = speed * seconds
        for ((ax, ay), (bx, by)), length in zip(itertools.pairwise(points), legs, strict=True):
            if left <= length:
                return ax + (bx - ax) * left / length, ay + (by - ay) * left / length
            left -= length
        return points[-1]

    return place


class Walk:
    """Follows somebody whom the tracker sees as far as the camera's picture and the walls allow.

    Attributes:
        beside: How far beside the middle of the picture it sees them, rad; with legs in the laser's scans
            further than the picture goes.
    """

    def __init__(self, robot: Pose2, place: Callable[[float], Point], boxes: tuple[Box, ...] = WALLS) -> None:
        self.trip = Trip(robot, boxes=boxes)
        self.place = place
        self.boxes = boxes
        self.distances: list[float] = []
        self.speeds: list[float] = []
        self.blind = False
        self.beside = math.radians(28)

    def sees(self, person: Point) -> bool:
        robot = self.trip.world.pose
        bearing, away = robot.bearing_to(*person), math.dist((robot.x, robot.y), person)
        if self.blind or abs(bearing) > self.beside or away > 4.0:
            return False
        angle = np.array([robot.yaw + bearing])
        return bool(cast(robot.x, robot.y, angle, np.array(self.boxes), 9.0)[0] > away)

    def go(
        self, seconds: float, distance: float = 0.0, speed: float = 0.0, turn: float = 0.0
    ) -> Result | None:
        """Follow; return how that ended, None when it goes on."""
        self.trip.navigator.start(FollowUserGoal(LEADER, distance, speed, turn), self.trip.world.now)
        return self.walk_on(seconds)

    def go_and_search(self, seconds: float) -> Result | None:
        """Follow, and search for who is lost, in turn as missions do; return how a search has failed."""
        navigator, world, start = self.trip.navigator, self.trip.world, self.trip.world.now
        place = self.place
        self.place = lambda since: place(world.now - start)
        follows = True
        while world.now < start + seconds:
            if follows:
                navigator.start(FollowUserGoal(LEADER), world.now)
            else:
                navigator.start(SearchGoal(LEADER), world.now)
            result = self.walk_on(start + seconds - world.now)
            if result is not None and not follows and not result.succeeded:
                return result
            follows = not follows
        return None

    def walk_on(self, seconds: float) -> Result | None:
        trip, world = self.trip, self.trip.world
        start = world.now
        while world.now < start + seconds:
            x, y = self.place(world.now - start)
            world.boxes = [*self.boxes, (x - 0.12, y - 0.12, x + 0.12, y + 0.12)]
            if round((world.now - start) * 10) % 2 == 0 and self.sees((x, y)):
                in_odom = world.odom @ world.pose.inverse() @ Pose2(x, y)
                trip.navigator.saw_person(world.now, LEADER, in_odom.x, in_odom.y)
            result = trip.cycle()
            self.distances.append(math.dist((world.pose.x, world.pose.y), (x, y)))
            self.speeds.append(world.command.linear)
            if result is not None:
                return result
        return None


def test_it_keeps_the_distance_to_somebody_who_walks_straight_on() -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(1.6, 2.4), (3.4, 2.4)], 0.3))
    assert walk.go(12.0) is None
    assert np.abs(np.array(walk.distances[25:]) - 1.0).mean() < 0.1
    assert min(walk.distances) > 0.85
    assert walk.trip.world.hits == 0


def test_it_stands_when_near_enough_and_turns_with_the_person() -> None:
    turns = [(2.0 + 0.8 * math.cos(a), 2.5 + 0.8 * math.sin(a)) for a in np.linspace(0.0, 2.0, 20)]
    walk = Walk(Pose2(2.0, 2.5), along(turns, 0.3))
    assert walk.go(8.0) is None
    assert walk.trip.world.pose.distance_to(Pose2(2.0, 2.5)) < 0.03
    assert abs(walk.trip.world.pose.bearing_to(*turns[-1])) < 0.1


def test_it_gives_way_on_the_way_it_came_to_who_comes_back() -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(1.7, 2.4), (3.2, 2.4), (1.5, 2.4)], 0.2))
    assert walk.go(17.0) is None
    assert min(walk.speeds) < 0.0
    assert min(walk.distances) > 0.55
    assert walk.trip.world.hits == 0


def test_it_backs_off_no_further_than_there_is_room() -> None:
    walk = Walk(Pose2(0.3, 2.4), along([(1.6, 2.4), (0.9, 2.4)], 0.3))
    assert walk.go(4.5) is None
    assert walk.trip.world.pose.x > 0.2
    assert walk.trip.world.twist.linear == 0.0
    assert walk.trip.world.hits == 0


def test_without_room_behind_it_it_goes_where_the_person_can_pass() -> None:
    walk = Walk(Pose2(0.3, 2.4), along([(1.6, 2.4), (0.9, 2.4)], 0.3))
    assert walk.go(12.0) is None
    assert "stepping aside" in walk.trip.texts
    assert walk.distances[-1] > 1.0
    assert min(walk.distances) > 0.5
    assert walk.trip.world.hits == 0


def test_it_turns_after_who_walks_past_and_follows_them() -> None:
    walk = Walk(Pose2(1.0, 2.4), along([(2.0, 2.4), (1.6, 3.0), (0.9, 3.05), (0.4, 3.4), (0.4, 4.4)], 0.35))
    assert walk.go(12.0) is None
    assert "stepping aside" not in walk.trip.texts
    assert abs(walk.trip.world.pose.bearing_to(0.4, 4.4)) < 0.3
    assert walk.distances[-1] == pytest.approx(1.0, abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("source", [BODIES, "overhangs"])
def test_without_a_way_it_forgets_where_people_stood_and_nothing_else_that_the_camera_saw(source) -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(2.6, 2.4), (3.4, 2.4)], 0.2))
    costmaps = walk.trip.navigator.global_costmap, walk.trip.navigator.local_costmap
    odom = walk.trip.world.odom @ walk.trip.world.pose.inverse()
    across = np.array([(1.6, y) for y in np.arange(0.0, 5.0, 0.04)])
    for costmap, points in zip(
        costmaps, (across, np.array([odom.apply(*each) for each in across])), strict=True
    ):
        robot = Pose2(0.6, 2.4) if costmap is costmaps[0] else walk.trip.world.odom
        ranges = np.hypot(*(points - [robot.x, robot.y]).T)
        costmap.add_rays(source, Rays(robot.x, robot.y, points, ranges, 1.2, 4.0), robot)
    walk.go(20.0)
    if source == BODIES:
        assert "following, round what is in the way" in walk.trip.texts
        assert walk.distances[-1] == pytest.approx(1.0, abs=0.2)
    else:
        assert walk.trip.world.pose.x < 1.6, "a row of tables would stand there"


def test_without_a_speed_to_back_off_with_it_stands_before_who_comes_nearer() -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(1.7, 2.4), (2.6, 2.4), (2.25, 2.4)], 0.3))
    parameters = NavigatorParameters(follow=FollowParameters(follow_back_speed=0.0))
    walk.trip.navigator = Navigator(make_map(), parameters)
    assert walk.go(10.0) is None
    assert min(walk.speeds) == 0.0
    assert walk.trip.world.hits == 0


@pytest.mark.slow
def test_it_follows_through_a_door_and_round_the_corner() -> None:
    route = [FIRST_ROOM, (4.05, 2.4), (5.0, 2.6), (5.4, 4.2), (7.2, 4.2)]
    walk = Walk(Pose2(1.2, 2.4), along(route, 0.35))
    assert walk.go(30.0) is None
    assert walk.trip.world.hits == 0
    assert min(walk.distances) > 0.5
    assert walk.distances[-1] == pytest.approx(1.0, abs=0.3)


@pytest.mark.slow
def test_it_follows_along_their_path_where_the_straight_way_would_cut_a_corner() -> None:
    route = [FIRST_ROOM, (4.05, 2.4), (4.5, 2.4), (4.5, 4.4)]
    walk = Walk(Pose2(1.2, 2.4), along(route, 0.35))
    walk.beside = 2.0
    assert walk.go(18.0) is None
    assert "following along the person's path" in walk.trip.texts
    assert max(walk.distances[20:]) < 1.4
    assert min(walk.distances) > 0.6
    assert walk.trip.world.hits == 0


def test_what_the_map_knows_and_somebody_walks_through_is_not_there_any_more() -> None:
    cupboard = (1.2, 4.2, 2.0, 5.0)
    boxes = tuple(box for box in WALLS if box != cupboard)
    assert len(boxes) == len(WALLS) - 1
    walk = Walk(Pose2(0.5, 4.5), along([(1.5, 4.5), (3.5, 4.5)], 0.3), boxes)
    assert walk.go(12.0) is None
    assert "following along the person's path" in walk.trip.texts
    assert walk.distances[-1] == pytest.approx(1.0, abs=0.2)
    assert walk.trip.world.hits == 0


def test_it_gives_way_on_the_way_it_came_where_the_map_has_something() -> None:
    boxes = tuple(box for box in WALLS if box != (1.2, 4.2, 2.0, 5.0))
    walk = Walk(Pose2(0.5, 4.5), along([(1.5, 4.5), (2.9, 4.5), (2.2, 4.5)], 0.25), boxes)
    assert walk.go(10.0) is None
    assert 1.2 < walk.trip.world.pose.x < 2.0, "where the map has a cupboard"
    assert min(walk.speeds) < 0.0
    assert min(walk.distances) > 0.45
    assert walk.trip.world.hits == 0


def test_it_keeps_up_with_who_walks_as_fast_as_it_may_drive() -> None:
    walk = Walk(Pose2(0.3, 2.4), along([(1.3, 2.4), (3.7, 2.4)], 0.48))
    assert walk.go(5.0) is None
    assert max(walk.speeds) == pytest.approx(0.5)
    assert walk.distances[-1] < 1.35


@pytest.mark.slow
def test_when_it_comes_no_nearer_to_where_they_vanished_it_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Controller, "control", lambda *arguments: Control(Twist2(0.0, 0.3), 2.0))
    monkeypatch.setattr(PersonTrail, "ahead", lambda *arguments: [])
    walk = Walk(Pose2(1.2, 2.4), along([FIRST_ROOM, (4.05, 2.4), (4.6, 2.4), (4.6, 0.4)], 0.45))
    see = walk.sees
    walk.sees = lambda person: walk.trip.world.now < 4.0 and see(person)  # type: ignore[method-assign]
    assert walk.go_and_search(18.0) is None
    texts = walk.trip.texts
    assert texts.count("going to where the person was seen last") < 80
    assert "looking for the person" in texts


@pytest.mark.slow
def test_a_search_drives_on_after_some_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PersonBelief, "best_view", lambda self, robot: (robot.yaw + 2.0, 1.0))
    monkeypatch.setattr(PersonBelief, "best_place", lambda self, robot: (3.3, 1.0))
    walk = Walk(Pose2(1.0, 2.4), lambda seconds: (2.1, 2.4))
    walk.sees = lambda person: walk.trip.world.now < 1.0  # type: ignore[method-assign]
    walk.place = lambda seconds: (2.1, 2.4) if seconds < 1.0 else (7.0, 4.0)
    assert walk.go_and_search(30.0) is None
    assert math.dist((walk.trip.world.pose.x, walk.trip.world.pose.y), (1.0, 2.4)) > 1.0


@pytest.mark.slow
def test_who_came_and_waits_before_the_robot_is_let_past() -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(1.7, 2.4), (3.2, 2.4), (2.75, 2.4)], 0.3))
    assert walk.go_and_search(22.0) is None
    texts = walk.trip.texts
    begins = texts.index("stepping aside")
    assert texts[begins - 50 : begins] == 50 * ["following"]
    assert "giving way" in texts[:begins]
    assert min(walk.distances) > 0.5
    assert walk.trip.world.hits == 0


@pytest.mark.slow
def test_who_came_and_walks_on_slowly_round_the_robot_is_not_stepped_aside_for() -> None:
    come = along([(1.7, 2.4), (3.2, 2.4), (2.75, 2.4)], 0.3)
    arc = [(1.87 + 0.88 * math.cos(angle), 2.4 + 0.88 * math.sin(angle)) for angle in np.linspace(0, 1.3, 14)]
    go_round = along(arc, 0.08)
    walk = Walk(Pose2(0.6, 2.4), lambda seconds: come(seconds) if seconds < 7.0 else go_round(seconds - 7.0))
    assert walk.go(18.0) is None
    assert "giving way" in walk.trip.texts
    assert max(walk.distances[-80:]) < 1.0
    assert "stepping aside" not in walk.trip.texts


def test_who_only_passes_and_then_stands_before_it_is_not_stepped_aside_for_at_once() -> None:
    walk = Walk(Pose2(0.3, 2.4), along([(0.9, 1.4), (0.9, 2.4)], 0.3))
    assert walk.go(8.0) is None
    assert "giving way" in walk.trip.texts
    assert "stepping aside" not in walk.trip.texts


@pytest.mark.slow
def test_a_search_drives_on_when_something_is_in_the_way_of_a_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Motions, "is_free_turn", lambda self, clearance, speed, *turn: speed != 0.0)
    monkeypatch.setattr(PersonBelief, "best_view", lambda self, robot: (3.0, 1.0))
    monkeypatch.setattr(PersonBelief, "best_place", lambda self, robot: (3.3, 1.0))
    walk = Walk(Pose2(1.0, 2.4), lambda seconds: (2.1, 2.4) if seconds < 1.0 else (7.0, 4.0))
    walk.sees = lambda person: walk.trip.world.now < 1.0  # type: ignore[method-assign]
    assert walk.go_and_search(30.0) is None
    assert math.dist((walk.trip.world.pose.x, walk.trip.world.pose.y), (1.0, 2.4)) > 1.0


def with_somebody_else(walk: Walk, place: Point) -> None:
    """The camera sees somebody else, too, who stands at a place."""
    see = walk.sees

    def sees(person: Point) -> bool:
        in_odom = walk.trip.world.odom @ walk.trip.world.pose.inverse() @ Pose2(*place)
        walk.trip.navigator.saw_person(walk.trip.world.now, LEADER + 1, in_odom.x, in_odom.y)
        return see(person)

    walk.sees = sees  # type: ignore[method-assign]


@pytest.mark.parametrize("somebody_behind", [False, True])
def test_it_does_not_back_off_to_where_somebody_else_was(somebody_behind: bool) -> None:
    walk = Walk(Pose2(2.0, 2.4), along([(3.0, 2.4), (2.65, 2.4)], 0.3))
    if somebody_behind:
        with_somebody_else(walk, (1.4, 2.4))
    assert walk.go(4.0) is None
    assert (min(walk.speeds) < 0.0) is not somebody_behind


def test_it_makes_room_for_somebody_else_who_stands_in_the_way() -> None:
    walk = Walk(Pose2(1.0, 2.4), along([(2.0, 2.4), (3.4, 2.4)], 0.3))
    with_somebody_else(walk, (1.5, 2.55))
    assert walk.go(6.0) is None
    assert "backing out" in walk.trip.texts
    assert min(walk.speeds) < 0.0


def test_where_they_vanished_the_marks_of_their_body_are_cleared() -> None:
    on = along([(1.6, 2.4), (2.2, 2.4)], 0.3)
    walk = Walk(Pose2(0.6, 2.4), lambda seconds: on(seconds) if seconds < 2.0 else (7.0, 2.4))
    costmap, world, see, costs = walk.trip.navigator.local_costmap, walk.trip.world, walk.sees, []

    def mark_the_last_place(person: Point) -> bool:
        place = np.array([(world.odom @ world.pose.inverse()).apply(2.1, 2.4)])
        if world.now >= 2.0:
            if not costs:
                rays = Rays(world.odom.x, world.odom.y, place, np.array([1.0]), 0.1, 4.0)
                costmap.add_rays("overhangs", rays, world.odom)
            costs.append(costmap.cost_at(*place[0]))
        return see(person)

    walk.sees = mark_the_last_place  # type: ignore[method-assign]
    assert walk.go_and_search(5.0) is None
    assert costs[0] == LETHAL
    assert costs[-1] < LETHAL


def test_it_steps_aside_until_there_is_room_also_when_they_seem_to_walk_away(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(PersonTrack, "walks_away", lambda *arguments: 0.2)
    walk = Walk(Pose2(0.3, 2.4), lambda seconds: (0.9, 2.4))
    assert walk.go(14.0) is None
    stepping = [
        len(list(group)) for text, group in itertools.groupby(walk.trip.texts) if text == "stepping aside"
    ]
    assert max(stepping) > 20
    assert max(walk.distances) > 1.2


@pytest.mark.slow
def test_a_search_turns_to_who_walks_and_leaves_them_when_the_camera_does_not_know_them() -> None:
    wrong = along([(0.5, 3.7), (3.5, 3.7), (0.5, 3.7)], 0.25)

    def place(seconds: float) -> Point:
        if seconds < 8.0:
            return (2.6, 2.4) if seconds < 1.0 else (7.0, 4.0)
        return wrong(seconds - 8.0)

    walk = Walk(Pose2(1.6, 2.4), place)
    walk.sees = lambda person: walk.trip.world.now < 1.0  # type: ignore[method-assign]
    assert walk.go_and_search(26.0) is None
    assert 10 < walk.trip.texts.count("looking at who walks") < 80


def test_who_is_not_seen_after_stepping_aside_is_looked_for_where_the_robot_stood() -> None:
    come = along([(1.6, 2.4), (0.9, 2.4)], 0.3)
    stood: list[Point] = []
    walk = Walk(Pose2(0.3, 2.4), come)
    see, texts, world = walk.sees, walk.trip.texts, walk.trip.world

    def place(seconds: float) -> Point:
        if "stepping aside" not in texts:
            return come(seconds)
        stood.append((world.odom.x, world.odom.y))
        return 7.0, 4.0

    walk.place = place
    walk.sees = lambda person: "stepping aside" not in texts and see(person)  # type: ignore[method-assign]
    assert walk.go_and_search(16.0) is None
    assert texts[-1] != "stepping aside"
    assert walk.trip.navigator.person == pytest.approx(stood[0], abs=0.05)


@pytest.mark.slow
def test_it_goes_round_what_stands_between() -> None:
    table = (2.3, 2.2, 2.9, 2.8)
    walk = Walk(
        Pose2(1.0, 2.5), along([(1.7, 2.5), (2.0, 1.6), (3.4, 1.7), (3.5, 2.5)], 0.4), (*WALLS, table)
    )
    walk.beside = 2.0
    assert walk.go(25.0) is None
    assert walk.trip.world.hits == 0
    assert walk.distances[-1] < 1.4


def test_out_of_sight_it_goes_to_where_the_person_vanished_and_then_says_that_they_are_lost() -> None:
    route = [FIRST_ROOM, (4.05, 2.4), (4.6, 2.4), (4.6, 0.4)]
    walk = Walk(Pose2(1.2, 2.4), along(route, 0.45))
    walk.go(4.0)
    walk.blind = True
    result = walk.go(140.0)
    assert result is not None
    assert (result.outcome, result.code) == (Outcome.FAILED, "user_lost")
    assert walk.trip.world.command == STANDSTILL


def test_out_of_sight_the_limits_of_the_goal_hold_too() -> None:
    walk = Walk(Pose2(1.2, 2.4, 0.6), lambda seconds: (3.6, 2.4))
    turns: list[float] = []
    step = walk.trip.navigator.step

    def watched(*arguments: Any) -> CycleResult:
        answer = step(*arguments)
        turns.append(abs(answer.command.angular) if answer.command else 0.0)
        walk.blind = len(turns) > 10
        return answer

    walk.trip.navigator.step = watched  # type: ignore[method-assign]
    result = walk.go(90.0, 0.0, 0.2, 0.3)
    assert result is not None
    assert result.code == "user_lost"
    assert max(walk.speeds) <= 0.2 + 1e-9
    assert max(turns) <= 0.3 + 1e-9


def test_somebody_who_comes_back_into_view_is_followed_on() -> None:
    walk = Walk(Pose2(1.2, 2.4), along([FIRST_ROOM, (3.6, 2.4)], 0.3))
    see, world = walk.sees, walk.trip.world
    walk.sees = lambda person: not 3.0 < world.now < 9.0 and see(person)  # type: ignore[method-assign]
    walk.boxes = WALLS
    assert walk.go_and_search(16.0) is None
    assert walk.trip.texts[-1] == "following"
    assert 0.5 < walk.distances[-1] < 1.15


@pytest.mark.parametrize(("who", "turned"), [(LEADER + 1, False), (LEADER, True)])
def test_a_search_for_somebody_who_was_not_followed_just_before_ends_at_once(who: int, turned: bool) -> None:
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: FIRST_ROOM)
    walk.sees = lambda person: walk.trip.world.now < 1.0  # type: ignore[method-assign]
    assert walk.go(1.0) is None
    navigator, world = walk.trip.navigator, walk.trip.world
    if turned:
        world.advance(40.0)
        navigator.start(SpinGoal(1.0, 10.0), world.now)
        assert walk.walk_on(0.5) is None
    navigator.start(SearchGoal(who), world.now)
    result = walk.walk_on(1.0)
    assert result is not None
    assert result.code == "user_lost"
    assert walk.trip.world.command == STANDSTILL


def test_a_search_ends_when_the_person_is_seen_and_the_following_goes_on_with_their_trail() -> None:
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: (3.6, 2.4))
    navigator, world = walk.trip.navigator, walk.trip.world
    assert walk.go(2.0) is None
    navigator.start(SearchGoal(LEADER), world.now)
    found = walk.walk_on(1.0)
    assert found is not None and found.succeeded
    walk.blind = True
    navigator.start(FollowUserGoal(LEADER), world.now)
    assert walk.trip.cycle() is None
    assert walk.trip.texts[-1] == "following"
    assert world.command.linear > 0.0


def test_a_search_looks_at_everybody_who_walks_for_as_long() -> None:
    """The time for which it has looked at one does not count for the next, to whom it turns."""
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: FIRST_ROOM)
    assert walk.go(1.0) is None
    navigator, world = walk.trip.navigator, walk.trip.world
    navigator.start(SearchGoal(LEADER), world.now)
    search, robot = navigator._goal, world.odom
    assert isinstance(search, Search)
    said = []
    for number in range(31):
        now = world.now + 1.0 + 0.1 * number
        before_it, beside_it = robot.apply(1.5, 0.05 * number - 0.25), robot.apply(0.8, 1.8 + 0.04 * number)
        search.saw_legs(now, [beside_it, *([before_it] if number < 10 else [])])
        turned = robot.bearing_to(*beside_it) if number >= 20 else 0.0
        pose = Pose2(robot.x, robot.y, robot.yaw + turned)
        state = navigator._state_at(now, Odometry(now, pose, Twist2()), world.pose @ robot.inverse())
        said.append(search.step(state)[1].text)
    assert set(said[10:]) == {"looking at who walks"}


def test_without_anybody_to_see_it_never_moves() -> None:
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: (7.0, 4.0))
    result = walk.go(10.0)
    assert result is not None
    assert result.code == "user_lost"
    assert max(walk.speeds) == 0.0
    assert walk.trip.world.now == pytest.approx(3.1, abs=0.2)


@pytest.mark.parametrize(("ago", "goes"), [(20.0, True), (31.0, False)])
def test_who_was_seen_before_the_goal_is_followed_from_there(ago: float, goes: bool) -> None:
    trip = Trip(Pose2(1.2, 2.4))
    for when, x in ((-1.0, 2.8), (-0.5, 3.0), (0.0, 3.2)):
        seen = (trip.world.odom @ trip.world.pose.inverse()).apply(x, 2.4)
        trip.navigator.saw_person(trip.world.now - ago + when, LEADER, *seen)
    trip.navigator.start(FollowUserGoal(LEADER), trip.world.now)
    for _ in range(25):
        trip.cycle()
    assert (trip.world.pose.x > 1.4) == goes


def test_when_the_clock_was_set_back_only_new_sights_are_followed_from() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    tracks.saw(100.0, LEADER, 1.0, 1.0)
    tracks.forget(5.0)
    tracks.saw(5.0, LEADER, 2.0, 2.0)
    tracks.forget(6.0)
    assert tracks.of(LEADER).path.last(10.0) == [(2.0, 2.0)]
    tracks.forget(40.0)
    assert tracks.of(LEADER).seen is None


def test_distance_and_speed_of_the_goal() -> None:
    walk = Walk(Pose2(0.6, 2.4), along([(2.2, 2.4), (3.6, 2.4)], 0.15))
    assert walk.go(20.0, 1.5, 0.2) is None
    assert max(walk.speeds) == pytest.approx(0.2, abs=1e-6)
    assert walk.distances[-1] == pytest.approx(1.5, abs=0.15)


@pytest.mark.parametrize("bad", [(-1.0, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, math.inf)])
def test_bad_goals_move_nothing(bad: tuple[float, float, float]) -> None:
    trip = Trip(Pose2(1.0, 1.0))
    trip.navigator.start(FollowUserGoal(LEADER, *bad), 0.0)
    result = trip.cycle()
    assert result is not None
    assert result.code == "bad_input"


def test_a_bumper_is_backed_off_from_and_the_following_goes_on() -> None:
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: (3.2, 2.4))
    trip = walk.trip
    walk.go(1.0)
    trip.navigator.base_stop = BaseStop("bumper", "the left bumper is pressed")
    trip.navigator.saw_person(trip.world.now, LEADER, *(trip.world.odom @ Pose2(2.0, 0.0)).apply(0.0, 0.0))
    assert trip.cycle() is None
    assert trip.world.command.linear < 0.0
    assert "backing off" in trip.texts[-1]
    trip.navigator.base_stop = BaseStop()
    for _ in range(40):
        trip.navigator.saw_person(
            trip.world.now, LEADER, *(trip.world.odom @ trip.world.pose.inverse()).apply(3.2, 2.4)
        )
        assert trip.cycle() is None
    assert trip.texts[-1].startswith("following")


def test_the_velocity_of_a_target_needs_no_regular_sights() -> None:
    target = PersonTrack(velocity_time=0.3, coast=0.5)
    for stamp in np.cumsum([0.1, 0.3, 0.2, 0.2, 0.4, 0.1, 0.2, 0.3, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3, 0.3]):
        target.saw(float(stamp), 0.4 * float(stamp), -0.2 * float(stamp))
    assert target.velocity == pytest.approx((0.4, -0.2), abs=0.02)
    seen = target.seen
    target.saw(0.5, 9.0, 9.0)
    target.saw(9.0, math.nan, 0.0)
    assert target.seen == seen
    assert seen is not None
    assert target.at(seen + 5.0) == pytest.approx((0.4 * (seen + 0.5), -0.2 * (seen + 0.5)), abs=0.03)


def test_it_never_drives_towards_somebody_who_is_too_near(monkeypatch: pytest.MonkeyPatch) -> None:
    def straight_on(*arguments: Any) -> Control:
        return Control(Twist2(0.2, 0.0), 2.0)

    monkeypatch.setattr(give_way, "place_to_step_aside", lambda *arguments: (3.5, 2.4))
    monkeypatch.setattr(Controller, "control", straight_on)
    walk = Walk(Pose2(1.2, 2.4), lambda seconds: (1.68, 2.4))
    kept = NavigatorParameters(follow=FollowParameters(follow_back_speed=0.0))
    walk.trip.navigator = Navigator(make_map(), kept)
    assert walk.go(8.0) is None
    assert "stepping aside" in walk.trip.texts
    assert min(walk.distances) > 0.45


@pytest.mark.slow
@pytest.mark.parametrize("x", [1.88, 1.92])
def test_it_stays_before_somebody_when_something_keeps_it_a_hand_away(x: float) -> None:
    walk = Walk(Pose2(0.9, 2.4), lambda seconds: (2.2, 2.4), (*WALLS, (x, 2.2, x + 0.03, 2.6)))
    walk.sees = lambda person: abs(walk.trip.world.pose.bearing_to(*person)) < 0.5  # type: ignore[method-assign]
    assert walk.go(25.0, distance=0.5) is None
    assert "backing out" not in walk.trip.texts
    assert max(walk.distances[-100:]) < 0.7
    assert walk.trip.world.hits == 0
