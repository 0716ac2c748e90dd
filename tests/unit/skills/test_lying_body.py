"""Where somebody lies, of whom the camera sees more and then less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.skills.people.user_tracker.detector import Detection, Outline
from florence_bt.skills.people.user_tracker.lying_body import LyingBodies, LyingBody
from florence_bt.skills.people.user_tracker.tracker import UserTracker

IN_BED, ON_THE_FLOOR = 0.75, 0.25


def outline(first: float, last: float, cut_at: float | None = None, hidden: float | None = None) -> Outline:
    """A body from one y to another one, 2 m ahead, and the floor beyond.

    The edge of the picture cuts it at one of them, or it hides there what is behind.
    """
    along = np.arange(first, last, 0.02)
    points = np.array([(x, y) for y in along for x in (1.9, 2.0, 2.1)], np.float32)
    floor = [
        (x, end + sign * away)
        for end, sign in ((first, -1.0), (last, 1.0))
        if end not in (cut_at, hidden)
        for away in np.arange(0.03, 0.6, 0.04)
        for x in np.arange(1.75, 2.3, 0.05)
    ]
    goes_on = np.abs(points[:, 1] - (np.inf if cut_at is None else cut_at)) < 0.06
    return Outline(points, goes_on, np.array(floor, np.float32).reshape(-1, 2))


WHOLE, CUT = outline(-0.8, 0.8), outline(-0.4, 0.8, cut_at=-0.4)


def lying(x: float, y: float = 0.0, shown: Outline | None = WHOLE, height: float = IN_BED) -> Detection:
    return Detection(x, y, x, 0.95, posture="lying", height=height, outline=shown)


def place_after(*detections: Detection) -> tuple[float, float] | None:
    resting = LyingBody()
    for each in detections:
        resting.take(each)
    return resting.place


def test_pictures_of_the_whole_body_count_most() -> None:
    seen = place_after(*[lying(2.0)] * 3, *[lying(2.3, shown=CUT)] * 6)
    assert seen is not None and seen[0] == pytest.approx(2.03, abs=0.02)
    assert place_after(lying(2.0), lying(2.2), lying(2.2, shown=None)) == pytest.approx(
        (2.133, 0.0), abs=0.01
    )


@pytest.mark.parametrize("height", [IN_BED, ON_THE_FLOOR])
def test_it_is_the_middle_between_both_ends(height: float) -> None:
    votes = [lying(2.0, 0.2, shown, height) for shown in (WHOLE, WHOLE, CUT)]
    assert place_after(*votes) == pytest.approx((2.0, 0.0), abs=0.04)


@pytest.mark.parametrize("height", [IN_BED, ON_THE_FLOOR])
def test_two_pictures_of_one_end_each_show_both(height: float) -> None:
    other = outline(-0.8, 0.4, cut_at=0.4)
    cut = [lying(2.0, 0.2, shown, height) for shown in (CUT, CUT, other, other)]
    assert place_after(*cut) == pytest.approx((2.0, 0.0), abs=0.05)


def test_in_bed_the_middle_is_at_least_half_an_adult_from_the_end_that_is_shown() -> None:
    legs = lying(2.0, 0.5, outline(-0.1, 0.8, cut_at=-0.1), IN_BED)
    assert place_after(*[legs] * 3) == pytest.approx((2.0, 0.8 - 0.85), abs=0.05)
    known_better = replace(legs, y=-0.2)
    assert place_after(*[known_better] * 3) == pytest.approx((2.0, -0.2), abs=0.01)


def test_of_a_body_on_the_floor_that_hides_its_other_end_the_middle_is_half_a_body_from_the_shown_one() -> (
    None
):
    """Behind a trunk its legs are not seen: no edge cuts them, and the floor is not seen there either."""
    trunk = lying(2.0, 0.5, outline(-0.1, 0.8, hidden=-0.1), ON_THE_FLOOR)
    seen = place_after(*[trunk] * 3)
    assert seen is not None and 0.8 - 1.0 < seen[1] < 0.8 - 0.65


def test_a_short_body_on_the_floor_is_a_child_when_the_floor_is_seen_at_both_ends() -> None:
    child = lying(2.0, 0.3, outline(-0.5, 0.5), ON_THE_FLOOR)
    assert place_after(*[child] * 3) == pytest.approx((2.0, 0.0), abs=0.06)


def test_legs_here_and_a_trunk_there_on_the_floor_are_one_body() -> None:
    places = LyingBodies()
    legs = lying(2.0, -0.55, outline(-0.85, -0.4, hidden=-0.4), ON_THE_FLOOR)
    trunk = lying(2.0, 0.4, outline(0.1, 0.85, hidden=0.1), ON_THE_FLOOR)
    for _ in range(3):
        places.near(legs, 0.0).take(legs)
        body = places.near(trunk, 0.0)
        body.take(trunk)
    assert body.place == pytest.approx((2.0, 0.0), abs=0.06)
    beyond = lying(2.0, 2.2, outline(1.6, 2.4), ON_THE_FLOOR)
    assert places.near(beyond, 0.0) is not body


def test_an_end_that_pictures_show_near_their_edge_alone_is_not_the_end() -> None:
    """The edge cuts the body askew, and of the far side it cuts nothing."""
    whole = outline(-0.1, 0.8)
    near_side = whole.points[:, 0] < 2.05
    askew = Outline(whole.points, near_side & (whole.points[:, 1] < -0.04))
    assert place_after(*[lying(2.0, 0.5, askew)] * 3) == pytest.approx((2.0, 0.8 - 0.85), abs=0.05)


def test_of_a_body_without_an_end_or_too_short_the_network_knows_the_middle() -> None:
    points = outline(-0.4, 0.4).points
    trunk = Outline(points, np.abs(points[:, 1]) > 0.34)
    assert place_after(*[lying(2.0, 0.2, trunk)] * 3) == pytest.approx((2.0, 0.2))
    short = outline(0.0, 0.5)
    assert place_after(*[lying(2.0, 0.4, short, IN_BED)] * 3) == pytest.approx((2.0, 0.4))


def test_only_the_near_side_is_seen_so_the_network_knows_how_far_away_the_middle_is() -> None:
    assert place_after(*[lying(2.3, 0.2, WHOLE, ON_THE_FLOOR)] * 3) == pytest.approx((2.3, 0.0), abs=0.04)


@pytest.mark.parametrize(("blanket_ends", "middle"), [((-0.8,), 0.15), ((0.7,), -0.15), ((-0.8, 0.7), 0.0)])
def test_under_a_blanket_the_body_reaches_less_far_towards_its_wide_end(
    blanket_ends: tuple[float, ...], middle: float
) -> None:
    width = np.arange(1.7, 2.4, 0.03)
    ends = [(x, y + dy) for y in blanket_ends for dy in (0.02, 0.08) for x in width]
    points = np.vstack([WHOLE.points, np.array(ends, np.float32)])
    shown = Outline(points, np.zeros(len(points), bool))
    assert place_after(*[lying(2.0, 0.2, shown)] * 3) == pytest.approx((2.0, middle), abs=0.04)


def test_a_stray_point_is_not_the_end_of_a_body() -> None:
    stray = Outline(np.vstack([WHOLE.points, [[2.0, 1.9]]]), np.append(WHOLE.goes_on, False))
    votes = [lying(2.0, 0.2, shown, ON_THE_FLOOR) for shown in (WHOLE, WHOLE, stray)]
    assert place_after(*votes) == pytest.approx((2.0, 0.0), abs=0.04)


def test_it_moves_with_the_frame() -> None:
    robot = Pose2(1.0, 2.0, np.pi / 2)
    votes = [lying(2.0, 0.2, WHOLE, ON_THE_FLOOR).moved_by(robot)] * 3
    assert place_after(*votes) == pytest.approx(robot.apply(2.0, 0.0), abs=0.05)


def test_who_is_seen_near_where_somebody_lies_is_they_and_further_away_it_is_somebody_else() -> None:
    places = LyingBodies()
    first = places.near(lying(2.0), 0.0)
    first.take(lying(2.0))
    assert places.near(lying(2.45), 0.0) is first
    beside = lying(2.0, y=1.4, shown=outline(0.6, 2.2))
    other = places.near(beside, 0.0)
    other.take(beside)
    assert other is not first and other.place == pytest.approx((2.0, 1.4))
    assert places.near(lying(2.0), 0.0) is first


def test_a_part_of_somebody_is_not_somebody_else_whatever_middle_it_says() -> None:
    places = LyingBodies()
    first = places.near(lying(2.0, height=ON_THE_FLOOR), 0.0)
    for _ in range(2):
        first.take(lying(2.0, height=ON_THE_FLOOR))
    head = lying(2.0, 0.6, outline(0.3, 0.8, cut_at=0.3), ON_THE_FLOOR)
    for _ in range(9):
        part = places.near(head, 0.0)
        part.take(head)
    assert part is first and part.place == pytest.approx((2.0, 0.0), abs=0.05)
    assert places.near(lying(2.0, 0.6, shown=None), 0.0) is not first


def test_a_body_with_two_middles_is_where_the_whole_was_seen() -> None:
    tracker = UserTracker()
    tracker.start()
    for k in range(6):
        tracker.update(0.2 * k, [lying(2.0)])
    tracker.start()
    for k in range(6, 12):
        users = tracker.update(0.2 * k, [lying(2.45, shown=CUT), lying(1.95, shown=CUT)])
    assert [user.x for user in users] == pytest.approx([2.0, 2.0], abs=0.1)


def test_the_tracker_tells_the_better_place_and_of_who_stands_up_the_newest() -> None:
    tracker = UserTracker()
    tracker.start()
    views = [*[lying(2.0)] * 6, *[lying(2.2, shown=CUT)] * 6]
    for k, view in enumerate(views):
        users = tracker.update(0.2 * k, [view])
    assert users[0].x == pytest.approx(2.02, abs=0.02) and users[0].vx == 0.0
    for k in range(12, 24):
        users = tracker.update(0.2 * k, [replace(lying(2.3), posture="standing")])
    assert users[0].x == pytest.approx(2.3, abs=0.05)


def test_who_lay_there_an_hour_ago_does_not_move_who_lies_there_now() -> None:
    tracker = UserTracker()
    for begin, x, pictures in ((0.0, 2.0, 60), (3600.0, 2.4, 8)):
        tracker.start()
        for k in range(pictures):
            users = tracker.update(begin + 0.2 * k, [lying(x)])
    assert [user.x for user in users] == pytest.approx([2.4], abs=0.05)
