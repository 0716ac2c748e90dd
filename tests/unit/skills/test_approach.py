"""Approaching somebody who stands in a room, by odometry alone."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, angle_difference
from florence_bt.core.outcome import Outcome, Result
from florence_bt.skills.navigation.navigate.approach import way_round
from florence_bt.skills.navigation.navigate.drive_actions import ApproachMeGoal
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M, keep_off
from tests.unit.skills.navigation_world import WALLS, Box, Trip, cast

Point = tuple[float, float]
ROBOT = Pose2(0.8, 2.4, 0.2)
PERSON: Point = (2.6, 2.4)
NOBODY: Point = (-9.0, -9.0)


class LostTrip(Trip):
    """A robot that does not know where it is in the map."""

    def map_from_odom(self) -> Pose2 | None:  # type: ignore[override]
        return None


class Visit:
    """Approaches somebody whom the camera sees as far as its picture and the walls allow."""

    def __init__(self, robot: Pose2 = ROBOT, person: Point = PERSON, boxes: tuple[Box, ...] = WALLS) -> None:
        self.last_sight: tuple[float, list[Point]] | None = None
        self.boxes = boxes
        self.person = person
        self.camera = True
        self.distances: list[float] = []
        self.commands: list[Twist2] = []
        self.told: list[Point] = []
        self.trip: Trip = LostTrip(robot, boxes=self._boxes())
        self.world = self.trip.world

    def _boxes(self) -> tuple[Box, ...]:
        x, y = self.person
        legs = [(x - 0.06, y + side - 0.05, x + 0.06, y + side + 0.05) for side in (-0.1, 0.1)]
        return (*self.boxes, *legs)

    def stands_at(self, person: Point) -> None:
        self.person = person
        self.world.boxes = list(self._boxes())

    def start(
        self,
        distance: float = 0.0,
        p2r: float = 0.0,
        r2p: float = 0.0,
        speeds: tuple[float, float] = (0.0, 0.0),
        place: Point | None = None,
    ) -> None:
        place = self.world.pose.inverse().apply(*self.person) if place is None else place
        self.trip.navigator.start(ApproachMeGoal(*place, distance, p2r, r2p, *speeds), self.world.now)

    def sees(self) -> bool:
        robot = self.world.pose
        bearing, away = robot.bearing_to(*self.person), math.dist((robot.x, robot.y), self.person)
        if not self.camera or abs(bearing) > math.radians(28) or not 0.6 < away < 4.0:
            return False
        angle = np.array([robot.yaw + bearing])
        return bool(cast(robot.x, robot.y, angle, np.array(self.boxes), 9.0)[0] > away)

    def step(self) -> Result | None:
        world = self.world
        if self.sees():
            in_odom = world.odom @ world.pose.inverse() @ Pose2(*self.person)
            stranger = in_odom.x + 1.0, in_odom.y + 1.0
            self.last_sight = world.now, [stranger, (in_odom.x, in_odom.y)]
        # As long as nobody sees them anew, navigation tells the last sight in every cycle.
        if self.last_sight is not None:
            self.trip.navigator.saw_people(*self.last_sight)
        result = self.trip.cycle()
        self.commands.append(world.command)
        self.distances.append(math.dist((world.pose.x, world.pose.y), self.person))
        if self.trip.navigator.person is not None:
            self.told.append((world.pose @ world.odom.inverse()).apply(*self.trip.navigator.person))
        return result

    def go(self, limit: float = 70.0) -> Result:
        for _ in range(round(limit * 10)):
            result = self.step()
            if result is not None:
                assert self.world.command == STANDSTILL
                assert not self.trip.navigator.active
                self.world.advance(0.6)
                assert self.world.twist == STANDSTILL
                return result
        pytest.fail(f"not over after {limit} s: {self.trip.texts[-1]}")

    def assert_at(self, distance: float, p2r: float = 0.0, r2p: float = 0.0, start: Pose2 = ROBOT) -> None:
        x, y = self.person
        angle = math.atan2(start.y - y, start.x - x) + p2r
        goal = Pose2(x + distance * math.cos(angle), y + distance * math.sin(angle))
        assert self.world.pose.distance_to(goal) < 0.1
        assert abs(angle_difference(self.world.pose.yaw, angle + math.pi - r2p)) < 0.1
        assert self.world.hits == 0
        assert min(self.distances) > NEAREST_M - 0.03


@pytest.mark.parametrize(
    ("distance", "p2r", "r2p"),
    [
        (0.0, 0.0, 0.0),
        (1.2, 0.0, 0.0),
        (0.5, 0.0, 0.0),
        (0.0, math.pi, 0.0),
        (0.5, math.pi, math.pi),
        (0.0, math.pi / 2, math.pi / 2),
        (1.0, -math.pi / 2, math.pi / 2),
        (0.0, 0.0, math.pi / 2),
    ],
)
def test_it_stands_where_the_goal_says_without_a_place_in_the_map(
    distance: float, p2r: float, r2p: float
) -> None:
    visit = Visit()
    visit.start(distance, p2r, r2p)
    assert visit.go().outcome is Outcome.SUCCEEDED
    visit.assert_at(distance or 0.8, p2r, r2p)


def test_who_is_nearest_is_approached_when_the_goal_names_no_place() -> None:
    visit = Visit()
    visit.start(place=(0.0, 0.0))
    assert visit.go().outcome is Outcome.SUCCEEDED
    visit.assert_at(0.8)


def test_the_speeds_of_the_goal_hold_in_both_phases() -> None:
    visit = Visit()
    visit.start(0.0, math.pi / 2, math.pi / 2, speeds=(0.2, 0.4))
    assert visit.go().outcome is Outcome.SUCCEEDED
    assert max(command.linear for command in visit.commands) == pytest.approx(0.2, abs=1e-6)
    assert max(abs(command.angular) for command in visit.commands) == pytest.approx(0.4, abs=1e-6)
    assert min(command.linear for command in visit.commands) >= 0.0


def test_without_the_camera_the_laser_finds_them_at_the_place_of_the_goal() -> None:
    visit = Visit()
    visit.camera = False
    visit.start(0.0, math.pi / 2)
    assert visit.go().outcome is Outcome.SUCCEEDED
    visit.assert_at(0.8, math.pi / 2)


@pytest.mark.slow
def test_the_legs_of_who_steps_aside_beside_the_picture_are_followed() -> None:
    visit = Visit()
    visit.start(0.0, math.pi / 2)
    while abs(visit.world.pose.bearing_to(*visit.person)) < math.radians(28) or visit.world.now < 1.0:
        assert visit.step() is None
    for step in range(10):
        visit.stands_at((PERSON[0] + 0.05 * step, PERSON[1]))
        for _ in range(3):
            assert visit.step() is None
    assert visit.go().outcome is Outcome.SUCCEEDED
    visit.assert_at(0.8, math.pi / 2)
    assert math.dist(visit.told[-1], visit.person) < 0.12


def test_the_laser_moves_the_person_by_a_share_and_the_camera_at_once() -> None:
    visit = Visit()
    visit.camera = False
    beside = visit.world.pose.inverse().apply(PERSON[0] - 0.3, PERSON[1])
    visit.start(place=beside)
    visit.step()
    visit.step()
    first = math.dist(visit.told[-1], PERSON)
    assert 0.15 < first < 0.25
    visit.camera = True
    visit.step()
    assert math.dist(visit.told[-1], PERSON) < 0.03


def test_a_wall_is_not_taken_for_legs() -> None:
    visit = Visit(person=(0.3, 2.4), robot=Pose2(1.5, 2.4, math.pi))
    visit.camera = False
    visit.start(1.0, 0.0)
    assert visit.go().outcome is Outcome.SUCCEEDED
    visit.assert_at(1.0, start=Pose2(1.5, 2.4))


@pytest.mark.parametrize("place", [(1.5, 0.3), (0.0, 0.0)])
def test_without_anybody_it_never_moves(place: Point) -> None:
    visit = Visit(person=NOBODY)
    visit.start(place=place)
    result = visit.go()
    assert (result.outcome, result.code) == (Outcome.FAILED, "user_lost")
    assert all(command == STANDSTILL for command in visit.commands)
    assert visit.world.now == pytest.approx(5.7, abs=0.2)


def test_who_walks_away_is_lost_and_the_robot_stops() -> None:
    visit = Visit()
    visit.start(0.0, math.pi / 2, speeds=(0.15, 0.0))
    for _ in range(25):
        assert visit.step() is None
    visit.stands_at(NOBODY)
    result = visit.go()
    assert (result.outcome, result.code) == (Outcome.FAILED, "user_lost")
    assert "5 s" in result.reason


@pytest.mark.slow
def test_what_the_laser_shows_in_the_way_is_not_driven_into() -> None:
    visit = Visit()
    visit.start()
    for _ in range(15):
        assert visit.step() is None
    # A board before the person, from wall to wall; it hides them too.
    visit.boxes = (*WALLS, (1.75, 0.0, 1.8, 5.0))
    visit.stands_at(PERSON)
    result = visit.go()
    assert (result.outcome, result.code) == (Outcome.FAILED, "blocked")
    assert result.reason
    assert visit.world.hits == 0
    assert 10.0 < visit.world.now < 25.0


def test_a_base_that_does_not_move_makes_no_progress() -> None:
    visit = Visit()
    visit.start()
    advance = visit.world.advance

    def held(seconds: float) -> None:
        visit.world.command = STANDSTILL
        advance(seconds)

    visit.world.advance = held  # type: ignore[method-assign]
    result = visit.go()
    assert (result.code, result.reason) == ("no_progress", "the robot has not moved for 10 s")


@pytest.mark.slow
def test_after_a_minute_it_gives_up() -> None:
    visit = Visit(Pose2(0.4, 2.4), (3.6, 2.4))
    visit.start(speeds=(0.035, 0.0))
    result = visit.go()
    assert (result.outcome, result.code) == (Outcome.FAILED, "timed_out")
    assert "60 s" in result.reason
    assert visit.world.now == pytest.approx(60.6, abs=0.3)


def test_somebody_who_comes_nearer_is_not_driven_at() -> None:
    visit = Visit()
    visit.start(0.5)
    for step in range(60):
        x = max(visit.world.pose.x + 0.42, 2.6 - 0.02 * step)
        visit.stands_at((x, 2.4))
        if visit.step() is not None:
            break
        if visit.distances[-1] < NEAREST_M - 0.05:
            away = abs(visit.world.pose.bearing_to(*visit.person)) > 0.9
            assert visit.commands[-1].linear <= 0.0 or away
    assert visit.world.hits == 0


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"distance": -1.0}, "-1.0 m"),
        ({"distance": math.nan}, "nan m"),
        ({"distance": 0.3}, "too near to a person (would have worked: 0.5 m and more)"),
        ({"speeds": (math.inf, 0.0)}, "inf m/s"),
        ({"speeds": (0.0, -0.1)}, "-0.1 rad/s"),
        ({"p2r": math.nan}, "nan"),
        ({"r2p": math.inf}, "inf"),
        ({"place": (math.nan, 0.0)}, "nan"),
    ],
)
def test_bad_goals_move_nothing(bad: dict, says: str) -> None:
    visit = Visit()
    visit.start(**bad)
    result = visit.step()
    assert result is not None
    assert (result.outcome, result.code) == (Outcome.FAILED, "bad_input")
    assert says in result.reason
    assert visit.commands == [STANDSTILL]


def test_a_bumper_is_backed_off_from_and_marked_where_the_robot_is_known_to_be() -> None:
    visit = Visit()
    navigator = visit.trip.navigator
    visit.start()
    for _ in range(30):
        assert visit.step() is None
    navigator.base_stop = BaseStop("bumper", "the left bumper is pressed")
    assert visit.step() is None
    assert visit.commands[-1].linear < 0.0
    navigator.base_stop = BaseStop()
    before = navigator.global_costmap.master.copy()
    for _ in range(40):
        if visit.step() is not None:
            break
    assert (navigator.global_costmap.master == before).all()
    navigator.start(ApproachMeGoal(1.0, 0.0), visit.world.now)
    visit.step()
    navigator.base_stop = BaseStop("wheel_drop", "the left wheel hangs in the air")
    result = visit.step()
    assert result is not None and result.code == "wheel_drop"


@pytest.mark.parametrize("code", ["no_scan", "no_pose"])
def test_blind_it_stands_and_then_says_why(code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    visit = Visit()
    visit.start()
    for _ in range(20):
        assert visit.step() is None
    if code == "no_scan":
        monkeypatch.setattr(visit.trip, "see", lambda: None)
    else:
        monkeypatch.setattr(visit.world, "odometry", lambda: None)
    result = visit.go()
    assert result.code == code
    assert all(command == STANDSTILL for command in visit.commands[-60:])


@pytest.mark.slow
def test_a_cancel_stops_it_at_every_moment() -> None:
    visit = Visit()
    visit.start(0.0, math.pi / 2, math.pi / 2)
    steps = 0
    while visit.step() is None:
        steps += 1
    assert steps > 50
    for stop_after in range(0, steps, 9):
        visit = Visit()
        visit.start(0.0, math.pi / 2, math.pi / 2)
        for _ in range(stop_after):
            assert visit.step() is None
        visit.trip.navigator.cancel()
        result = visit.step()
        assert result is not None and result.outcome is Outcome.CANCELLED
        assert visit.world.command == STANDSTILL and not visit.trip.navigator.active


def test_an_old_picture_is_not_somebody_who_is_seen() -> None:
    visit = Visit(person=NOBODY)
    visit.world.advance(1.0)
    visit.start(place=(1.5, 0.0))
    visit.step()
    visit.trip.navigator.saw_people(0.5, [visit.world.odom.apply(1.5, 0.0)])
    visit.step()
    assert visit.trip.texts[-1].startswith("waiting")


@pytest.mark.parametrize("start", [(-2.0, 0.0), (-0.6, 0.0), (0.3, 0.1), (0.0, -1.0)])
@pytest.mark.parametrize("end", [(0.8, 0.0), (0.0, 0.5), (-0.4, -0.4), (1.5, 1.5)])
def test_the_way_leads_round_the_person(start: Point, end: Point) -> None:
    way, side = way_round(start, end, (0.0, 0.0), 0.0)
    assert tuple(way[0]) == pytest.approx(start) and tuple(way[-1]) == pytest.approx(end)
    assert np.hypot(*np.diff(way, axis=0).T).max() < 0.051
    assert np.hypot(*way.T).min() > min(math.hypot(*start), math.hypot(*end), 0.7) - 0.031
    # The shorter way, and no turning back.
    assert np.abs(np.unwrap(np.arctan2(way[:, 1], way[:, 0])) - math.atan2(start[1], start[0])).max() < 3.3
    assert side in (-1.0, 1.0)


def test_half_a_circle_goes_on_the_way_round_that_was_begun() -> None:
    for wobble, side in itertools.product((-0.01, 0.01), (-1.0, 1.0)):
        way, kept = way_round((-1.5, wobble), (0.8, 0.0), (0.0, 0.0), side)
        assert kept == side
        # Clockwise from the left leads over the top.
        assert (way[len(way) // 2, 1] > 0.6) == (side < 0.0)


@pytest.mark.parametrize(
    ("person", "command", "kept"),
    [
        ((0.49, 0.0), Twist2(0.2, 0.5), Twist2(0.0, 0.5)),
        ((0.49, 0.0), Twist2(-0.2, 0.5), Twist2(-0.2, 0.5)),
        ((0.51, 0.0), Twist2(0.2, 0.5), Twist2(0.2, 0.5)),
        ((0.0, 0.4), Twist2(0.2, 0.5), Twist2(0.2, 0.5)),
        ((-0.3, 0.1), Twist2(0.2, 0.5), Twist2(0.2, 0.5)),
    ],
)
def test_only_the_way_forward_towards_who_is_too_near_is_left_out(
    person: Point, command: Twist2, kept: Twist2
) -> None:
    assert keep_off(Pose2(), person, command) == kept
