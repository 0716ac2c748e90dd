"""The count of id switches of two people who cross each other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import pytest

from florence_bt.core.sensing import TrackedUser
from florence_bt.simulation.home.walker import Walker
from tools.crossing import FIRST_SEED, Identities, Judged, encounter, report

HERE, THERE = (1.0, 0.0), (2.0, 0.0)


def user(user_id: int, at: tuple[float, float]) -> TrackedUser:
    return TrackedUser(user_id, user_id, *at, 1.0)


@pytest.mark.parametrize(
    ("later", "switches"),
    [
        ([user(1, HERE), user(2, THERE)], 0),
        ([user(1, HERE)], 0),
        ([user(1, HERE), user(3, THERE)], 1),
        ([user(2, HERE), user(1, THERE)], 2),
        ([user(1, (1.0, 0.6)), user(2, THERE)], 0),
    ],
)
def test_a_switch_is_another_id_of_a_person_or_another_person_of_an_id(
    later: Sequence[TrackedUser], switches: int
) -> None:
    identities = Identities()
    identities.compare((HERE, THERE), [user(1, HERE), user(2, THERE)])
    identities.compare((HERE, THERE), [])
    identities.compare((HERE, THERE), later)
    assert identities.switches == switches


def test_near_each_other_people_keep_the_users_they_had() -> None:
    identities = Identities()
    identities.compare((HERE, THERE), [user(1, HERE), user(2, THERE)])
    close = ((1.4, 0.0), (1.6, 0.0))
    identities.compare(close, [user(1, close[1]), user(2, close[0])])
    identities.compare((HERE, THERE), [user(1, HERE), user(2, THERE)])
    assert identities.switches == 0


def test_the_two_people_never_touch_each_other() -> None:
    given = encounter(FIRST_SEED)
    walkers = [Walker(spec) for spec in given.people]
    for _ in range(300):
        first, second = (walker.advance(0.2, given.robot) for walker in walkers)
        assert math.dist((first.x, first.y), (second.x, second.y)) > 0.45


def test_the_table_has_a_row_for_each_kind_and_their_sum() -> None:
    kinds = itertools.product(
        ("different shirts", "nearly the same shirt", "no colour pictures"), (False, True)
    )
    judged = [Judged(7, shirts, turns, 60.0, 10, 20, 500, 1) for shirts, turns in kinds]
    assert report(judged).splitlines()[-1] == "| all |  | 6 | 60 | 120 | 83 % | 6 |"
