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

NO_ECHO = -1
"""Stands where a beam has fewer echoes than another one."""

_ANOTHER_ECHO = b"&"
"""Goes before an echo that belongs to the same step as the one before it; no number has this character."""

_SCAN_ECHO = re.compile(r"([MGNH])([DSE])(\d{4})(\d{4})(\d{2})(?:\d(\d{2}))?")


@dataclass(frozen=True, slots=True)
class ScanReply:
    """A scan as it came over the wire.

    Attributes:
        first_step: Step of the first value.
        cluster: Steps a value stands for, at least 1.
        remaining: Scans still to come; 0 in an endless stream.
        timestamp_ms: The sensor's 24-bit timer at step 0 of the turn.
        distances_mm: Shape (n,), int32; values below the sensor's DMIN are error codes.
        intensities: Shape (n,), int32, device units; shape (0,) without ME, GE, NE or HE.
        echoes_mm: Every echo, shape (n, k), ``NO_ECHO`` from a beam's last echo on; None but for ND, NE,
            HD and HE, whose ``distances_mm`` and ``intensities`` are those of the first echoes.
        echo_intensities: Likewise; shape (n, 0) without NE or HE.
    """

    first_step: int
    cluster: int
    remaining: int
    timestamp_ms: int
    distances_mm: NDArray[np.int32]
    intensities: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    echoes_mm: NDArray[np.int32] | None = None
    echo_intensities: NDArray[np.int32] = field(default_factory=lambda: np.empty((0, 0), np.int32))


def decode_scan(reply: Reply) -> ScanReply:
    """Read the scan out of a reply to a measurement command.

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
    numbers = 2 if match[2] == "E" else 1
    echoes = _decode_echoes(b"".join(data), WIDTHS[match[2]], numbers)
    if len(echoes) != announced:
        raise FrameError(f"{announced} values were announced and {len(echoes)} came")
    several = match[1] in "NH"
    if not several and echoes.shape[1] > 1:
        raise FrameError(f"the reply to {reply.echo!r} has several echoes of a step")
    distances, intensities = echoes[:, :, 0], echoes[:, :, 1:].reshape(len(echoes), -1)
    return ScanReply(
        first,
        cluster,
        int(match[6] or 0),
        _time_of(stamp),
        distances[:, 0],
        intensities[:, 0] if numbers == 2 else np.empty(0, np.int32),
        distances if several else None,
        intensities,
    )


def _decode_echoes(data: bytes, width: int, numbers: int) -> NDArray[np.int32]:
    """The numbers of each echo of each step.

    Args:
        data: The data lines in one piece.
        width: Characters a number.
        numbers: Numbers an echo: 1, or 2 with intensities.

    Returns:
        Shape (steps, k, numbers), ``NO_ECHO`` from a step's last echo on.

    Raises:
        FrameError: The data cannot be cut into echoes.

    Source: urg_library, ``receive_length_data``.
    """
    pieces = data.split(_ANOTHER_ECHO)
    if any(len(piece) % (width * numbers) for piece in pieces) or not all(pieces):
        raise FrameError("the data do not make whole echoes")
    values = decode_values(b"".join(pieces), width).reshape(-1, numbers)
    if len(pieces) == 1:
        return values[:, np.newaxis]
    begins = np.ones(len(values), np.bool_)  # whether an echo is the first one of its step
    begins[np.cumsum([len(piece) // (width * numbers) for piece in pieces])[:-1]] = False
    step = np.cumsum(begins) - 1
    place = np.arange(len(values)) - np.flatnonzero(begins)[step]
    echoes = np.full((step[-1] + 1, place.max() + 1, numbers), NO_ECHO, np.int32)
    echoes[step, place] = values
    return echoes


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
