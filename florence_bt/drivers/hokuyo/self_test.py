"""The tests that hokuyo_node ran on request. Source: REFERENCE 4.9 (polls for a self test)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import DeviceError, FrameError
from florence_bt.drivers.hokuyo.codec import Measurement, decode_scan
from florence_bt.drivers.hokuyo.conversation import Ask, Listen, Script
from florence_bt.drivers.hokuyo.geometry import SensorGeometry
from florence_bt.drivers.hokuyo.start_up import LASER_ON, UNKNOWN, is_healthy
from florence_bt.drivers.hokuyo.status import ACCEPTED, SCAN_FOLLOWS, describe_status

STREAM_SKIP = 1
"""Scans left out between two of the streamed data. Source: REFERENCE 4.9."""
UNKNOWN_COMMAND = ("0D", "0E")


@dataclass(frozen=True, slots=True)
class SelfTestResult:
    """The result of one test.

    Attributes:
        name: The name that hokuyo_node gave it.
        level: Whether it passed.
        message: What was found.
    """

    name: str
    level: Severity
    message: str


def self_test(geometry: SensorGeometry, scans: int) -> Script:
    """Run all tests, each of them whatever the others said; the laser is off at the end.

    Args:
        geometry: The sensor's numbers.
        scans: Scans of each stream; hokuyo_node took 99.

    Returns:
        A list of :class:`SelfTestResult`.
    """
    tests: tuple[tuple[str, Callable[[], Script]], ...] = (
        ("Status Test", _status),
        ("Laser Test", _laser_on),
        ("Polled Data Test", lambda: _polled(geometry)),
        ("Streamed Data Test", lambda: _streamed("MD", geometry, scans)),
        ("Streamed Intensity Data Test", lambda: _streamed("ME", geometry, scans)),
        ("Laser Off Test", _laser_off),
    )
    results = []
    yield Ask("QT")
    for name, test in tests:
        try:
            level, message = yield from test()
        except (DeviceError, FrameError) as error:
            level, message = Severity.ERROR, str(error)
        results.append(SelfTestResult(name, level, message))
    return results


def _status() -> Script:
    answer = yield Ask("II")
    state, _ = answer.reply.identification()
    stat = state.get("STAT", UNKNOWN)
    return (Severity.OK if is_healthy(stat) else Severity.ERROR), stat


def _laser_on() -> Script:
    yield LASER_ON
    return Severity.OK, "the laser is on"


def _laser_off() -> Script:
    yield Ask("QT")
    return Severity.OK, "the laser is off"


def _polled(geometry: SensorGeometry) -> Script:
    answer = yield Ask(Measurement("GD", geometry.first_step, geometry.last_step).command)
    values = len(decode_scan(answer.reply).distances_mm)
    return Severity.OK, f"{values} values came when asked for"


def _streamed(kind: str, geometry: SensorGeometry, count: int) -> Script:
    wanted = Measurement(kind, geometry.first_step, geometry.last_step, 1, STREAM_SKIP, count)
    refused = UNKNOWN_COMMAND if kind == "ME" else ()
    answer = yield Ask(wanted.command, (ACCEPTED, *refused), 1)
    if answer.reply.status in refused:
        return Severity.OK, "this sensor measures no intensities"
    timeout_s = 2.0 * geometry.scan_period * (STREAM_SKIP + 1) + 1.0
    arrived = 0
    while True:
        answer = yield Listen(wanted.head, timeout_s)
        if answer.reply.status != SCAN_FOLLOWS:
            raise DeviceError(
                f"measuring ended with status {answer.reply.status}: "
                f"{describe_status(kind, answer.reply.status)}"
            )
        try:
            left = decode_scan(answer.reply).remaining
        except FrameError:
            continue
        arrived += 1
        if left == 0:
            return _judge_stream(count, count - arrived)


def _judge_stream(count: int, lost: int) -> tuple[Severity, str]:
    if lost == 0:
        return Severity.OK, f"all {count} scans came"
    if lost == 1:
        return Severity.WARN, f"one scan of {count} was damaged; that may happen"
    return Severity.ERROR, f"{lost} scans of {count} were damaged"
