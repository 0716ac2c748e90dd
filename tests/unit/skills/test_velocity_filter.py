"""The velocity filter, tick by tick, and its ticker on a manual clock."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    HELD_UP_S,
    VelocityFilter,
    VelocityFilterParameters,
    VelocityTicker,
)

PERIOD = 0.02


def run(velocity_filter: VelocityFilter, start: float, ticks: int) -> list[Twist2]:
    return [velocity_filter.step(start + PERIOD * tick) for tick in range(ticks)]


def test_vector_up_to_half_a_metre_per_second_in_25_ticks():
    velocity_filter = VelocityFilter(VelocityFilterParameters(command_timeout=1.0))
    velocity_filter.command(Twist2(0.5, 0.0), 0.0)
    speeds = [twist.linear for twist in run(velocity_filter, 0.0, 26)]
    assert speeds[:25] == pytest.approx([0.02 * tick for tick in range(1, 26)])
    assert speeds[24:] == [0.5, 0.5]


def test_vector_of_the_document_down_after_one_second_of_silence():
    # Commanded at 0: up to 0.98 s nothing changes, the tick at 1.00 s is the first one down, 25 of them.
    velocity_filter = VelocityFilter(VelocityFilterParameters(command_timeout=1.0, max_linear_braking=1.0))
    velocity_filter.command(Twist2(0.5, 0.0), 0.0)
    speeds = [twist.linear for twist in run(velocity_filter, 0.0, 80)]
    assert speeds[49] == 0.5
    assert speeds[50:75] == pytest.approx([0.5 - 0.02 * tick for tick in range(1, 26)], abs=1e-9)
    assert speeds[73] > 0.0
    assert speeds[74:] == [0.0] * 6


@pytest.mark.parametrize("command", [Twist2(0.45, 0.0), Twist2(-0.3, -0.6), Twist2(0.0, 0.6)])
def test_the_robot_stands_half_a_second_after_its_commands_have_ceased(command):
    velocity_filter = VelocityFilter()
    for tick in range(0, 100, 5):
        velocity_filter.command(command, PERIOD * tick)
        last = run(velocity_filter, PERIOD * tick, 5)[-1]
    assert last == command
    twists = run(velocity_filter, PERIOD * 100, 25)  # the last command is 0.1 s old
    assert STANDSTILL in twists[:20] and twists[-1] == STANDSTILL


def test_a_command_to_stand_still_brakes_harder_than_a_slower_one():
    speeds = []
    for wanted in (Twist2(0.1, 0.0), STANDSTILL):
        velocity_filter = VelocityFilter()
        velocity_filter.command(Twist2(0.4, 0.0), 0.0)
        run(velocity_filter, 0.0, 12)
        velocity_filter.command(wanted, 0.24)
        before = velocity_filter.output.linear
        speeds.append(before - velocity_filter.step(0.24).linear)
    assert speeds == pytest.approx([1.0 * PERIOD, 2.5 * PERIOD])


def test_a_filter_that_was_held_up_goes_on_from_standstill():
    """The base was stopped past it; it must not be told the speed of before, not even of braking."""
    velocity_filter = VelocityFilter()
    velocity_filter.command(Twist2(0.4, 0.5), 0.0)
    run(velocity_filter, 0.0, 30)
    assert velocity_filter.step(0.58 + HELD_UP_S) == STANDSTILL
    velocity_filter.command(Twist2(0.4, 0.0), 1.6)
    assert velocity_filter.step(1.6).linear == pytest.approx(0.02)


def test_turning_has_its_own_limit_and_needs_75_ticks():
    velocity_filter = VelocityFilter(VelocityFilterParameters(max_linear_acc=0.5, command_timeout=9.0))
    velocity_filter.command(Twist2(-0.5, 1.5), 0.0)
    twists = run(velocity_filter, 0.0, 75)
    assert twists[0] == Twist2(-0.01, 0.02)
    assert twists[73].angular < 1.5
    assert twists[74].angular == 1.5
    assert twists[49].linear == -0.5


def test_through_zero_without_a_jump():
    velocity_filter = VelocityFilter(VelocityFilterParameters(command_timeout=9.0))
    velocity_filter.command(Twist2(0.3, 0.0), 0.0)
    run(velocity_filter, 0.0, 15)
    velocity_filter.command(Twist2(-0.3, 0.0), 0.3)
    speeds = [twist.linear for twist in run(velocity_filter, 0.3, 30)]
    assert speeds[-1] == -0.3
    assert max(abs(b - a) for a, b in zip([0.3, *speeds], speeds, strict=False)) <= 0.02 + 1e-12


@pytest.mark.parametrize("bad", [Twist2(math.nan, 0.0), Twist2(0.1, math.inf), Twist2(-math.inf, math.nan)])
def test_numbers_that_are_not_finite_are_refused_and_counted(bad):
    velocity_filter = VelocityFilter()
    velocity_filter.command(Twist2(0.2, 0.0), 0.0)
    run(velocity_filter, 0.0, 10)
    assert not velocity_filter.command(bad, 0.24)
    assert velocity_filter.rejected == 1
    assert velocity_filter.output == Twist2(0.2, 0.0)
    # The refused command did not keep the old one alive.
    assert velocity_filter.step(0.25).linear == pytest.approx(0.15)


@pytest.mark.parametrize("first", ["the command", "the step"])
def test_a_command_that_waited_for_a_process_that_was_held_up_does_not_count(first):
    """The person, or navigation, may have sent it long ago."""
    velocity_filter = VelocityFilter()
    velocity_filter.command(Twist2(0.4, 0.0), 0.0)
    run(velocity_filter, 0.0, 10)
    if first == "the step":
        velocity_filter.step(5.0)
    assert not velocity_filter.command(Twist2(0.4, 0.0), 5.001)
    assert velocity_filter.step(5.002) == STANDSTILL
    assert velocity_filter.command(Twist2(0.4, 0.0), 5.02)
    assert velocity_filter.step(5.02).linear == pytest.approx(0.02)


def test_hard_stop_is_at_once_and_holds_until_a_command_after_the_release():
    velocity_filter = VelocityFilter()
    velocity_filter.command(Twist2(0.5, 1.0), 0.0)
    run(velocity_filter, 0.0, 20)
    velocity_filter.hard_stop()
    assert velocity_filter.output == STANDSTILL
    assert not velocity_filter.command(Twist2(0.5, 1.0), 0.41)
    assert velocity_filter.step(0.42) == STANDSTILL
    velocity_filter.release()
    assert velocity_filter.step(0.44) == STANDSTILL
    assert velocity_filter.command(Twist2(0.5, 1.0), 0.45)
    assert velocity_filter.step(0.46).linear == pytest.approx(0.02)


def test_a_clock_that_was_set_back_stops_the_robot():
    velocity_filter = VelocityFilter()
    velocity_filter.command(Twist2(0.02, 0.0), 1000.0)
    assert velocity_filter.step(1000.0).linear == 0.02
    assert velocity_filter.step(1.0).linear == 0.0


@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-3, 3), st.integers(1, 20)), max_size=12),
    st.floats(0.1, 3.0),
    st.floats(0.1, 3.0),
)
def test_the_acceleration_never_exceeds_its_limit(commands, linear_acc, angular_acc):
    velocity_filter = VelocityFilter(
        VelocityFilterParameters(linear_acc, angular_acc, linear_acc, angular_acc)
    )
    now, before = 0.0, STANDSTILL
    for linear, angular, ticks in commands:
        velocity_filter.command(Twist2(linear, angular), now)
        for _ in range(ticks):
            now += PERIOD
            after = velocity_filter.step(now)
            assert abs(after.linear - before.linear) <= linear_acc * PERIOD * (1 + 1e-6)
            assert abs(after.angular - before.angular) <= angular_acc * PERIOD * (1 + 1e-6)
            before = after


@pytest.mark.parametrize(
    "wrong",
    [{"max_linear_acc": 0.0}, {"publishing_rate": -1.0}, {"command_timeout": math.nan}, {"idle_after": -1.0}],
)
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(ConfigError, match=f"{next(iter(wrong))}.*would have worked"):
        VelocityFilterParameters(**wrong)


class Base:
    """Remembers what was published, and when."""

    def __init__(self, **parameters) -> None:
        self.clock = ManualClock(100.0)
        self.heard: list[tuple[float, Twist2]] = []
        self.ticker = VelocityTicker(self.clock, self.hear, VelocityFilterParameters(**parameters))

    def hear(self, twist: Twist2) -> None:
        self.heard.append((self.clock.now(), twist))


def test_ticker_is_silent_until_the_first_command():
    base = Base()
    base.clock.advance(5.0)
    assert base.heard == []
    assert base.clock.next_time() is None


def test_ticker_publishes_from_the_start_when_asked_to():
    base = Base(silent_until_command=False, idle_after=0.0)
    base.clock.advance(5.0)
    assert len(base.heard) == 251
    assert base.ticker.running


def test_ticker_answers_a_command_at_50_hz_and_rests_after_standstill():
    base = Base()
    base.ticker.command(Twist2(0.1, 0.0))
    base.clock.advance(0.1)
    assert [twist.linear for _, twist in base.heard] == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1, 0.1])
    base.clock.advance(10.0)
    # Silence 0.25 s, 2 ticks down, 1.0 s of zeros, then nothing.
    assert 101.2 < base.heard[-1][0] < 101.4
    assert base.heard[-1][1] == STANDSTILL
    assert base.clock.next_time() is None
    base.ticker.command(Twist2(0.1, 0.0))
    base.clock.advance(0.0)
    assert base.heard[-1][1].linear == pytest.approx(0.02)


def test_ticker_never_leaves_a_gap_that_the_base_would_notice_while_moving():
    base = Base()
    for _ in range(12):
        base.ticker.command(Twist2(0.3, 0.2))
        base.clock.advance(0.24)
    times = [time for time, twist in base.heard if not twist.is_zero()]
    assert max(b - a for a, b in pairwise(times)) < 0.6


def test_ticker_publishes_a_hard_stop_without_waiting_for_a_tick():
    base = Base()
    base.ticker.command(Twist2(0.5, 0.0))
    base.clock.advance(0.31)
    base.ticker.hard_stop()
    assert base.heard[-1] == (100.31, STANDSTILL)
    base.ticker.command(Twist2(0.5, 0.0))
    base.clock.advance(3.0)
    assert base.heard[-1][1] == STANDSTILL
    assert not base.ticker.running
    base.ticker.release()
    base.ticker.command(Twist2(0.5, 0.0))
    base.clock.advance(0.02)
    assert base.heard[-1][1].linear > 0.0


def test_ticker_leaves_the_robot_standing():
    base = Base()
    base.ticker.command(Twist2(0.5, 0.0))
    base.clock.advance(0.3)
    base.ticker.close()
    assert base.heard[-1][1] == STANDSTILL
    count = len(base.heard)
    assert not base.ticker.command(Twist2(0.5, 0.0))
    base.clock.advance(3.0)
    assert len(base.heard) == count
