"""SCIP 2.0 on the wire: commands to bytes, bytes to replies, replies to numbers.

Framing, checksums and number decoding only: no port, no clock, no thread, no sequence of commands (that is
``driver.py`` with its scripts) and no meaning of angles (that is ``geometry.py``).

Source: REFERENCE 4.3 to 4.7.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ChecksumError, ConfigError, FrameError

BIT_RATES = (19200, 38400, 57600, 115200, 250000, 500000, 750000)
"""Bit rates that SS takes."""

KINDS = ("MD", "MS", "ME", "ND", "NE", "GD", "GS", "GE", "HD", "HE")
"""The measurement commands."""

LARGEST_STEP = 9999
"""A command has four digits for each of its steps."""


def request(command: str) -> bytes:
    """Make a request as the sensor wants it: the command with its parameters, and LF."""
    return command.encode("ascii") + b"\n"


@dataclass(frozen=True, slots=True)
class Measurement:
    """The arguments of a measurement command.

    Attributes:
        kind: ``MD MS ME`` for a stream of scans, ``GD GS GE`` for one scan: D has three characters a
            distance, S two (at most 4095 mm), E three for the distance and three for the intensity. ``ND
            NE HD HE`` are the same with every echo of a beam (SCIP 2.2).
        first_step: First step, 0..9999.
        last_step: Last step, inclusive.
        cluster: Neighbouring steps that are joined into one value, 0..99 (0 and 1: none).
        skip: Scans to leave out between two, 0..9; streams only.
        count: Scans wanted, 0..99, 0 for an endless stream; streams only.

    Source: REFERENCE 4.7.
    """

    kind: str
    first_step: int
    last_step: int
    cluster: int = 1
    skip: int = 0
    count: int = 0

    def __post_init__(self) -> None:
        limits = {"cluster": 99, "skip": 9, "count": 99}
        limits |= {"first_step": LARGEST_STEP, "last_step": LARGEST_STEP}
        if self.kind not in KINDS:
            raise ConfigError(f"there is no measurement {self.kind!r}", valid=KINDS)
        for name, highest in limits.items():
            if not 0 <= getattr(self, name) <= highest:
                raise ConfigError(f"{name} {getattr(self, name)} is out of range", valid=[f"0..{highest}"])
        if self.last_step < self.first_step:
            raise ConfigError(f"last_step {self.last_step} is below first_step {self.first_step}")

    @property
    def streams(self) -> bool:
        """Tell whether it asks for a stream."""
        return self.kind[0] in "MN"

    @property
    def head(self) -> str:
        """The command without the number of scans: what the echo of each of its scans begins with."""
        text = f"{self.kind}{self.first_step:04d}{self.last_step:04d}{self.cluster:02d}"
        return f"{text}{self.skip:01d}" if self.streams else text

    @property
    def command(self) -> str:
        """The text of the command."""
        return f"{self.head}{self.count:02d}" if self.streams else self.head


def time_mode(action: int) -> str:
    """Write TM: 0 enters the time adjustment mode, 1 asks for the time, 2 leaves. Source: REFERENCE 4.6."""
    return f"TM{_one_of('time adjustment', action, (0, 1, 2))}"


def serial_speed(bit_rate: int) -> str:
    """Write SS: the bit rate of the serial line, from the next command on. Source: REFERENCE 4.6."""
    return f"SS{_one_of('bit rate', bit_rate, BIT_RATES):06d}"


def _one_of(what: str, value: int, valid: tuple[int, ...]) -> int:
    if value not in valid:
        raise ConfigError(f"{what} {value} does not exist", valid=[str(number) for number in valid])
    return value


def checksum(text: bytes) -> int:
    """Return the check character of a line, as a byte value. Source: REFERENCE 4.3."""
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


LONGEST_FRAME = 16384
"""Bytes without a blank line after which the input is noise; the longest real frame has about 7000."""

INFORMATION_COMMANDS = ("VV", "PP", "II")

IDENTIFYING_COMMANDS = ("VV", "II")
"""Nobody measures with what these tell: a line of theirs that cannot be read costs that line only."""

_COMMAND = (
    rb"(?:VV|PP|II|BM|QT|RS|RT|RB|%SL|TM[012]|SS\d{6}|CR\d\d|HS[01]|DB\d\d|SCIP2\.0"
    rb"|M[DSE]\d{13}|N[DE]\d{13}|G[DSE]\d{10}|H[DE]\d{10})(?:;[ -~]{0,16})?"
)
_ECHO = re.compile(_COMMAND)
_ECHO_AT_END = re.compile(_COMMAND + rb"\Z")
_STATUS = re.compile(rb"[0-9][0-9A-Z]")
_INFORMATION = re.compile(rb"[ -~]*")
_REMARK = b"<-"
"""Begins a remark in a line of II; a UTM-30LX leaves it out of the checksum (a note in hokuyoaist)."""

_SWITCHED = [b"SCIP2.0", b"0"]
"""The one reply that is still in SCIP 1.1: a status of one character, without a sum (manual, section 2)."""


@dataclass(frozen=True, slots=True)
class ScipReply:
    """One complete reply whose checksums all fit; of VV and II those of its :attr:`lines`.

    Attributes:
        echo: The request as the sensor repeats it, without the user string.
        status: Two characters; see ``status.py``.
        lines: The lines after the status, without their checksums. Lines of VV, PP and II still hold the
            text before ``;`` only.
        unreadable: How many further lines of VV or II could not be read.
    """

    echo: str
    status: str
    lines: tuple[bytes, ...] = ()
    unreadable: int = 0

    @property
    def command(self) -> str:
        """The two letters of the command (``SC`` for ``SCIP2.0``, ``%S`` for ``%SL``)."""
        return self.echo[:2]

    def information(self) -> dict[str, str]:
        """Return the ``TAG:value`` lines of VV, PP and II as a mapping.

        Raises:
            FrameError: A line has no colon.
        """
        pairs = [line.decode("ascii").partition(":") for line in self.lines]
        if any(not colon for _, colon, _ in pairs):
            raise FrameError(f"a line of the reply to {self.echo!r} has no colon")
        return {tag: value.strip() for tag, _, value in pairs}

    def identification(self) -> tuple[dict[str, str], int]:
        """Read the values by tag of a reply to VV or II, and count the lines that cannot be read."""
        pairs = [line.decode("ascii").partition(":") for line in self.lines]
        fields = {tag: value.strip() for tag, colon, value in pairs if colon}
        return fields, self.unreadable + sum(not colon for _, colon, _ in pairs)


class ReplyParser:
    """Cuts a stream of bytes into replies; keeps what is not complete yet.

    A reply ends with a blank line. What is between two blank lines but not a reply (noise, a wrong checksum,
    half a scan) is counted and dropped, but for a whole reply at its end: noise or half a reply before
    a good one does not cost the good one.

    Args:
        some: Whether a reply to VV or II counts with those of its lines that can be read.

    Attributes:
        corrupted: Frames with something wrong so far.
    """

    def __init__(self, *, some: bool = False) -> None:
        self._some = some
        self._buffer = bytearray()
        self.corrupted = 0

    def feed(self, data: bytes) -> list[ScipReply]:
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

    def _reply_of(self, frame: bytes) -> ScipReply | None:
        if not frame:
            return None
        lines = frame.split(b"\n")
        try:
            return parse_frame(lines)
        except (FrameError, ChecksumError):
            self.corrupted += 1
            return _reply_at_end(lines) or (_identification_in(lines) if self._some else None)


def parse_frame(lines: Sequence[bytes], *, some: bool = False) -> ScipReply:
    """Check the lines of one reply.

    Args:
        lines: Echo, status and data lines, without LF and without the blank line.
        some: Whether lines of VV and II that cannot be read are left out.

    Raises:
        FrameError: The layout is wrong.
        ChecksumError: A line's checksum does not fit.
    """
    if list(lines) == _SWITCHED:
        return ScipReply("SCIP2.0", "00")
    if len(lines) < 2 or not _ECHO.fullmatch(lines[0]):
        raise FrameError("a reply starts with the echo of a request and a status line")
    echo = lines[0].split(b";")[0].decode("ascii")
    status = _without_sum(lines[1])
    if not _STATUS.fullmatch(status):
        raise FrameError(f"{status!r} is not a status of two characters")
    check = _information_text if echo in INFORMATION_COMMANDS else _without_sum
    data = lines[2:]
    if some and echo in IDENTIFYING_COMMANDS:
        data = [line for line in data if _is_field(line)]
    texts = tuple(check(line) for line in data)
    return ScipReply(echo, status.decode("ascii"), texts, len(lines) - 2 - len(data))


def _is_field(line: bytes) -> bool:
    try:
        return b":" in _information_text(line)
    except (FrameError, ChecksumError):
        return False


def _identification_in(lines: Sequence[bytes]) -> ScipReply | None:
    """Return the last reply to VV or II in a frame with what can be read of it."""
    for first in range(len(lines) - 2, -1, -1):
        match = _ECHO_AT_END.search(lines[first])
        if match is not None and match[0].decode("ascii") in IDENTIFYING_COMMANDS:
            try:
                return parse_frame([match[0], *lines[first + 1 :]], some=True)
            except (FrameError, ChecksumError):
                return None
    return None


def _reply_at_end(lines: Sequence[bytes]) -> ScipReply | None:
    """Return the reply that begins at the last echo, which may have noise before it on its line."""
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
    if not text or line[-1] != checksum(text):
        raise ChecksumError(f"the checksum of {line!r} does not fit")
    return text


def _information_text(line: bytes) -> bytes:
    """Return the part before ``;``, which alone is summed (REFERENCE 4.5), maybe without its remark."""
    text = line[:-2]
    if line[-2:-1] != b";" or not _INFORMATION.fullmatch(text):
        raise FrameError(f"{line!r} does not end with ';' and a checksum")
    if line[-1] not in (checksum(text), checksum(text.partition(_REMARK)[0])):
        raise ChecksumError(f"the checksum of {line!r} does not fit")
    return text


LINE_VALUES = 64
"""A data line carries at most this many characters, then its checksum (REFERENCE 4.3)."""

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


def decode_scan(reply: ScipReply) -> ScanReply:
    """Read the scan out of a reply to a measurement command.

    Raises:
        FrameError: The reply is not a scan, or its data is not exactly what its echo announces.
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
    """Return the numbers of each echo of each step.

    Args:
        data: The data lines in one piece.
        width: Characters per number.
        numbers: Numbers per echo: 1, or 2 with intensities.

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


def decode_time(reply: ScipReply) -> int:
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
