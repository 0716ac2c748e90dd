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
    "RT": 0,
    "RB": 0,
    "%SL": 0,
    "%ST": 0,
    "TM": 1,
    "SS": 6,
    "CR": 2,
    "HS": 1,
    "DB": 2,
    "MD": 13,
    "MS": 13,
    "ME": 13,
    "GD": 10,
    "GS": 10,
    "GE": 10,
}
"""Characters that follow the letters of a command (REFERENCE 4.6, 4.7)."""

ALLOWED_IN_TIME_MODE = ("TM", "II", "VV", "%ST")
"""Everything else is refused there; state and version may be asked for at any time."""

BIT_RATES = ("019200", "038400", "057600", "115200", "250000", "500000", "750000")

COMMON = frozenset({"VV", "PP", "II", "BM", "QT", "RS", "RB", "TM", "SS", "HS", "DB", "MD", "MS", "GD", "GS"})


@dataclass(frozen=True, slots=True)
class ScannerModel:
    """The device as its labels and tables tell it.

    Attributes:
        name: What people call it.
        version: The fields of VV.
        parameters: The fields of PP.
        outermost_step: The last step that a command may name.
        commands: What it understands.
        no_measurement: The code of a step that it cannot see (REFERENCE 4.8).
    """

    name: str
    version: Mapping[str, str]
    parameters: Mapping[str, str]
    outermost_step: int
    commands: frozenset[str]
    no_measurement: int

    def number(self, tag: str) -> int:
        """A numeric field of PP."""
        return int(self.parameters[tag])


URG_04LX = ScannerModel(
    "urg-04lx",
    {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00(18/Jan./2007)",
        "PROT": "SCIP 2.0",
        "SERI": "H0614967",
    },
    {
        "MODL": "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
        "DMIN": "20",
        "DMAX": "5600",
        "ARES": "1024",
        "AMIN": "44",
        "AMAX": "725",
        "AFRT": "384",
        "SCAN": "600",
    },
    768,
    COMMON | {"CR"},
    19,
)
"""Source: REFERENCE 4.1, 4.5. It measures no intensities here."""

UTM_30LX = ScannerModel(
    "utm-30lx",
    {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor TOP-URG UTM-30LX",
        "FIRM": "1.19.01(31/Mar./2011)",
        "PROT": "SCIP 2.0",
        "SERI": "H1000001",
    },
    {
        "MODL": "UTM-30LX(Hokuyo Automatic Co.,Ltd.)",
        "DMIN": "23",
        "DMAX": "60000",
        "ARES": "1440",
        "AMIN": "0",
        "AMAX": "1080",
        "AFRT": "540",
        "SCAN": "2400",
    },
    1080,
    COMMON | {"ME", "GE", "RT", "%SL", "%ST"},
    5,
)
"""Source: REFERENCE 4.1. Its firmware text and its serial number are made up in the usual form."""

MODELS = {model.name: model for model in (URG_04LX, UTM_30LX)}


@dataclass(slots=True)
class ScipFaults:
    """What goes wrong; set it at any time.

    Attributes:
        silent: Nothing leaves the scanner, though it goes on working.
        deaf: What the host sends is lost.
        noise: These bytes go out once, before whatever is sent next.
        bad_checksums: So many of the next scans carry a wrong check sum.
        scan_status: The next scan is replaced by this status (``50``: hardware trouble) and measuring ends.
        every_scan_status: Every scan is replaced by this status (``21``: a check) and measuring goes on.
        cut_scan_at: The next scan ends after so many bytes, without its blank line.
        frozen_timer_ms: Every time stamp reads this.
        laser_broken: BM is refused with 01, and measuring ends with 50.
        stat: The text of STAT.
        statuses: Commands by their letters (``PP``), and the status that they are answered with instead.
        bad_replies: So many of the next answers to commands have a wrong check sum.
        delay_s: Everything leaves so much later.
        bytes_per_second: How fast bytes leave; None for at once.
    """

    silent: bool = False
    deaf: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    scan_status: str | None = None
    every_scan_status: str | None = None
    cut_scan_at: int | None = None
    frozen_timer_ms: int | None = None
    laser_broken: bool = False
    stat: str = "Sensor works well."
    statuses: dict[str, str] = field(default_factory=dict)
    bad_replies: int = 0
    delay_s: float = 0.0
    bytes_per_second: float | None = None


@dataclass(frozen=True, slots=True)
class Measurement:
    """What MD, MS, ME, GD, GS or GE asks for.

    Attributes:
        first: First step.
        last: Last step, inclusive.
        cluster: Steps a value.
        width: Characters a value.
        intensity: Whether each distance is followed by its intensity.
        skip: Turns left out between two scans.
        count: Scans, None for an endless stream.
    """

    first: int
    last: int
    cluster: int
    width: int
    intensity: bool = False
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
    width, intensity = 2 if command[1] == "S" else 3, command[1] == "E"
    if command[0] == "G":
        return Measurement(first, last, cluster, width, intensity)
    return Measurement(first, last, cluster, width, intensity, int(parts[3]), int(parts[4]) or None)
