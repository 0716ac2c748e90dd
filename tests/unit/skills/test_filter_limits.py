"""The filters' numbers at their limits: feet, overhangs, legs, what walks, and how a filter rests."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.skills.filters.depth_to_laser._kernels import nearest_per_beam, what_hangs_over, without_feet
from florence_bt.skills.filters.depth_to_laser.fake_laser import Throttle, ThrottleParameters
from florence_bt.skills.filters.laser_combinator._kernels import project_beams
from florence_bt.skills.filters.legs.leg_detector import all_legs, legs_near, narrow_things, of_nobody_known
from florence_bt.skills.filters.legs.walking_legs import WalkingLegs
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    BACKLOG_S,
    HELD_UP_S,
    VelocityFilter,
    VelocityFilterParameters,
)

NAN, INF = math.nan, math.inf


def ranges(*values: float) -> NDArray[np.float32]:
    return np.array(values, np.float32)


@pytest.mark.parametrize("k", range(5))
def test_a_foot_is_before_something_tall_at_most_so_many_beams_aside(k: int) -> None:
    """Something tall stands in one beam; what is low is seen in all of them."""
    for at in range(5):
        tall = ranges(*([INF] * 5))
        tall[at] = 1.6
        kept = without_feet(ranges(*([1.4] * 5)), tall, 1, 1.9, 0.3)
        assert math.isnan(kept[k]) is (abs(k - at) <= 1)


@pytest.mark.parametrize(
    ("low", "tall", "kept"),
    [
        (1.4, 1.6, NAN),
        (1.29, 1.6, 1.29),
        (1.31, 1.6, NAN),
        (1.8, 1.6, NAN),
        (INF, 1.6, NAN),
        (INF, 2.21, INF),
        (INF, 2.19, NAN),
        (1.4, NAN, 1.4),
        (1.4, INF, 1.4),
        (NAN, 1.6, NAN),
        (NAN, INF, NAN),
    ],
)
def test_what_is_low_counts_unless_something_tall_is_just_behind(
    low: float, tall: float, kept: float
) -> None:
    found = without_feet(ranges(low), ranges(tall), 2, 1.9, 0.3)
    np.testing.assert_array_equal(found, ranges(kept))


@pytest.mark.parametrize(
    ("above", "below", "kept"),
    [
        (1.5, 2.0, 1.5),
        (1.5, 1.55, INF),
        (1.5, 1.61, 1.5),
        (1.5, 1.0, INF),
        (1.5, NAN, INF),
        (1.5, INF, 1.5),
        (INF, 2.0, INF),
        (1.19, INF, NAN),
        (1.21, INF, 1.21),
        (NAN, 2.0, NAN),
    ],
)
def test_what_is_nearer_above_than_below_hangs_over(above: float, below: float, kept: float) -> None:
    found = what_hangs_over(ranges(above), ranges(below), 1.2, 0.1)
    np.testing.assert_array_equal(found, ranges(kept))


def test_the_nearest_point_of_the_band_counts_in_every_beam() -> None:
    """Two columns fall into the first beam, one into the third, and one into none."""
    depth = np.array([[2.0, 3.0, NAN, 1.0], [1.0, 0.4, INF, 1.0], [0.9, 2.5, 0.0, 1.0]], np.float32)
    rise, per_metre = np.array([0.5, 0.0, -0.5]), np.array([1.0, 2.0, 1.0, 1.0])
    beams = np.array([0, 0, 2, -1])
    for band, seen_first in (((-0.1, 0.1), 1.0), ((-0.5, 0.1), 0.9), ((-9.0, -0.46), 5.0), ((2.0, 3.0), INF)):
        for unseen in (False, True):
            found = nearest_per_beam(
                depth, rise, per_metre, np.full(4, 0.5), beams, band, unseen, np.full(3, np.inf)
            )
            rest = NAN if unseen else INF
            np.testing.assert_array_equal(found, ranges(seen_first, rest, rest))


def test_a_depth_at_the_nearest_that_is_allowed_counts() -> None:
    for nearest, counts in ((1.0, True), (1.0001, False)):
        found = nearest_per_beam(
            np.ones((1, 1), np.float32),
            np.zeros(1),
            np.ones(1),
            np.array([nearest]),
            np.zeros(1, np.int64),
            (0.0, 0.0),
            False,
            np.full(1, np.inf),
        )
        assert bool(np.isfinite(found[0])) is counts


def test_a_hit_covers_the_beams_of_its_width_from_another_place() -> None:
    """A hit 2 m ahead, 0.1 rad wide, from a metre before it: it is twice as wide there."""
    nearest = np.full(41, np.inf)
    rotation, back = np.eye(3), np.array([-1.0, 0.0, 0.0])
    project_beams(np.array([2.0]), np.array([0.0]), 0.05, rotation, back, -1.0, 0.05, nearest)
    assert np.flatnonzero(np.isfinite(nearest)).tolist() == [18, 19, 20, 21, 22]
    assert nearest[20] == pytest.approx(1.0)
    project_beams(np.array([3.0, 1.5]), np.array([0.0, 0.0]), 0.0, rotation, back, -1.0, 0.05, nearest)
    assert nearest[[19, 20, 21]] == pytest.approx([1.0, 0.5, 1.0]), "the nearest of all"


def test_hits_outside_of_the_grid_and_behind_the_robot_do_no_harm() -> None:
    nearest = np.full(11, np.inf)
    still = np.eye(3), np.zeros(3)
    project_beams(np.array([2.0, 2.0]), np.array([math.pi, -1.2]), 0.05, *still, -0.5, 0.1, nearest)
    assert not np.isfinite(nearest).any()
    project_beams(np.array([2.0]), np.array([0.52]), 0.1, *still, -0.5, 0.1, nearest)
    assert np.flatnonzero(np.isfinite(nearest)).tolist() == [9, 10]
    round_it = np.full(63, np.inf)
    project_beams(np.array([2.0]), np.array([math.pi - 0.01]), 0.05, *still, -math.pi, 0.1, round_it)
    assert np.flatnonzero(np.isfinite(round_it)).tolist() == [62], "an arc across pi stays short"


# ---- legs ----------------------------------------------------------------------------------------------


def leg(x: float, y: float, width: float = 0.1, count: int = 5) -> NDArray[np.float64]:
    return np.column_stack([np.full(count, x), y + np.linspace(-width / 2, width / 2, count)])


def test_legs_are_where_they_are_expected_a_little_behind_what_the_laser_sees() -> None:
    found = legs_near(leg(2.0, 0.0), Pose2(), (2.0, 0.0))
    assert found == pytest.approx((2.06, 0.0))
    for expected, near in (
        ((2.0, 0.39), True),
        ((2.0, 0.46), False),
        ((2.35, 0.0), True),
        ((2.41, 0.0), False),
    ):
        assert (legs_near(leg(2.0, 0.0), Pose2(), expected) is not None) is near
    assert legs_near(leg(2.0, 0.0, count=2), Pose2(), (2.0, 0.0)) is None, "too few points"
    assert legs_near(leg(2.0, 0.0, count=3), Pose2(), (2.0, 0.0)) is not None
    assert legs_near(leg(2.0, 0.0, width=0.59), Pose2(), (2.0, 0.0)) is not None
    assert legs_near(leg(2.0, 0.0, width=0.62), Pose2(), (2.0, 0.0)) is None, "too wide"
    turned = legs_near(leg(0.0, 0.0), Pose2(0.0, 1.0), (0.0, 0.0))
    assert turned == pytest.approx((0.0, -0.06))
    at_the_robot = legs_near(leg(0.0, 0.0), Pose2(), (0.0, 0.0))
    assert at_the_robot == pytest.approx((0.0, 0.0))


def test_what_is_narrow_and_apart_from_the_rest_may_be_legs() -> None:
    wall = leg(3.0, 0.0, width=2.0, count=40)
    scan = np.concatenate(
        [leg(2.0, -1.0), leg(2.0, -0.7), wall, leg(1.0, 1.5, count=2), leg(1.0, 2.5, count=3)]
    )
    assert all_legs(scan) == [
        pytest.approx((2.0, -1.0)),
        pytest.approx((2.0, -0.7)),
        pytest.approx((1.0, 2.5)),
    ]
    assert len(narrow_things(scan)) == 13
    together = np.concatenate([leg(2.0, 0.0), leg(2.0, 0.24)])
    assert all_legs(together) == [pytest.approx((2.0, 0.12))], "points 0.14 m apart are one thing"
    assert all_legs(np.empty((0, 2))) == [] and narrow_things(np.empty((0, 2))).shape == (0, 2)


def test_legs_of_somebody_whom_the_camera_sees_are_of_nobody_else() -> None:
    legs = [(2.0, 0.0), (2.0, 1.0), (2.0, 0.41)]
    assert of_nobody_known(legs, [(2.0, 0.0)]) == [(2.0, 1.0), (2.0, 0.41)]
    assert of_nobody_known(legs, []) == legs
    assert of_nobody_known(legs, [(2.0, 0.6), (2.0, 1.39)]) == [(2.0, 0.0)]


def walked(*places: tuple[float, float]) -> bool:
    """Whether legs that were at some places at some moments walk."""
    legs = WalkingLegs()
    for stamp, x in places:
        legs.saw(stamp, [(x, 0.0)])
    return bool(legs.places(places[-1][0]))


def test_who_goes_a_quarter_of_a_metre_in_one_and_a_half_seconds_walks() -> None:
    assert walked((0.0, 0.0), (0.4, 0.13), (0.8, 0.26))
    assert not walked((0.0, 0.0), (0.4, 0.12), (0.8, 0.24))
    assert not walked((0.0, 0.0), (0.4, 0.09), (0.8, 0.26)), "less than 0.1 m in the first half"
    assert not walked((0.0, 0.0), (0.4, 0.17), (0.8, 0.26)), "or in the second one"
    assert walked((0.0, 0.0), (0.5, 0.13), (1.0, 0.26), (1.5, 0.39))
    assert not walked((0.0, 0.0), (0.45, 0.1), (0.9, 0.2), (1.35, 0.2), (1.8, 0.2), (2.2, 0.2)), (
        "that was before"
    )


def test_legs_go_no_further_than_a_step_and_are_lost_after_half_a_second() -> None:
    assert walked((0.0, 0.0), (0.2, 0.3), (0.4, 0.6))
    assert not walked((0.0, 0.0), (0.2, 0.31), (0.4, 0.62)), "those are others each time"
    assert not walked((0.0, 0.0), (0.51, 0.2), (1.02, 0.4)), "and so are those, after so long"
    legs = WalkingLegs()
    for stamp, x in ((0.0, 0.0), (0.3, 0.2), (0.6, 0.4)):
        legs.saw(stamp, [(x, 0.0)])
    assert legs.places(0.6) == [(0.4, 0.0)]
    assert legs.places(0.7) == [], "they are not in that scan"
    legs.reject((0.4, 0.31))
    assert legs.places(0.6) == [(0.4, 0.0)]
    legs.reject((0.4, 0.29))
    assert legs.places(0.6) == []


# ---- the velocity filter -------------------------------------------------------------------------------


def steps(limits: VelocityFilter, begin: float, count: int) -> list[bool]:
    """Take steps; whether the filter was idle after each."""
    found = []
    for number in range(count):
        limits.step(begin + 0.02 * number)
        found.append(limits.idle)
    return found


def test_a_filter_rests_after_so_many_zeros_and_a_command_wakes_it() -> None:
    limits = VelocityFilter(VelocityFilterParameters(idle_after=0.1))
    assert steps(limits, 0.0, 6) == [False] * 4 + [True] * 2
    limits.command(Twist2(0.0, 0.0), 0.2)
    assert not limits.idle
    assert steps(limits, 0.2, 5) == [False] * 4 + [True]
    limits.hard_stop()
    assert not limits.idle
    assert steps(limits, 0.3, 5) == [False] * 4 + [True]
    for never in (0.0, 0.009):
        assert not any(steps(VelocityFilter(VelocityFilterParameters(idle_after=never)), 0.0, 100))


def test_a_step_is_held_up_from_a_second_on_and_commands_wait_a_moment_then() -> None:
    for late, held_up in ((HELD_UP_S - 0.01, False), (HELD_UP_S, True)):
        limits = VelocityFilter(VelocityFilterParameters(command_timeout=9.0))
        limits.command(Twist2(0.5, 0.0), 0.0)
        steps(limits, 0.0, 10)
        assert limits.command(Twist2(0.5, 0.0), 0.18 + late) is not held_up
        # A held-up filter begins anew at standstill; any other goes on from where it was.
        assert limits.step(0.18 + late).linear == pytest.approx(0.02 if held_up else 0.22)
        if held_up:
            assert not limits.command(Twist2(0.5, 0.0), 0.18 + late + BACKLOG_S - 0.001)
            assert limits.command(Twist2(0.5, 0.0), 0.18 + late + BACKLOG_S)


def test_a_filter_that_rests_is_not_held_up() -> None:
    limits = VelocityFilter()
    steps(limits, 0.0, 51)
    assert limits.idle
    assert limits.command(Twist2(0.5, 0.0), 500.0)


def test_a_command_is_too_old_at_its_time_out() -> None:
    for age, counts in ((0.24, True), (0.25, False)):
        limits = VelocityFilter()
        limits.command(Twist2(0.5, 0.0), 0.0)
        assert (limits.step(age).linear > 0.0) is counts


def test_pictures_pass_a_throttle_a_tenth_of_a_period_early_and_after_a_jump_back() -> None:
    throttle = Throttle(ThrottleParameters(max_rate=10.0))
    assert [throttle.admits(stamp) for stamp in (5.0, 5.085, 5.095, 5.18, 5.19, 2.0, 2.05, 2.1)] == [
        True, False, True, False, True, True, False, True,
    ]  # fmt: skip
