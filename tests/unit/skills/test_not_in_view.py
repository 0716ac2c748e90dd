"""Who is not seen: gone, when the camera sees the place free where they should be, or not in view."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import Posture, TrackedUser
from florence_bt.skills.people.user_tracker.camera_view import UPRIGHT, CameraView
from florence_bt.skills.people.user_tracker.look import LookForUser, Wanted
from florence_bt.trees.language.declarations import own_declarations
from tests.unit.skills.test_camera_view import body, view
from tests.unit.skills.test_laser_view import legs
from tests.unit.skills.test_laser_view import seen as seen_by_laser

HERE = Pose2(1.0, 2.0, math.pi / 2)
"""Where the robot stands, map frame: what is 1.5 m ahead is at (1.0, 3.5)."""
FREE, HIDDEN = view(), view((0.9, (0.0, 2.0), 0.5, -0.5))
FAILURES = own_declarations()["look_for_user"].failures


def person(
    x: float, y: float, user_id: int = 7, posture: Posture = "standing", height: float = 1.7
) -> TrackedUser:
    return TrackedUser(user_id, user_id, x, y, math.dist((x, y), (HERE.x, HERE.y)), posture, height)


class Looks:
    """Looks one after the other, each of ten pictures."""

    def __init__(self) -> None:
        self.look = LookForUser()
        self.now = 10.0

    def at(
        self,
        users: Sequence[TrackedUser] = (),
        views: Sequence[CameraView | None] = (None,) * 10,
        wanted: Wanted | None = None,
        robot: Pose2 | None = HERE,
    ) -> Result:
        self.look.start(self.now, 2.0, wanted)
        for seen in views:
            self.now += 0.1
            self.look.feed(self.now, users, robot, view=seen and seen.moved_by(robot or Pose2()))
        self.now += 2.0
        result = self.look.result(self.now)
        assert result is not None and (result.succeeded or result.code in FAILURES)
        return result


@pytest.fixture
def looks() -> Looks:
    return Looks()


@pytest.mark.parametrize(
    ("seen", "code"),
    [
        (FREE, "no_user_seen"),
        (HIDDEN, "user_not_in_view"),
        (None, "user_not_in_view"),
        (view(body(1.5)), "user_not_in_view"),
    ],
    ids=["free", "something in between", "no view", "something there"],
)
def test_a_place_that_was_asked_for_is_free_or_not_in_view(
    looks: Looks, seen: CameraView | None, code: str
) -> None:
    assert looks.at(views=[seen] * 10, wanted=Wanted(x=1.5)).code == code


def test_a_place_is_to_the_left_of_the_robot_too(looks: Looks) -> None:
    beside = view(body(1.5, left=0.7))  # its middle is half a metre to the left
    assert looks.at(views=[beside] * 10, wanted=Wanted(x=1.5, y=0.5)).code == "user_not_in_view"
    assert looks.at(views=[beside] * 10, wanted=Wanted(x=1.5, y=-0.5)).code == "no_user_seen"


@pytest.mark.parametrize(("seen", "code"), [(FREE, "no_user_seen"), (HIDDEN, "user_not_in_view")])
def test_who_was_found_before_is_expected_there(looks: Looks, seen: CameraView, code: str) -> None:
    assert looks.at([person(1.0, 3.5)]).succeeded
    assert looks.at(views=[seen] * 10, wanted=Wanted(7)).code == code


def test_from_another_place_they_are_expected_where_they_were(looks: Looks) -> None:
    """The robot has turned away: the free place before it is not theirs."""
    assert looks.at([person(1.0, 3.5)]).succeeded
    away = Pose2(1.0, 2.0, -math.pi / 2)
    assert looks.at(views=[FREE] * 10, wanted=Wanted(7), robot=away).code == "user_not_in_view"
    further = Pose2(1.0, 1.5, math.pi / 2)
    assert looks.at(views=[FREE] * 10, wanted=Wanted(7), robot=further).code == "no_user_seen"


def test_they_are_expected_where_they_were_found_last(looks: Looks) -> None:
    assert looks.at([person(1.0, 3.5)]).succeeded and looks.at([person(1.0, 5.0)]).succeeded
    between = view((2.0, (0.0, 2.0), 0.5, -0.5))
    assert looks.at(views=[between] * 10, wanted=Wanted(7)).code == "user_not_in_view"


def test_of_anybody_and_of_who_was_never_found_nothing_is_expected(looks: Looks) -> None:
    for wanted in (None, Wanted(7)):
        assert looks.at(views=[HIDDEN] * 10, wanted=wanted).code == "no_user_seen"
    assert looks.at([person(1.0, 3.5)]).succeeded
    for wanted in (None, Wanted(8)):
        assert looks.at(views=[HIDDEN] * 10, wanted=wanted).code == "no_user_seen"


@pytest.mark.parametrize(("free", "code"), [(4, "user_not_in_view"), (5, "no_user_seen")])
def test_half_of_the_pictures_must_show_the_place_free(looks: Looks, free: int, code: str) -> None:
    views = [FREE] * free + [HIDDEN] * (10 - free)
    assert looks.at(views=views, wanted=Wanted(x=1.5)).code == code
    assert looks.at(views=[HIDDEN] * 10, wanted=Wanted(x=1.5)).code == "user_not_in_view", "of each look anew"


def test_who_lay_is_expected_on_the_floor(looks: Looks) -> None:
    """Over who lies the camera sees the wall: that is no sign that they have got up."""
    still_there = view((1.3, (0.0, 0.25), 0.8, -0.8))
    assert looks.at([person(1.0, 3.5, posture="lying", height=0.25)]).succeeded
    for wanted in (Wanted(7), Wanted(x=1.5)):
        assert looks.at(views=[still_there] * 10, wanted=wanted).code == "user_not_in_view"
        assert looks.at(views=[FREE] * 10, wanted=wanted).code == "no_user_seen"
    assert still_there.is_free(1.5, 0.0, UPRIGHT)


def test_elsewhere_somebody_upright_is_expected(looks: Looks) -> None:
    """Who lay 1 m further on says nothing about the place that is asked for."""
    low = view((1.3, (0.0, 0.25), 0.8, -0.8))
    assert looks.at([person(1.0, 4.5, posture="lying", height=0.25)]).succeeded
    assert looks.at(views=[low] * 10, wanted=Wanted(x=1.5)).code == "no_user_seen"


def test_too_few_pictures_say_nothing_of_a_place_either(looks: Looks) -> None:
    assert looks.at(views=[FREE] * 4, wanted=Wanted(x=1.5)).code == "no_image"


def test_a_look_that_sees_the_place_free_ends_as_soon_as_any_other(looks: Looks) -> None:
    looks.look.start(10.0, 5.0, Wanted(x=1.5))
    for k in range(8):
        looks.look.feed(10.1 + 0.1 * k, [], HERE, view=FREE.moved_by(HERE))
    result = looks.look.result(10.9)
    assert result is not None and result.code == "no_user_seen"


def test_a_place_of_long_ago_says_nothing():
    looks = Looks()
    assert looks.at([person(1.0, 3.5)]).succeeded
    looks.now += 61.0
    assert looks.at(views=[HIDDEN] * 10, wanted=Wanted(7)).code == "no_user_seen"


@pytest.mark.parametrize(
    ("posture", "code"),
    [("standing", "no_user_seen"), ("unknown", "no_user_seen"), ("sitting", "user_not_in_view")],
)
def test_from_nearby_the_laser_tells_who_stood_there_and_left(
    looks: Looks, posture: Posture, code: str
) -> None:
    """The camera sees nobody at half a metre: before, whoever walked on counted as still there."""
    near = Pose2(1.0, 3.0, math.pi / 2)
    for circles, expected in (legs(1.0, 3.5), "user_not_in_view"), ((), code):
        assert looks.at([person(1.0, 3.5, posture=posture)], robot=near).succeeded
        looks.look.saw_scan(seen_by_laser(*circles, robot=near))
        assert looks.at(wanted=Wanted(7), robot=near).code == expected
