"""The path that somebody walked."""

from __future__ import annotations

import pytest

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate.person_trail import PersonTrail


def walked(*places: Point2) -> PersonTrail:
    path = PersonTrail()
    for number, place in enumerate(places):
        path.saw(0.2 * number, place)
    return path


def test_the_way_ahead_begins_at_the_robot_and_its_end_comes_first() -> None:
    path = walked((0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.4))
    assert path.ahead((0.6, 0.1), (1.0, 0.5)) == [
        ((1.0, 0.5), 0.0),
        ((1.0, 0.4), pytest.approx(0.1)),
        ((1.0, 0.0), pytest.approx(0.5)),
    ]
    assert path.ahead((-0.3, 0.0), (1.0, 0.5))[-1] == ((0.0, 0.0), pytest.approx(1.5)), "not there yet"


def test_the_last_places_are_those_round_the_last_one() -> None:
    assert walked((0.0, 0.0), (0.5, 0.0), (1.0, 0.0)).last(0.6) == [(0.5, 0.0), (1.0, 0.0)]
    assert PersonTrail().last(0.6) == []


def test_who_sways_makes_no_path() -> None:
    path = walked((0.0, 0.0), (0.05, 0.0), (0.0, 0.06), (0.3, 0.0))
    assert [place for place, _ in path.ahead((0.0, 0.0), (0.3, 0.0))] == [(0.3, 0.0), (0.3, 0.0), (0.0, 0.0)]


def test_across_a_gap_nobody_knows_the_way() -> None:
    path = walked((0.0, 0.0), (0.5, 0.0), (1.2, 0.0), (1.4, 0.0))
    assert [place for place, _ in path.ahead((0.0, 0.0), (1.4, 0.0))][1:] == [(1.4, 0.0), (1.2, 0.0)]


def test_without_a_path_they_are_where_they_are() -> None:
    assert PersonTrail().ahead((0.0, 0.0), (1.0, 0.0)) == [((1.0, 0.0), 0.0)]


def test_where_they_were_since_a_time() -> None:
    path = walked((0.0, 0.0), (0.2, 0.0), (0.4, 0.0), (0.6, 0.0))
    assert path.since(0.4) == [(0.4, 0.0), (0.6, 0.0)]
    assert path.since(0.7) == []
