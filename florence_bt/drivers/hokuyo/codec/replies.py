"""Bytes to replies: framing and check sums. Source: REFERENCE 4.3, 4.5."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.core.errors import ChecksumError, FrameError
from florence_bt.drivers.hokuyo.codec.numbers import check_sum

LONGEST_FRAME = 16384
"""Bytes without a blank line after which the input is noise; the longest real frame has about 7000."""

INFORMATION_COMMANDS = ("VV", "PP", "II")

_COMMAND = (
    rb"(?:VV|PP|II|BM|QT|RS|RT|RB|%SL|TM[012]|SS\d{6}|CR\d\d|HS[01]|DB\d\d|SCIP2\.0"
    rb"|M[DSE]\d{13}|N[DE]\d{13}|G[DSE]\d{10}|H[DE]\d{10})(?:;[ -~]{0,16})?"
)
_ECHO = re.compile(_COMMAND)
_ECHO_AT_END = re.compile(_COMMAND + rb"\Z")
_STATUS = re.compile(rb"[0-9][0-9A-Z]")
_INFORMATION = re.compile(rb"[ -~]*")
_REMARK = b"<-"
"""Begins a remark in a line of II; a UTM-30LX leaves it out of the check sum (a note in hokuyoaist)."""

_SWITCHED = [b"SCIP2.0", b"0"]
"""The one reply that is still in SCIP 1.1: a status of one character, without a sum (manual, section 2)."""


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
        """The two letters of the command (``SC`` for ``SCIP2.0``, ``%S`` for ``%SL``)."""
        return self.echo[:2]

    def information(self) -> dict[str, str]:
        """The ``TAG:value`` lines of VV, PP and II as a mapping.

        Raises:
            FrameError: A line has no colon.
        """
        pairs = [line.decode("ascii").partition(":") for line in self.lines]
        if any(not colon for _, colon, _ in pairs):
            raise FrameError(f"a line of the reply to {self.echo!r} has no colon")
        return {tag: value.strip() for tag, _, value in pairs}


class ReplyParser:
    """Cuts a stream of bytes into replies; keeps what is not complete yet.

    A reply ends with a blank line. What stands between two blank lines and is no reply (noise, a wrong check
    sum, half a scan) is counted and dropped, but for a whole reply at its end: noise or half a reply before
    a good one does not cost the good one.

    Attributes:
        corrupted: Frames with something wrong so far.
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
        lines = frame.split(b"\n")
        try:
            return parse_frame(lines)
        except (FrameError, ChecksumError):
            self.corrupted += 1
            return _reply_at_end(lines)


def parse_frame(lines: Sequence[bytes]) -> Reply:
    """Check the lines of one reply.

    Args:
        lines: Echo, status and data lines, without LF and without the blank line.

    Raises:
        FrameError: The layout is wrong.
        ChecksumError: A line's check sum does not fit.
    """
    if list(lines) == _SWITCHED:
        return Reply("SCIP2.0", "00")
    if len(lines) < 2 or not _ECHO.fullmatch(lines[0]):
        raise FrameError("a reply starts with the echo of a request and a status line")
    echo = lines[0].split(b";")[0].decode("ascii")
    status = _without_sum(lines[1])
    if not _STATUS.fullmatch(status):
        raise FrameError(f"{status!r} is no status of two characters")
    check = _information_text if echo in INFORMATION_COMMANDS else _without_sum
    return Reply(echo, status.decode("ascii"), tuple(check(line) for line in lines[2:]))


def _reply_at_end(lines: Sequence[bytes]) -> Reply | None:
    """The reply that begins at the last echo, which may have noise before it on its line."""
    for first in range(len(lines) - 2, -1, -1):
        match = _ECHO_AT_END.search(lines[first])
        if match is None or (first == 0 and match.start() == 0):
            continue
        try:
            return parse_frame([match[0], *lines[first + 1 :]])
        except (FrameError, ChecksumError):
            return None
    return None


def _without_sum(line: bytes) -> bytes:
    text = line[:-1]
    if not text or line[-1] != check_sum(text):
        raise ChecksumError(f"the check sum of {line!r} does not fit")
    return text


def _information_text(line: bytes) -> bytes:
    """The part of a line before ``;``; only that is summed (REFERENCE 4.5), maybe without its remark."""
    text = line[:-2]
    if line[-2:-1] != b";" or not _INFORMATION.fullmatch(text):
        raise FrameError(f"{line!r} does not end with ';' and a check sum")
    if line[-1] not in (check_sum(text), check_sum(text.partition(_REMARK)[0])):
        raise ChecksumError(f"the check sum of {line!r} does not fit")
    return text
