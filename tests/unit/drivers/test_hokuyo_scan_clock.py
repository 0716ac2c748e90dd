"""The sensor's timer against our clock: wraps, delays, machines that stand still, and clocks that jump."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from florence_bt.drivers.hokuyo.scan_clock import TIMER_MS, ScanClock, timer_difference_ms

JITTER_S = 0.003
CLOSE_S = JITTER_S + 0.0015
"""How far a stamp may be off: the jitter, and the milliseconds of the timer."""


@given(start=st.integers(0, TIMER_MS - 1), passed=st.integers(-(TIMER_MS // 2), TIMER_MS // 2 - 1))
def test_differences_do_not_mind_the_wrap(start: int, passed: int) -> None:
    assert timer_difference_ms((start + passed) % TIMER_MS, start) == passed


@given(
    start=st.integers(0, TIMER_MS - 1),
    delays=st.lists(st.floats(0.0, 0.3), min_size=5, max_size=19),
)
def test_delays_do_not_move_the_stamps(start: int, delays: list[float]) -> None:
    """Even when all of them are the same, as on a line that is slower for a while."""
    clock = ScanClock()
    clock.arrival(start, 10.0, 0.1)
    for turn, delay in enumerate(delays, 1):
        undelayed = 10.0 + 0.1 * turn
        found = clock.arrival((start + 100 * turn) % TIMER_MS, undelayed + delay, 0.1)
        assert found == pytest.approx(undelayed)
        assert clock.late_s == pytest.approx(delay, abs=1e-6)


def test_a_drifting_clock_is_followed() -> None:
    """100 parts in a million: a millisecond in the window of ten seconds."""
    clock = ScanClock()
    worst = 0.0
    for turn in range(20_000):
        arrived = 0.1 * turn
        found = clock.arrival(round(100 * turn * 0.9999) % TIMER_MS, arrived, 0.1)
        worst = max(worst, abs(found - arrived))
    assert worst < 0.003


class Line:
    """A sensor that turns evenly, and a machine that reads it, but not while it stands still."""

    def __init__(
        self,
        *,
        stalls: Sequence[tuple[float, float]] = (),
        turn_s: float = 0.1,
        jitter: Callable[[int], float] = lambda _scan: 0.0,
        overflows: bool = False,
    ) -> None:
        self.clock = ScanClock()
        self.turn_s = turn_s
        self.timer_s = 5000.0
        self.host_s = 0.0
        self.errors: dict[int, float] = {}
        self.prompt: set[int] = set()
        self._stalls = stalls
        self._jitter = jitter
        self._overflows = overflows

    def run(self, first: int, last: int) -> None:
        """Let the scans first..last - 1 come."""
        for scan in range(first, last):
            undelayed = 100.0 + scan * self.turn_s
            arrived, lost = self._arrival(undelayed, scan)
            if lost:
                continue
            stamp_ms = round((self.timer_s + undelayed) * 1000.0) % TIMER_MS
            found = self.clock.arrival(stamp_ms, arrived + self.host_s, self.turn_s)
            self.errors[scan] = found - (undelayed + self.host_s)
            if arrived - undelayed <= JITTER_S + 1e-6:
                self.prompt.add(scan)

    def _arrival(self, undelayed: float, scan: int) -> tuple[float, bool]:
        """When a scan is read, and whether it was lost, as the buffer holds two while nobody reads."""
        for begin, end in self._stalls:
            if begin <= undelayed - 100.0 < end:
                lost = self._overflows and undelayed - 100.0 >= begin + 2.0 * self.turn_s
                return 100.0 + end + self._jitter(scan), lost
        return undelayed + self._jitter(scan), False

    def worst(self, first: int) -> float:
        """The largest error of the scans from this one on."""
        return max(abs(error) for scan, error in self.errors.items() if scan >= first)

    def first_prompt(self, first: int) -> int:
        return min(scan for scan in self.prompt if scan >= first)


@st.composite
def stalls(draw: st.DrawFn, longest: float = 5.0) -> list[tuple[float, float]]:
    """Times at which the machine stands still, with half a second between them."""
    found: list[tuple[float, float]] = []
    begin = 0.35
    for _ in range(draw(st.integers(0, 4))):
        begin += draw(st.floats(0.0, 3.0))
        end = begin + draw(st.floats(0.01, longest))
        found.append((begin, end))
        begin = end + 0.5
    return found


JITTERS = st.lists(st.floats(0.0, JITTER_S), min_size=1, max_size=50).map(
    lambda values: lambda scan: values[scan % len(values)]
)
TURNS = st.sampled_from([0.1, 0.025, 0.2])


@given(stalls=stalls(), jitter=JITTERS, turn_s=TURNS, overflows=st.booleans())
def test_a_machine_that_stands_still_is_no_jump(
    stalls: list[tuple[float, float]], jitter: Callable[[int], float], turn_s: float, overflows: bool
) -> None:
    line = Line(stalls=stalls, jitter=jitter, turn_s=turn_s, overflows=overflows)
    line.run(0, round(30.0 / turn_s))
    assert line.worst(0) < CLOSE_S


@given(
    stalls=stalls(),
    jitter=JITTERS,
    turn_s=TURNS,
    jump_s=st.one_of(st.floats(-1.9, -0.05), st.floats(0.05, 1.9)),
    at_s=st.floats(0.5, 20.0),
)
def test_a_timer_that_jumps_is_noticed_at_once(
    stalls: list[tuple[float, float]],
    jitter: Callable[[int], float],
    turn_s: float,
    jump_s: float,
    at_s: float,
) -> None:
    """The stamps are right from the first scan on that comes without delay, however the machine stalls."""
    line = Line(stalls=stalls, jitter=jitter, turn_s=turn_s)
    at = round(at_s / turn_s)
    line.run(0, at)
    line.timer_s += jump_s
    line.run(at, at + round(25.0 / turn_s))
    assert line.worst(line.first_prompt(at)) < CLOSE_S
    assert all(abs(error) < CLOSE_S for scan, error in line.errors.items() if scan < at)


@pytest.mark.parametrize("jump_s", [0.005, -0.005, -0.019])
def test_a_small_jump_costs_no_more_than_itself(jump_s: float) -> None:
    line = Line()
    line.run(0, 50)
    line.timer_s += jump_s
    line.run(50, 300)
    assert line.worst(50) <= abs(jump_s) + 0.001
    assert line.worst(160) < 0.0015


@given(jump_s=st.floats(-0.9, -0.05), lost=st.integers(1, 20), jitter=JITTERS)
def test_a_timer_that_jumps_while_scans_are_lost(
    jump_s: float, lost: int, jitter: Callable[[int], float]
) -> None:
    """The timer looks as if it went on then; that all scans come as late as the others tells it."""
    line = Line(jitter=jitter)
    line.run(0, 50)
    line.timer_s += jump_s
    line.run(50 + lost, 200)
    assert line.worst(50 + lost + 21) < CLOSE_S


@pytest.mark.parametrize("step_s", [-100.0, -1.0, -0.05, 1.1, 5.0, 1e6])
def test_our_clock_is_set(step_s: float) -> None:
    line = Line()
    line.run(0, 50)
    line.host_s += step_s
    line.run(50, 150)
    assert line.worst(50 if step_s < 0.0 else 54) < 0.002


def test_our_clock_is_set_by_less_than_a_slow_line_explains() -> None:
    line = Line()
    line.run(0, 50)
    line.host_s += 0.3
    line.run(50, 150)
    assert line.errors[60] == pytest.approx(-0.3, abs=0.002)
    assert line.worst(71) < 0.002


@given(behind_s=st.floats(0.05, 0.4), scans=st.integers(1, 30), jitter=JITTERS)
def test_a_simulated_time_that_came_too_late(
    behind_s: float, scans: int, jitter: Callable[[int], float]
) -> None:
    """The bytes overtook it, so scans seemed to come early; soon after that the stamps are right again."""
    line = Line(jitter=jitter)
    line.run(0, 50)
    line.host_s -= behind_s
    line.run(50, 50 + scans)
    line.host_s += behind_s
    line.run(50 + scans, 200)
    assert line.worst(50 + scans + 21) < CLOSE_S


@given(delays=st.lists(st.floats(0.0, 0.5), min_size=30, max_size=100))
def test_a_machine_that_is_always_busy(delays: list[float]) -> None:
    """Delays of any kind in a row, but not all alike: no stamp is later than it should be."""
    assume(
        all(
            max(delays[at : at + 19]) - min(delays[at : at + 19]) > 0.02 or min(delays[at : at + 19]) < 0.02
            for at in range(len(delays) - 18)
        )
    )
    line = Line(jitter=lambda scan: [0.0, *delays][scan])
    line.run(0, min(len(delays), 90))
    assert line.worst(0) < 0.0015


def test_a_frozen_timer_gives_the_moments_of_arrival() -> None:
    clock = ScanClock()
    assert [clock.arrival(77, 10.0 + turn, 0.1) for turn in range(5)] == [10.0, 11.0, 12.0, 13.0, 14.0]


def test_a_slower_motor_and_left_out_turns_are_no_jump() -> None:
    """CR makes a turn longer; scans that are lost do so too."""
    clock = ScanClock()
    turns = [turn for turn in range(80) if turn not in (20, 21, 22, 23, 24, 40)]
    for turn in turns:
        undelayed = 10.0 + 0.11 * turn
        late_s = 0.05 * (turn % 4)
        assert clock.arrival(110 * turn, undelayed + late_s, 0.1) == pytest.approx(undelayed)
