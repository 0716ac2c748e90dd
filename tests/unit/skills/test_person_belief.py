"""Where somebody may be who walked out of sight, and where a robot goes to let somebody pass."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.person_belief import PersonBelief
from florence_bt.skills.navigation.navigate.state import Costmaps
from florence_bt.skills.navigation.navigate.step_aside import place_to_step_aside
from tests.unit.skills.navigation_world import WALLS, Box, make_map

MIDDLE = (2.0, 2.4)
DOOR = (4.05, 2.4)


def costmaps(boxes: tuple[Box, ...] = WALLS) -> Costmaps:
    return Navigator(make_map(boxes))._costmaps


def off(heading: float, wanted: float) -> float:
    return abs(math.remainder(heading - wanted, math.tau))


def test_who_went_through_a_door_is_behind_it() -> None:
    who = PersonBelief(costmaps(), DOOR, (0.4, 0.0), 0.0)
    robot = Pose2(2.6, 2.4)
    for tenth in range(1, 50):
        who.update(0.1 * tenth, robot, [])
    place = who.best_place(robot)
    assert place is not None
    assert place[0] > 4.1
    assert math.dist(place, DOOR) < 0.7 + 5.0


def test_a_place_to_which_no_way_leads_is_not_proposed_again() -> None:
    who = PersonBelief(costmaps(), DOOR, (0.4, 0.0), 0.0)
    robot = Pose2(2.6, 2.4)
    who.update(5.0, robot, [])
    first = who.best_place(robot)
    assert first is not None
    who.no_way_to(first)
    who.update(5.1, robot, [])
    second = who.best_place(robot)
    assert second is not None
    assert math.dist(first, second) > 0.5


def test_nobody_walks_further_than_they_can() -> None:
    who = PersonBelief(costmaps(), (1.0, 1.0), (0.4, 0.0), 0.0)
    robot = Pose2(7.0, 4.0)
    who.update(1.0, robot, [])
    place = who.best_place(robot)
    assert place is not None
    assert math.dist(place, (1.0, 1.0)) <= 1.7


def test_where_the_camera_has_just_looked_is_not_looked_at_again_until_it_is_forgotten() -> None:
    who = PersonBelief(costmaps(), MIDDLE, (0.0, 0.0), 0.0)
    robot = Pose2(*MIDDLE)
    for heading in (0.0, math.pi / 2, -math.pi / 2):
        who.update(3.0, Pose2(*MIDDLE, heading), [])
    behind, share = who.best_view(robot)
    assert off(behind, math.pi) < 0.7
    for tenth in range(31, 200):
        who.update(0.1 * tenth, Pose2(*MIDDLE, math.pi), [])
    again, _ = who.best_view(robot)
    assert off(again, math.pi) > 0.7
    assert 0.0 < share < 1.0


def test_where_nobody_was_a_quarter_of_a_minute_ago_they_are_less_likely() -> None:
    looked, other = (PersonBelief(costmaps(), MIDDLE, (0.0, 0.0), 0.0) for _ in range(2))
    for eighth in range(8):
        looked.update(4.0, Pose2(*MIDDLE, eighth * math.pi / 4.0), [])
    elsewhere, robot = Pose2(7.0, 4.0, math.pi / 2.0), Pose2(*MIDDLE)
    for who in (looked, other):
        who.update(20.0, elsewhere, [])
    assert looked.best_view(robot)[1] < 0.7 * other.best_view(robot)[1]


def test_something_like_legs_is_looked_at_first() -> None:
    robot = Pose2(*MIDDLE)
    who = PersonBelief(costmaps(), MIDDLE, (0.0, 0.0), 0.0)
    legs = (2.0, 3.6)
    who.update(3.0, robot, [legs])
    heading, _ = who.best_view(robot)
    assert off(heading, math.pi / 2) < 0.45
    assert who.best_place(robot) == pytest.approx(legs, abs=0.45)


def test_a_place_near_the_edge_of_the_map_is_no_trouble() -> None:
    who = PersonBelief(costmaps(), (-3.0, 99.0), (math.inf, 0.0), 0.0)
    who.update(1.0, Pose2(-0.4, -0.4, 2.0), [(50.0, 50.0)])
    heading, share = who.best_view(Pose2(-0.4, -0.4))
    assert math.isfinite(heading) and 0.0 <= share <= 1.0


CORRIDOR: tuple[Box, ...] = (*WALLS, (0.0, 0.0, 3.2, 2.0), (0.0, 2.9, 3.2, 4.2))
"""In the first room only a way of 0.9 m to the door is left, and a space of 0.8 m before it."""


def test_in_a_corridor_it_goes_where_there_is_room_to_pass() -> None:
    robot, person = Pose2(2.6, 2.45, math.pi), (1.9, 2.45)
    place = place_to_step_aside(costmaps(CORRIDOR), robot, person, 1.3)
    assert place is not None
    assert place[0] > 4.1
    assert math.dist(place, person) >= 1.3


def test_it_does_not_go_past_the_person() -> None:
    dead_end: tuple[Box, ...] = (*CORRIDOR, (4.0, 2.0, 4.1, 2.8), (3.2, 0.0, 4.0, 2.0), (3.2, 2.9, 4.0, 5.0))
    robot = Pose2(3.5, 2.45, math.pi)
    assert place_to_step_aside(costmaps(dead_end), robot, (2.8, 2.45), 1.3) is None


def test_out_of_the_map_there_is_no_such_place() -> None:
    assert place_to_step_aside(costmaps(), Pose2(99.0, 0.0), (1.0, 1.0), 1.3) is None
