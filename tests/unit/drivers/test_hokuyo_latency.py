"""The sensor's clock: wraps, delays and the calibration, on numbers alone."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import DeviceError
from florence_bt.drivers.hokuyo.codec import Measurement, Reply
from florence_bt.drivers.hokuyo.conversation import Answer, Ask, Listen
from florence_bt.drivers.hokuyo.latency import TIMER_MS, ScanClock, measure_latency, timer_difference_ms


@given(start=st.integers(0, TIMER_MS - 1), passed=st.integers(-(TIMER_MS // 2), TIMER_MS // 2 - 1))
def test_differences_do_not_mind_the_wrap(start: int, passed: int) -> None:
    assert timer_difference_ms((start + passed) % TIMER_MS, start) == passed


@given(
    start=st.integers(0, TIMER_MS - 1),
    delays=st.lists(st.floats(0.0, 0.3), min_size=5, max_size=50),
)
def test_delays_do_not_move_the_stamps(start: int, delays: list[float]) -> None:
    clock = ScanClock()
    clock.arrival(start, 10.0)
    for turn, delay in enumerate(delays, 1):
        undelayed = 10.0 + 0.1 * turn
        assert clock.arrival((start + 100 * turn) % TIMER_MS, undelayed + delay) == pytest.approx(undelayed)
        assert clock.late_s == pytest.approx(delay, abs=1e-6)


def test_a_clock_that_jumps_is_followed() -> None:
    clock = ScanClock()
    for turn in range(20):
        clock.arrival(100 * turn, 0.1 * turn)
    assert clock.arrival(500_000, 2.0) == 2.0
    assert clock.arrival(500_100, 2.1) == pytest.approx(2.1)


def test_a_drifting_clock_is_followed() -> None:
    """100 parts in a million: a millisecond in the window of ten seconds."""
    clock = ScanClock()
    worst = 0.0
    for turn in range(20_000):
        arrived = 0.1 * turn
        worst = max(worst, abs(clock.arrival(round(100 * turn * 0.9999) % TIMER_MS, arrived) - arrived))
    assert worst < 0.003


def encode(value: int) -> bytes:
    return bytes(((value >> 6 * place) & 63) + 48 for place in range(3, -1, -1))


def converse(latency_s: float, fail_at: int | None = None) -> float:
    """Play a sensor whose timer wraps during the calibration and whose scans take latency_s."""
    now, zero_ms = 50.0, TIMER_MS - 600
    script = measure_latency(Measurement("MD", 44, 44))
    step, scans = next(script), 0

    def timer(moment: float) -> int:
        return (zero_ms + round((moment - 50.0) * 1000.0)) % TIMER_MS

    while True:
        try:
            now += 0.004
            if isinstance(step, Listen):
                scans += 1
                started = now
                now += latency_s
                lines = (encode(timer(started)), b"00P"[:3])
                status = "50" if scans == fail_at else "99"
                step = script.send(Answer(Reply("MD0044004401000", status, lines), started, now))
                continue
            assert isinstance(step, Ask)
            lines = (encode(timer(now)),) if step.command == "TM1" else ()
            step = script.send(Answer(Reply(step.command, "00", lines), now - 0.002, now + 0.002))
        except StopIteration as end:
            assert scans == 10
            return float(end.value)


@pytest.mark.parametrize("latency_s", [0.01, 0.0709, 0.25])
def test_the_latency_is_found(latency_s: float) -> None:
    assert converse(latency_s) == pytest.approx(latency_s, abs=0.001)


def test_trouble_ends_the_calibration() -> None:
    with pytest.raises(DeviceError, match="hardware trouble"):
        converse(0.07, fail_at=3)
