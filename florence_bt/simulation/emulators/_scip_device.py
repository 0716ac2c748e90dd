"""What the emulated scanner is and what can go wrong with it, and how it reads a measurement command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

ARGUMENT_LENGTHS = {
    "VV": 0,
    "PP": 0,
    "II": 0,
    "BM": 0,
    "QT": 0,
    "RS": 0,
    "TM": 1,
    "SS": 6,
    "CR": 2,
    "HS": 1,
    "MD": 13,
    "MS": 13,
    "GD": 10,
    "GS": 10,
}
"""Characters that follow the two letters of a command (REFERENCE 4.6, 4.7)."""

BIT_RATES = ("019200", "038400", "057600", "115200", "250000", "500000", "750000")


def _urg_version() -> dict[str, str]:
    return {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00(18/Jan./2007)",
        "PROT": "SCIP 2.0",
        "SERI": "H0614967",
    }


def _urg_parameters() -> dict[str, str]:
    return {
        "MODL": "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
        "DMIN": "20",
        "DMAX": "5600",
        "ARES": "1024",
        "AMIN": "44",
        "AMAX": "725",
        "AFRT": "384",
        "SCAN": "600",
    }


@dataclass(frozen=True, slots=True)
class ScannerModel:
    """The device as its labels and tables tell it; the defaults are a URG-04LX (REFERENCE 4.1, 4.5).

    Attributes:
        version: The fields of VV.
        parameters: The fields of PP.
        outermost_step: The last step that a command may name.
    """

    version: Mapping[str, str] = field(default_factory=_urg_version)
    parameters: Mapping[str, str] = field(default_factory=_urg_parameters)
    outermost_step: int = 768

    def number(self, tag: str) -> int:
        """A numeric field of PP."""
        return int(self.parameters[tag])


@dataclass(slots=True)
class ScipFaults:
    """What goes wrong; set it at any time.

    Attributes:
        silent: Nothing leaves the scanner, though it goes on working.
        noise: These bytes go out once, before whatever is sent next.
        bad_checksums: So many of the next scans carry a wrong check sum.
        scan_status: The next scan is replaced by this status (``50``: hardware trouble) and measuring ends.
        cut_scan_at: The next scan ends after so many bytes, without its blank line.
        frozen_timer_ms: Every time stamp reads this.
        laser_broken: BM is refused with 01.
        stat: The text of STAT.
    """

    silent: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    scan_status: str | None = None
    cut_scan_at: int | None = None
    frozen_timer_ms: int | None = None
    laser_broken: bool = False
    stat: str = "Sensor works well."


@dataclass(frozen=True, slots=True)
class Measurement:
    """What MD, MS, GD or GS asks for.

    Attributes:
        first: First step.
        last: Last step, inclusive.
        cluster: Steps a value.
        width: Characters a value.
        skip: Turns left out between two scans.
        count: Scans, None for an endless stream.
    """

    first: int
    last: int
    cluster: int
    width: int
    skip: int = 0
    count: int | None = 1


def parse_measurement(command: str, arguments: str, outermost_step: int) -> Measurement | str:
    """Read the arguments of a measurement command, which have the right length already.

    Returns:
        What is wanted, or the status that says what is wrong.

    Source: REFERENCE 4.7.
    """
    parts = (arguments[0:4], arguments[4:8], arguments[8:10], arguments[10:11], arguments[11:13])
    for part, status in zip(parts, ("01", "02", "03", "06", "07"), strict=True):
        if part and not part.isdecimal():
            return status
    first, last, cluster = (int(part) for part in parts[:3])
    if last > outermost_step:
        return "04"
    if last < first:
        return "05"
    width = 3 if command[1] == "D" else 2
    if command[0] == "G":
        return Measurement(first, last, cluster, width)
    return Measurement(first, last, cluster, width, int(parts[3]), int(parts[4]) or None)
