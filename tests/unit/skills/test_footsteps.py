"""The way that somebody walked."""

from __future__ import annotations

import pytest

from florence_bt.skills.navigation.navigate.footsteps import Footsteps

Place = tuple[float, float]


def walked(*places: Place) -> Footsteps:
    steps = Footsteps()
    for number, place in enumerate(places):
        steps.saw(0.2 * number, place)
    return steps


def test_the_way_ahead_begins_at_the_robot_and_its_end_comes_first() -> None:
    steps = walked((0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.4))
    assert steps.ahead((0.6, 0.1), (1.0, 0.5)) == [
        ((1.0, 0.5), 0.0),
        ((1.0, 0.4), pytest.approx(0.1)),
        ((1.0, 0.0), pytest.approx(0.5)),
    ]
    assert steps.ahead((-0.3, 0.0), (1.0, 0.5))[-1] == ((0.0, 0.0), pytest.approx(1.5)), "not there yet"


def test_the_last_places_are_those_round_the_last_one() -> None:
    assert walked((0.0, 0.0), (0.5, 0.0), (1.0, 0.0)).last(0.6) == [(0.5, 0.0), (1.0, 0.0)]
    assert Footsteps().last(0.6) == []


def test_who_sways_makes_no_steps() -> None:
    steps = walked((0.0, 0.0), (0.05, 0.0), (0.0, 0.06), (0.3, 0.0))
    assert [place for place, _ in steps.ahead((0.0, 0.0), (0.3, 0.0))] == [(0.3, 0.0), (0.3, 0.0), (0.0, 0.0)]


def test_across_a_gap_nobody_knows_the_way() -> None:
    steps = walked((0.0, 0.0), (0.5, 0.0), (1.2, 0.0), (1.4, 0.0))
    assert [place for place, _ in steps.ahead((0.0, 0.0), (1.4, 0.0))][1:] == [(1.4, 0.0), (1.2, 0.0)]


def test_what_was_somebody_else_is_forgotten() -> None:
    steps = walked((0.0, 0.0), (0.2, 0.0), (0.4, 0.0), (0.6, 0.0))
    steps.forget_since(0.2)
    assert [place for place, _ in steps.ahead((0.0, 0.0), (0.2, 0.0))][1:] == [(0.2, 0.0), (0.0, 0.0)]
    assert Footsteps().ahead((0.0, 0.0), (1.0, 0.0)) == [((1.0, 0.0), 0.0)]
