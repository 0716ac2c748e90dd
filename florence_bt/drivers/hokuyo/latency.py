"""The sensor's clock against ours: how old a scan is when it arrives, and when its turn began.

Source: REFERENCE 4.4 (24-bit timer), 4.9 (calibration of the latency as in hokuyo_node).
"""

from __future__ import annotations

import statistics
from collections import deque

from florence_bt.core.errors import DeviceError, FrameError
from florence_bt.drivers.hokuyo.codec import Measurement, decode_scan, decode_time, time_mode
from florence_bt.drivers.hokuyo.conversation import Ask, Listen, Script
from florence_bt.drivers.hokuyo.status import ACCEPTED, SCAN_FOLLOWS, describe_status

TIMER_MS = 1 << 24
"""The sensor's timer begins again after so many milliseconds (REFERENCE 4.4)."""

SAMPLES = 10


def timer_difference_ms(later: int, earlier: int) -> int:
    """Milliseconds between two readings of the timer that lie less than two hours apart; it may have wrapped.

    Returns:
        -8388608 to 8388607.
    """
    half = TIMER_MS // 2
    return (later - earlier + half) % TIMER_MS - half


def measure_latency(measurement: Measurement, samples: int = SAMPLES) -> Script:
    """Compare the time stamps of scans with the sensor's clock before and after each.

    As hokuyo_node does it: one scan, then the clock, over and over; the median counts. The laser is off
    while the clock is read, so this must come before the stream.

    Args:
        measurement: The stream to come; its kind, window and cluster are used, one scan at a time.
        samples: How many scans.

    Returns:
        Seconds from the sensor passing step 0 to the arrival of the scan.
    """
    wanted = Measurement(
        measurement.kind, measurement.first_step, measurement.last_step, measurement.cluster, 0, 1
    )
    found: list[float] = []
    clock_ms, asked = yield from _read_clock()
    for _ in range(samples):
        yield Ask(wanted.command)
        answer = yield Listen(wanted.head)
        if answer.reply.status != SCAN_FOLLOWS:
            raise DeviceError(f"no scan came: {describe_status(wanted.kind, answer.reply.status)}")
        try:
            stamp_ms = decode_scan(answer.reply).timestamp_ms
        except FrameError as error:
            raise DeviceError(str(error)) from error
        before_ms, before = clock_ms, asked
        clock_ms, asked = yield from _read_clock()
        # Both readings tell when, on our clock, the sensor's timer stood at the stamp.
        began = [
            host + timer_difference_ms(stamp_ms, timer) / 1000.0
            for timer, host in ((before_ms, before), (clock_ms, asked))
        ]
        found.append(answer.arrived - sum(began) / 2.0)
    return statistics.median(found)


def _read_clock() -> Script:
    """The timer in milliseconds, and the moment in the middle of question and answer."""
    yield Ask(time_mode(0), (ACCEPTED, "02"))
    answer = yield Ask(time_mode(1))
    try:
        timer_ms = decode_time(answer.reply)
    except FrameError as error:
        raise DeviceError(str(error)) from error
    yield Ask(time_mode(2), (ACCEPTED, "03"))
    return timer_ms, (answer.sent + answer.arrived) / 2.0


class ScanClock:
    """When a scan would have arrived without delay, by the sensor's own timer.

    A scan that waited somewhere comes late, never early. So over some seconds the smallest difference
    between arrival and time stamp is the true one; with it the time stamps, which are evenly spaced, give
    the moments. The timer may wrap; a jump of either clock begins afresh.

    Attributes:
        late_s: How late the last scan was.
    """

    WINDOW_S = 10.0
    """Long enough to meet a scan without delay, short enough for the drift of two quartzes (1 ms)."""

    JUMP_S = 2.0
    """Scans are not late by so much: one of the clocks was set, or the sensor began anew."""

    def __init__(self) -> None:
        self._last_ms: int | None = None
        self._elapsed_s = 0.0
        self._differences: deque[tuple[float, float]] = deque()
        self.late_s = 0.0

    def reset(self) -> None:
        """Forget everything, as after the sensor's timer was set to zero."""
        self._last_ms = None
        self._elapsed_s = 0.0
        self._differences.clear()
        self.late_s = 0.0

    def arrival(self, timer_ms: int, arrived: float) -> float:
        """Take the time stamp of a scan and when it came; give when it would have come without delay."""
        if self._last_ms is not None:
            self._elapsed_s += timer_difference_ms(timer_ms, self._last_ms) / 1000.0
        self._last_ms = timer_ms
        difference = arrived - self._elapsed_s
        if self._differences and abs(difference - self._smallest()) > self.JUMP_S:
            self._differences.clear()
        self._differences.append((arrived, difference))
        while self._differences[0][0] < arrived - self.WINDOW_S:
            self._differences.popleft()
        self.late_s = difference - self._smallest()
        return arrived - self.late_s

    def _smallest(self) -> float:
        return min(difference for _, difference in self._differences)
