"""Time that only goes forward and never leaps, over a clock that somebody sets."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.ros.elapsed_time import CountedStep, ElapsedTime, machine_step, simulated_step

HOUR_S = 3600.0


class Stepped:
    """A clock that is set by hand, and how much time has passed by it."""

    def __init__(self, counted: CountedStep, told: float = 1000.0, speed: float = 1.0) -> None:
        self.told, self.steady, self._speed = told, 0.0, speed
        self.elapsed = ElapsedTime(counted, told, 0.0)

    def passes(self, seconds: float, step: float = 0.01) -> None:
        for _ in range(round(seconds / step)):
            self.told += step * self._speed
            self.steady += step
            self.elapsed.read(self.told, self.steady)

    def jumps(self, seconds: float) -> float:
        self.told += seconds
        return self.elapsed.read(self.told, self.steady)


@pytest.mark.parametrize("counted", [machine_step, simulated_step])
@pytest.mark.parametrize("seconds", [HOUR_S, -HOUR_S, 1e9, -900.0, 60.0, -60.0])
def test_a_jump_is_no_time(counted: CountedStep, seconds: float) -> None:
    clock = Stepped(counted)
    clock.passes(2.0)
    assert clock.elapsed.offset == 0.0, "without a jump both say the same"
    assert clock.jumps(seconds) == pytest.approx(seconds)
    assert clock.elapsed.now == pytest.approx(1002.0)
    clock.passes(0.4)
    clock.jumps(-seconds)
    clock.passes(1.0)
    assert clock.elapsed.now == pytest.approx(1003.4)
    assert clock.elapsed.offset == pytest.approx(0.0)


@pytest.mark.parametrize("seconds", [0.5, -0.5, 5.0, -5.0])
def test_a_small_jump_of_the_machines_clock_is_no_time_either(seconds: float) -> None:
    clock = Stepped(machine_step)
    clock.passes(1.0)
    clock.jumps(seconds)
    clock.passes(1.0)
    assert clock.elapsed.now == pytest.approx(1002.0)


def test_the_machines_clock_may_be_set_while_nobody_reads_it() -> None:
    clock = Stepped(machine_step)
    clock.steady += 100.0
    assert clock.jumps(100.0 - HOUR_S) == pytest.approx(-HOUR_S)
    assert clock.elapsed.now == pytest.approx(1100.0)


def test_a_clock_that_is_corrected_without_being_set_is_followed() -> None:
    clock = Stepped(machine_step, speed=1.0005)
    clock.passes(1000.0, step=0.5)
    assert clock.elapsed.now == pytest.approx(2000.5)


@pytest.mark.parametrize("speed", [0.0, 0.05, 1.0, 100.0])
def test_a_simulation_stands_still_or_runs_fast(speed: float) -> None:
    clock = Stepped(simulated_step, speed=speed)
    clock.passes(10.0)
    assert clock.elapsed.now == pytest.approx(1000.0 + 10.0 * speed)


def test_a_simulation_is_followed_after_nobody_has_listened_for_long() -> None:
    clock = Stepped(simulated_step)
    clock.passes(600.0, step=600.0)
    assert clock.elapsed.now == pytest.approx(1600.0)


@given(
    st.sampled_from([machine_step, simulated_step]),
    st.lists(st.tuples(st.floats(0.0, 10.0), st.one_of(st.floats(-1e6, 1e6), st.floats(-0.2, 0.2)))),
)
def test_it_never_goes_back_and_never_outruns_the_fastest_simulation(
    counted: CountedStep, readings: list[tuple[float, float]]
) -> None:
    clock, before = Stepped(counted, told=0.0), 0.0
    for passed, jump in readings:
        clock.steady += passed
        clock.jumps(passed + jump)
        limit = max(10.0, 100.0 * passed) if counted is simulated_step else 1.01 * passed + 0.1
        assert -1e-6 <= clock.elapsed.now - before <= limit + 1e-6
        before = clock.elapsed.now
