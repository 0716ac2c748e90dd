"""The measurement to ask for, the latency of its scans, and the way to the first one.

Source: REFERENCE 4.4 (24-bit timer), 4.7, 4.9.
"""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, replace

from florence_bt.core.errors import CommandRejected, DeviceError, FrameError
from florence_bt.drivers.hokuyo.codec import Measurement, decode_scan, decode_time, time_mode
from florence_bt.drivers.hokuyo.conversation import Ask, Listen, Script
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.hokuyo.scan_clock import timer_difference_ms
from florence_bt.drivers.hokuyo.start_up import Sensor
from florence_bt.drivers.hokuyo.status import ACCEPTED, SCAN_FOLLOWS, describe_status

SAFE_DEGREES = 95.0
"""A UTM-30LX may crash when it sends intensities of more than this a cluster (hokuyo_node)."""

SAFE_DEGREES_BY_FIRMWARE = {"1.16.01(16/Nov./2009)": 190.0}


@dataclass(frozen=True, slots=True)
class AcceptedStream:
    """A stream that was accepted.

    Attributes:
        measurement: What the sensor measures.
        latency_s: What the calibration found, None without one.
        warnings: What could not be had as wished.
    """

    measurement: Measurement
    latency_s: float | None
    warnings: tuple[str, ...]


def plan_measurement(wanted: HokuyoParameters, sensor: Sensor) -> tuple[Measurement, tuple[str, ...]]:
    """Return the endless stream that the parameters ask for, within what the sensor can do.

    Returns:
        The measurement, and what had to be changed.
    """
    geometry = sensor.geometry
    first, last = geometry.step_at(wanted.min_ang), geometry.step_at(wanted.max_ang)
    warnings: tuple[str, ...] = ()
    names = (sensor.version.get("PROD", ""), sensor.parameters.get("MODL", ""))
    if wanted.intensity and not wanted.allow_unsafe_settings and any("UTM-30LX" in name for name in names):
        degrees = SAFE_DEGREES_BY_FIRMWARE.get(sensor.version.get("FIRM", ""), SAFE_DEGREES)
        safe = first + int(math.radians(degrees) * max(1, wanted.cluster) / geometry.step_angle)
        if last > safe:
            last = safe
            warnings = (
                f"max_ang was lowered to {geometry.angle_of(last):.4f}: with intensities this sensor is safe "
                f"up to {degrees:g} degrees a cluster; allow_unsafe_settings lifts that",
            )
    kind = ("N" if wanted.multi_echo else "M") + ("E" if wanted.intensity else "D")
    return Measurement(kind, first, last, wanted.cluster, wanted.skip, 0), warnings


def begin_stream(wanted: Measurement, calibrate: bool) -> Script:
    """Find out what the sensor lacks, measure the latency, and start the stream.

    Args:
        wanted: The endless stream.
        calibrate: Whether to measure the latency first.

    Returns:
        The :class:`AcceptedStream`.
    """
    warnings: list[str] = []
    latency_s: float | None = None
    if wanted.kind[0] == "N" and not (yield from _can_measure(wanted)):
        wanted = replace(wanted, kind=f"M{wanted.kind[1]}")
        warnings.append("this sensor measures one echo of a beam only: multi_echo is left out")
    if wanted.kind == "ME" and not (yield from _can_measure(wanted)):
        wanted = replace(wanted, kind="MD")
        warnings.append("this sensor measures no intensities: they are left out")
    if calibrate:
        try:
            latency_s = yield from measure_latency(wanted)
        except DeviceError as error:
            warnings.append(f"the latency could not be measured: {error}")
            yield Ask(time_mode(2), (ACCEPTED, "03"))
            yield Ask("QT")
    # A scan proves as well that the stream runs.
    yield Ask(wanted.command, (ACCEPTED, SCAN_FOLLOWS))
    return AcceptedStream(wanted, latency_s, tuple(warnings))


def _can_measure(wanted: Measurement) -> Script:
    """Tell whether the sensor measures one beam in this way."""
    beam = Measurement(wanted.kind, wanted.first_step, wanted.first_step, 1, 0, 1)
    try:
        yield Ask(beam.command, attempts=1)
        answer = yield Listen(beam.head)
    except CommandRejected:
        return False
    return answer.reply.status == SCAN_FOLLOWS


SAMPLES = 10
"""Scans of which the median of the latency is taken. Source: REFERENCE 4.9."""


def measure_latency(measurement: Measurement) -> Script:
    """Compare the time stamps of scans with the sensor's clock before and after each.

    As hokuyo_node does it: one scan, then the clock, over and over; the median counts. The laser is off
    while the clock is read, so this must come before the stream.

    Args:
        measurement: The stream to come; its kind, window and cluster are used, one scan at a time.

    Returns:
        Seconds from the sensor passing step 0 to the arrival of the scan.
    """
    wanted = Measurement(
        measurement.kind, measurement.first_step, measurement.last_step, measurement.cluster, 0, 1
    )
    found: list[float] = []
    clock_ms, asked = yield from _read_clock()
    for _ in range(SAMPLES):
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
        # Both readings say when, on our clock, the sensor's timer stood at the stamp.
        began = [
            host + timer_difference_ms(stamp_ms, timer) / 1000.0
            for timer, host in ((before_ms, before), (clock_ms, asked))
        ]
        found.append(answer.arrived - sum(began) / 2.0)
    return statistics.median(found)


def _read_clock() -> Script:
    """Read the timer in milliseconds, and the moment in the middle of question and answer."""
    yield Ask(time_mode(0), (ACCEPTED, "02"))
    answer = yield Ask(time_mode(1))
    try:
        timer_ms = decode_time(answer.reply)
    except FrameError as error:
        raise DeviceError(str(error)) from error
    yield Ask(time_mode(2), (ACCEPTED, "03"))
    return timer_ms, (answer.sent + answer.arrived) / 2.0
