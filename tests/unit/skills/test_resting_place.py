"""Where somebody lies, of whom the camera sees more and then less."""

from __future__ import annotations

from dataclasses import replace

import pytest

from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Region
from florence_bt.skills.people.user_tracker.resting_place import RestingPlace, RestingPlaces
from florence_bt.skills.people.user_tracker.tracker import UserTracker

WHOLE, CUT = Region(0.2, 0.5, 0.8, 0.9), Region(0.0, 0.5, 0.6, 0.9)


def lying(x: float, region: Region | None = WHOLE, y: float = 0.0) -> Detection:
    return Detection(x, y, x, 0.95, posture="lying", height=0.25, region=region)


def place_after(*detections: Detection) -> tuple[float, float] | None:
    resting = RestingPlace()
    for each in detections:
        resting.take(each)
    return resting.place


def test_pictures_of_the_whole_body_count_most() -> None:
    seen = place_after(*[lying(2.0)] * 3, *[lying(2.3, CUT)] * 6)
    assert seen is not None and seen[0] == pytest.approx(2.03, abs=0.02)
    assert place_after(lying(2.0), lying(2.2), lying(2.2, None)) == pytest.approx((2.133, 0.0), abs=0.01)


@pytest.mark.parametrize("region", [Region(0.4, 0.5, 1.0, 0.9), Region(0.4, 0.5, 0.7, 1.0)])
def test_a_body_may_go_on_beyond_each_edge(region: Region) -> None:
    assert place_after(lying(2.0), lying(2.3, region)) == pytest.approx((2.02, 0.0), abs=0.01)


def test_who_is_seen_near_where_somebody_lies_is_they_and_further_away_it_is_somebody_else() -> None:
    places = RestingPlaces()
    first = places.near(lying(2.0))
    first.take(lying(2.0))
    assert places.near(lying(2.45)) is first
    other = places.near(lying(2.0, y=0.6))
    other.take(lying(2.0, y=0.6))
    assert other is not first and other.place == (2.0, 0.6)
    assert places.near(lying(2.0)) is first


def test_a_body_with_two_middles_is_where_the_whole_was_seen() -> None:
    tracker = UserTracker()
    tracker.start(0.0)
    for k in range(6):
        tracker.update(0.2 * k, [lying(2.0)])
    tracker.start(1.2)
    for k in range(6, 12):
        users = tracker.update(0.2 * k, [lying(2.45, CUT), lying(1.95, CUT)])
    assert [user.x for user in users] == pytest.approx([2.0, 2.0], abs=0.1)


def test_the_tracker_tells_the_better_place_and_of_who_stands_up_the_newest() -> None:
    tracker = UserTracker()
    tracker.start(0.0)
    views = [*[lying(2.0)] * 6, *[lying(2.2, CUT)] * 6]
    for k, view in enumerate(views):
        users = tracker.update(0.2 * k, [view])
    assert users[0].x == pytest.approx(2.02, abs=0.02) and users[0].vx == 0.0
    for k in range(12, 24):
        users = tracker.update(0.2 * k, [replace(lying(2.3), posture="standing")])
    assert users[0].x == pytest.approx(2.3, abs=0.05)
