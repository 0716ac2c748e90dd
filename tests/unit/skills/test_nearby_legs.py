"""What a robot that has lost somebody looks at nearby."""

from __future__ import annotations

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate.nearby_legs import NearbyLegs

HERE = Pose2()
AHEAD, BESIDE, FAR = (1.0, 0.1), (0.0, 0.8), (0.5, 2.0)


def test_the_nearest_is_looked_at_first_and_what_is_far_not_at_all() -> None:
    assert NearbyLegs().next(0.0, HERE, [AHEAD, BESIDE, FAR]) == BESIDE
    assert NearbyLegs().next(0.0, HERE, [FAR]) is None


def seconds_looked_at(place: tuple[float, float]) -> float:
    """For how long a thing at a place is looked at, before it is left for good."""
    nearby = NearbyLegs()
    looked = [nearby.next(0.1 * k, HERE, [place]) for k in range(200)]
    count = sum(each == place for each in looked)
    assert looked == [place] * count + [None] * (200 - count)
    return 0.1 * count


def test_what_was_looked_at_is_known_and_not_looked_at_again() -> None:
    assert 0.5 <= seconds_looked_at(AHEAD) <= 2.0, "time enough for some images"


@pytest.mark.parametrize("place", [BESIDE, (0.4, 0.0)])
def test_beside_the_picture_or_too_near_it_is_not_seen_and_left_later(place: tuple[float, float]) -> None:
    assert 2.0 * seconds_looked_at(AHEAD) < seconds_looked_at(place) < 15.0


def test_it_tells_when_it_chose_what_is_looked_at() -> None:
    nearby = NearbyLegs()
    chosen = []
    for k in range(20):
        nearby.next(0.1 * k, HERE, [AHEAD, BESIDE][: 1 + (k > 14)])
        chosen.append(nearby.since)
    assert sorted(set(chosen)) == pytest.approx([0.0, 1.5])


def test_legs_that_walk_are_followed_and_are_new_where_they_were_not_seen() -> None:
    nearby = NearbyLegs()
    for k in range(20):
        assert nearby.next(0.1 * k, HERE, [(0.9 - 0.08 * k, 0.6)]) == (pytest.approx(0.9 - 0.08 * k), 0.6)
