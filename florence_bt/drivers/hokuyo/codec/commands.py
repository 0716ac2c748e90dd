"""The text of every command. Source: REFERENCE 4.3, 4.6, 4.7.

Commands without parameters are their own text: ``VV PP II BM QT RS RT RB %SL SCIP2.0``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError

BIT_RATES = (19200, 38400, 57600, 115200, 250000, 500000, 750000)
"""What SS takes."""

KINDS = ("MD", "MS", "ME", "ND", "NE", "GD", "GS", "GE", "HD", "HE")
"""The measurement commands."""

LONGEST_STRING = 16
_STRING = re.compile(r"[A-Za-z0-9 ._+@]*")


def request(command: str, note: str = "") -> bytes:
    """A request as the sensor wants it: the command, its parameters and LF.

    Args:
        command: The command with its parameters.
        note: A string that the sensor repeats, at most 16 letters, digits or ``. _ + @`` and blanks.

    Raises:
        ConfigError: The note is too long or holds other characters.
    """
    if len(note) > LONGEST_STRING or not _STRING.fullmatch(note):
        raise ConfigError(
            f"the string {note!r} cannot go with a command",
            valid=[f"at most {LONGEST_STRING} letters, digits, blanks or . _ + @"],
        )
    text = f"{command};{note}" if note else command
    return text.encode("ascii") + b"\n"


@dataclass(frozen=True, slots=True)
class Measurement:
    """What a measurement command asks for.

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
        limits = {"first_step": 9999, "last_step": 9999, "cluster": 99, "skip": 9, "count": 99}
        if self.kind not in KINDS:
            raise ConfigError(f"there is no measurement {self.kind!r}", valid=KINDS)
        for name, highest in limits.items():
            if not 0 <= getattr(self, name) <= highest:
                raise ConfigError(f"{name} {getattr(self, name)} is out of range", valid=[f"0..{highest}"])
        if self.last_step < self.first_step:
            raise ConfigError(f"last_step {self.last_step} is below first_step {self.first_step}")

    @property
    def streams(self) -> bool:
        """Whether it asks for a stream."""
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


def scan_command(
    kind: str, first_step: int, last_step: int, cluster: int, skip: int = 0, count: int = 0
) -> str:
    """The text of a measurement command; see :class:`Measurement`."""
    return Measurement(kind, first_step, last_step, cluster, skip, count).command


def time_mode(action: int) -> str:
    """TM: 0 enters the time adjustment mode, 1 asks for the time, 2 leaves. Source: REFERENCE 4.6."""
    return f"TM{_one_of('time adjustment', action, (0, 1, 2))}"


def serial_speed(bit_rate: int) -> str:
    """SS: the bit rate of the serial line, from the next command on. Source: REFERENCE 4.6."""
    return f"SS{_one_of('bit rate', bit_rate, BIT_RATES):06d}"


def motor_speed(ratio: int) -> str:
    """CR: 0 the usual speed, 1 to 10 slower, 99 back to the usual one. Source: REFERENCE 4.6."""
    return f"CR{_one_of('speed ratio', ratio, (*range(11), 99)):02d}"


def sensitivity(high: bool) -> str:
    """HS: usual or high sensitivity. Source: REFERENCE 4.6."""
    return f"HS{int(high)}"


def debug_mode(number: int) -> str:
    """DB: behave as with an error, for tests; 10 ends that. Source: REFERENCE 4.6."""
    return f"DB{_one_of('debug mode', number, tuple(range(100))):02d}"


def _one_of(what: str, value: int, valid: tuple[int, ...]) -> int:
    if value not in valid:
        raise ConfigError(f"{what} {value} does not exist", valid=[str(number) for number in valid])
    return value
