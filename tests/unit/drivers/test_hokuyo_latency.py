"""The calibration of the latency, on numbers alone."""

import pytest

from florence_bt.core.errors import DeviceError
from florence_bt.drivers.hokuyo.codec import Measurement, ScipReply
from florence_bt.drivers.hokuyo.conversation import Answer, Ask, Listen
from florence_bt.drivers.hokuyo.scan_clock import TIMER_MS
from florence_bt.drivers.hokuyo.stream import measure_latency


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
                step = script.send(Answer(ScipReply("MD0044004401000", status, lines), started, now))
                continue
            assert isinstance(step, Ask)
            lines = (encode(timer(now)),) if step.command == "TM1" else ()
            step = script.send(Answer(ScipReply(step.command, "00", lines), now - 0.002, now + 0.002))
        except StopIteration as end:
            assert scans == 10
            return float(end.value)


@pytest.mark.parametrize("latency_s", [0.01, 0.0709, 0.25])
def test_the_latency_is_found(latency_s: float) -> None:
    assert converse(latency_s) == pytest.approx(latency_s, abs=0.001)


def test_trouble_ends_the_calibration() -> None:
    with pytest.raises(DeviceError, match="hardware trouble"):
        converse(0.07, fail_at=3)
