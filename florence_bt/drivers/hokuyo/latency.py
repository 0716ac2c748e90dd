"""How old a scan is when it arrives, by the sensor's own timer.

Source: REFERENCE 4.4 (24-bit timer), 4.9 (calibration of the latency as in hokuyo_node).
"""

from __future__ import annotations

import statistics

from florence_bt.core.errors import DeviceError, FrameError
from florence_bt.drivers.hokuyo.codec import Measurement, decode_scan, decode_time, time_mode
from florence_bt.drivers.hokuyo.conversation import Ask, Listen, Script
from florence_bt.drivers.hokuyo.scan_clock import timer_difference_ms
from florence_bt.drivers.hokuyo.status import ACCEPTED, SCAN_FOLLOWS, describe_status

SAMPLES = 10


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
