"""SCIP 2.0 on the wire: requests to bytes, bytes to replies, replies to numbers.

Here live framing, check sums and number decoding only: no port, no clock, no thread, no sequence of
commands (that is ``driver.py``) and no meaning of angles (that is ``geometry.py``).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ChecksumError, FrameError

LINE_VALUES = 64
"""A data line carries at most this many characters, then its check sum (REFERENCE 4.3)."""

LONGEST_FRAME = 16384
"""Bytes without a blank line after which the input is noise; the longest real frame has about 7000."""

INFORMATION_COMMANDS = ("VV", "PP", "II")

_ECHO = re.compile(
    rb"(?:VV|PP|II|BM|QT|RS|RB|TM[012]|SS\d{6}|CR\d\d|HS[01]|DB\d\d|SCIP2\.0|M[DS]\d{13}|G[DS]\d{10})"
    rb"(?:;[ -~]{0,16})?"
)
_STATUS = re.compile(rb"[0-9][0-9A-Z]")
_INFORMATION = re.compile(rb"[ -~]*")


def request(command: str) -> bytes:
    """A request as the sensor wants it: the command, its parameters and LF."""
    return command.encode("ascii") + b"\n"


def scan_command(
    kind: str, first_step: int, last_step: int, cluster: int, skip: int = 0, count: int = 0
) -> str:
    """The text of a measurement command.

    Args:
        kind: ``MD`` for a stream of scans, ``GD`` for one scan.
        first_step: First step, 0..9999.
        last_step: Last step, inclusive.
        cluster: Neighbouring steps that are joined into one value, 0..99 (0 and 1: none).
        skip: Scans to leave out between two, 0..9; MD only.
        count: Scans wanted, 0..99, 0 for an endless stream; MD only.

    Source: REFERENCE 4.7.
    """
    text = f"{kind}{first_step:04d}{last_step:04d}{cluster:02d}"
    return f"{text}{skip:01d}{count:02d}" if kind == "MD" else text


def check_sum(text: bytes) -> int:
    """The check character of a line, as a byte value. Source: REFERENCE 4.3."""
    return (sum(text) & 0x3F) + 0x30


def decode_values(characters: bytes, width: int) -> NDArray[np.int32]:
    """Decode numbers of 6 bits a character, most significant first.

    Args:
        characters: Length a multiple of ``width``.
        width: Characters a number: 2, 3 or 4.

    Returns:
        Shape (len(characters) / width,).

    Raises:
        FrameError: The length does not fit, or a character is none of the 64 allowed.

    Source: REFERENCE 4.4.
    """
    if len(characters) % width:
        raise FrameError(f"{len(characters)} characters do not make numbers of {width} characters")
    # Below '0' the subtraction wraps to 208 and more, so one comparison finds both kinds of bad character.
    digits = np.frombuffer(characters, np.uint8) - np.uint8(0x30)
    if digits.size and digits.max() > 0x3F:
        raise FrameError("a character outside '0'..'o' cannot be part of a number")
    columns = digits.reshape(-1, width).astype(np.int32)
    values = columns[:, 0]
    for place in range(1, width):
        values = (values << 6) | columns[:, place]
    return values


@dataclass(frozen=True, slots=True)
class Reply:
    """One complete reply whose check sums all fit.

    Attributes:
        echo: The request as the sensor repeats it, without the user string.
        status: Two characters; see ``status.py``.
        lines: The lines after the status, without their check sums. Lines of VV, PP and II still hold the
            text before ``;`` only.
    """

    echo: str
    status: str
    lines: tuple[bytes, ...] = ()

    @property
    def command(self) -> str:
        """The two letters of the command (``SC`` for ``SCIP2.0``)."""
        return self.echo[:2]

    def information(self) -> dict[str, str]:
        """The ``TAG:value`` lines of VV, PP and II as a mapping.

        Raises:
            FrameError: A line has no colon.
        """
        pairs = [line.decode("ascii").partition(":") for line in self.lines]
        if any(not colon for _, colon, _ in pairs):
            raise FrameError(f"a line of the reply to {self.echo!r} has no colon")
        return {tag: value for tag, _, value in pairs}


@dataclass(frozen=True, slots=True)
class ScanReply:
    """A scan as it came over the wire.

    Attributes:
        first_step: Step of the first value.
        cluster: Steps a value stands for, at least 1.
        remaining: Scans still to come; 0 in an endless stream.
        timestamp_ms: The sensor's 24-bit timer at step 0 of the turn.
        distances_mm: Shape (n,), int32; values below the sensor's DMIN are error codes.
    """

    first_step: int
    cluster: int
    remaining: int
    timestamp_ms: int
    distances_mm: NDArray[np.int32]


_SCAN_ECHO = re.compile(r"([MG])([DS])(\d{4})(\d{4})(\d{2})(?:\d(\d{2}))?")


def decode_scan(reply: Reply) -> ScanReply:
    """Read the scan out of a reply to MD, MS, GD or GS.

    Raises:
        FrameError: The reply is no scan, or its data is not exactly what its echo announces.
    """
    match = _SCAN_ECHO.fullmatch(reply.echo)
    if match is None or len(reply.lines) < 2:
        raise FrameError(f"the reply to {reply.echo!r} with status {reply.status} holds no scan")
    first, last, cluster = int(match[3]), int(match[4]), max(1, int(match[5]))
    width = 3 if match[2] == "D" else 2
    announced = -(-(last - first + 1) // cluster)
    stamp, *data = reply.lines
    if len(stamp) != 4:
        raise FrameError(f"a time stamp has 4 characters, not {len(stamp)}")
    if any(len(line) != LINE_VALUES for line in data[:-1]) or not 0 < len(data[-1]) <= LINE_VALUES:
        raise FrameError(f"every data line but the last has {LINE_VALUES} characters")
    distances = decode_values(b"".join(data), width)
    if len(distances) != announced:
        raise FrameError(f"{announced} values were announced and {len(distances)} came")
    return ScanReply(first, cluster, int(match[6] or 0), int(decode_values(stamp, 4)[0]), distances)


class ReplyParser:
    """Cuts a stream of bytes into replies; keeps what is not complete yet.

    A reply ends with a blank line. Whatever stands between two blank lines and is no reply (noise, a wrong
    check sum, half a scan) is dropped as a whole and counted; the next blank line starts afresh.

    Attributes:
        corrupted: Frames dropped so far.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.corrupted = 0

    def feed(self, data: bytes) -> list[Reply]:
        """Take the next bytes and return the replies that they complete."""
        self._buffer += data
        *frames, rest = self._buffer.split(b"\n\n")
        replies = [
            reply for frame in frames if (reply := self._reply_of(bytes(frame).strip(b"\n"))) is not None
        ]
        if len(rest) > LONGEST_FRAME:
            self.corrupted += 1
            rest = bytearray()
        # A blank line's second LF may still be on its way, so a lone LF at the end has to stay.
        self._buffer = bytearray(rest)
        return replies

    def clear(self) -> None:
        """Forget a half-received reply, as after the port was opened again."""
        self._buffer.clear()

    def _reply_of(self, frame: bytes) -> Reply | None:
        if not frame:
            return None
        try:
            return parse_frame(frame.split(b"\n"))
        except (FrameError, ChecksumError):
            self.corrupted += 1
            return None


def parse_frame(lines: Sequence[bytes]) -> Reply:
    """Check the lines of one reply.

    Args:
        lines: Echo, status and data lines, without LF and without the blank line.

    Raises:
        FrameError: The layout is wrong.
        ChecksumError: A line's check sum does not fit.
    """
    if len(lines) < 2 or not _ECHO.fullmatch(lines[0]):
        raise FrameError("a reply starts with the echo of a request and a status line")
    echo = lines[0].split(b";")[0].decode("ascii")
    status = _without_sum(lines[1])
    if not _STATUS.fullmatch(status):
        raise FrameError(f"{status!r} is no status of two characters")
    check = _information_text if echo in INFORMATION_COMMANDS else _without_sum
    return Reply(echo, status.decode("ascii"), tuple(check(line) for line in lines[2:]))


def _without_sum(line: bytes) -> bytes:
    text = line[:-1]
    if not text or line[-1] != check_sum(text):
        raise ChecksumError(f"the check sum of {line!r} does not fit")
    return text


def _information_text(line: bytes) -> bytes:
    """The part of a line before ``;``; only that is summed (REFERENCE 4.5)."""
    text = line[:-2]
    if line[-2:-1] != b";" or not _INFORMATION.fullmatch(text):
        raise FrameError(f"{line!r} does not end with ';' and a check sum")
    if line[-1] != check_sum(text):
        raise ChecksumError(f"the check sum of {line!r} does not fit")
    return text
