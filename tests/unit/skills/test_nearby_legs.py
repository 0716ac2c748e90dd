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


def test_what_was_looked_at_is_known_and_not_looked_at_again() -> None:
    nearby = NearbyLegs()
    seen = [nearby.next(0.1 * k, HERE, [AHEAD]) for k in range(30)]
    assert seen[:10] == [AHEAD] * 10
    assert seen[12:] == [None] * 18


def test_beside_the_picture_or_too_near_it_is_not_seen() -> None:
    for place in (BESIDE, (0.4, 0.0)):
        nearby = NearbyLegs()
        assert {nearby.next(0.1 * k, HERE, [place]) for k in range(40)} == {place}


def test_what_cannot_be_looked_at_is_left_after_some_seconds() -> None:
    nearby = NearbyLegs()
    assert [nearby.next(0.1 * k, HERE, [BESIDE]) for k in range(80)][55:] == [None] * 25


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
