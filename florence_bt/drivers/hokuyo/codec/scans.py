"""Replies to scans and times. Source: REFERENCE 4.4, 4.7."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError
from florence_bt.drivers.hokuyo.codec.numbers import decode_values
from florence_bt.drivers.hokuyo.codec.replies import Reply

LINE_VALUES = 64
"""A data line carries at most this many characters, then its check sum (REFERENCE 4.3)."""

WIDTHS = {"D": 3, "S": 2, "E": 3}
"""Characters a value by the second letter of the command."""

_SCAN_ECHO = re.compile(r"([MG])([DSE])(\d{4})(\d{4})(\d{2})(?:\d(\d{2}))?")


@dataclass(frozen=True, slots=True)
class ScanReply:
    """A scan as it came over the wire.

    Attributes:
        first_step: Step of the first value.
        cluster: Steps a value stands for, at least 1.
        remaining: Scans still to come; 0 in an endless stream.
        timestamp_ms: The sensor's 24-bit timer at step 0 of the turn.
        distances_mm: Shape (n,), int32; values below the sensor's DMIN are error codes.
        intensities: Shape (n,), int32, device units; shape (0,) without ME or GE.
    """

    first_step: int
    cluster: int
    remaining: int
    timestamp_ms: int
    distances_mm: NDArray[np.int32]
    intensities: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))


def decode_scan(reply: Reply) -> ScanReply:
    """Read the scan out of a reply to MD, MS, ME, GD, GS or GE.

    Raises:
        FrameError: The reply is no scan, or its data is not exactly what its echo announces.
    """
    match = _SCAN_ECHO.fullmatch(reply.echo)
    if match is None or len(reply.lines) < 2:
        raise FrameError(f"the reply to {reply.echo!r} with status {reply.status} holds no scan")
    first, last, cluster = int(match[3]), int(match[4]), max(1, int(match[5]))
    announced = -(-(last - first + 1) // cluster)
    stamp, *data = reply.lines
    if any(len(line) != LINE_VALUES for line in data[:-1]) or not 0 < len(data[-1]) <= LINE_VALUES:
        raise FrameError(f"every data line but the last has {LINE_VALUES} characters")
    values = decode_values(b"".join(data), WIDTHS[match[2]])
    if match[2] == "E":
        announced *= 2
    if len(values) != announced:
        raise FrameError(f"{announced} values were announced and {len(values)} came")
    distances, intensities = (values[::2], values[1::2]) if match[2] == "E" else (values, values[:0])
    return ScanReply(first, cluster, int(match[6] or 0), _time_of(stamp), distances, intensities)


def decode_time(reply: Reply) -> int:
    """Read the sensor's timer, in milliseconds, out of a reply to TM1.

    Raises:
        FrameError: The reply holds no time.
    """
    if reply.echo != "TM1" or len(reply.lines) != 1:
        raise FrameError(f"the reply to {reply.echo!r} with status {reply.status} holds no time")
    return _time_of(reply.lines[0])


def _time_of(line: bytes) -> int:
    if len(line) != 4:
        raise FrameError(f"a time stamp has 4 characters, not {len(line)}")
    return int(decode_values(line, 4)[0])
