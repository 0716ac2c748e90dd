"""Which legs in the laser's scans walk."""

from __future__ import annotations

import pytest

from florence_bt.skills.filters.legs.walking_legs import WalkingLegs

CHAIR = (2.0, 1.0)


def test_what_walks_is_told_from_what_stands() -> None:
    legs = WalkingLegs()
    for k in range(6):
        legs.saw(0.2 * k, [CHAIR, (1.0 + 0.08 * k, 0.0)])
    assert legs.places(1.0) == [(pytest.approx(1.4), 0.0)]


def test_what_sways_stands() -> None:
    legs = WalkingLegs()
    for k in range(20):
        legs.saw(0.2 * k, [(2.0 + 0.1 * (k % 2), 1.0)])
        assert legs.places(0.2 * k) == []


def test_what_jumps_once_stands() -> None:
    legs = WalkingLegs()
    for k in range(10):
        legs.saw(0.2 * k, [(2.0 if k < 4 else 2.28, 1.0)])
        assert legs.places(0.2 * k) == []


def test_who_stops_stands_again() -> None:
    legs = WalkingLegs()
    for k in range(16):
        legs.saw(0.2 * k, [(min(0.5, 0.08 * k), 0.0)])
    assert legs.places(3.0) == []


def test_legs_that_were_hidden_for_long_begin_anew() -> None:
    legs = WalkingLegs()
    legs.saw(0.0, [(1.0, 0.0)])
    legs.saw(1.0, [(1.28, 0.0)])
    assert legs.places(1.0) == []


def test_two_who_meet_are_each_followed_by_the_shortest_step() -> None:
    legs = WalkingLegs()
    for k in range(6):
        legs.saw(0.2 * k, [(0.1 * k, 0.0), (0.6 - 0.1 * k, 0.25)])
    assert sorted(legs.places(1.0)) == [(pytest.approx(0.1), 0.25), (pytest.approx(0.5), 0.0)]


def test_rejected_legs_are_not_told_again() -> None:
    legs = WalkingLegs()
    for k in range(6):
        legs.saw(0.2 * k, [(0.1 * k, 0.0)])
    legs.reject((0.5, 0.0))
    legs.saw(1.2, [(0.6, 0.0)])
    assert legs.places(1.2) == []
