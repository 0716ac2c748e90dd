"""Models of scanners for the emulator, their faults, and the reading of a measurement command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

ARGUMENT_LENGTHS = (
    dict.fromkeys(("VV", "PP", "II", "BM", "QT", "RS", "RT", "RB", "%SL", "%ST"), 0)
    | {"TM": 1, "HS": 1, "CR": 2, "SS": 6}
    | dict.fromkeys(("GD", "GS", "GE", "HD", "HE"), 10)
    | dict.fromkeys(("MD", "MS", "ME", "ND", "NE"), 13)
)
"""Characters that follow the letters of a command (REFERENCE 4.6, 4.7)."""

ALLOWED_IN_TIME_MODE = ("TM", "II", "VV", "%ST")
"""Everything else is refused there; state and version may be asked for at any time."""

BIT_RATES = ("019200", "038400", "057600", "115200", "250000", "500000", "750000")

COMMON = frozenset({"VV", "PP", "II", "BM", "QT", "RS", "RB", "TM", "SS", "HS", "MD", "MS", "GD", "GS"})


@dataclass(frozen=True, slots=True)
class ScannerModel:
    """The device by its labels and tables.

    Attributes:
        name: What people call it.
        version: The fields of VV.
        parameters: The fields of PP.
        outermost_step: The last step that a command may name.
        commands: What it understands.
        no_measurement: The code of a step that it cannot see (REFERENCE 4.8).
        healthy: STAT while it is well.
        denies_time_mode: While it measures, TM is refused with 10, and in time mode QT is too; RS ends both.
    """

    name: str
    version: Mapping[str, str]
    parameters: Mapping[str, str]
    outermost_step: int
    commands: frozenset[str]
    no_measurement: int
    healthy: str = "Sensor works well."
    denies_time_mode: bool = False

    def number(self, tag: str) -> int:
        """Return a numeric field of PP."""
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
    "Stable 000 no error.",
)
"""Source: REFERENCE 4.1; STAT as urg_node knows it. Its firmware and its serial number are made up."""

UTM_30LX_EW = replace(
    UTM_30LX,
    name="utm-30lx-ew",
    version={**UTM_30LX.version, "PROD": "UTM-30LX-EW", "FIRM": "1.1.0(30/Sep./2011)", "PROT": "SCIP 2.2"},
    parameters={**UTM_30LX.parameters, "MODL": "UTM-30LX-EW"},
    commands=UTM_30LX.commands | {"ND", "NE", "HD", "HE"},
    denies_time_mode=True,
)
"""The UTM-30LX with Ethernet. Source: the simulator of urg_stamped; for every echo, urg_library."""

UST_10LX = ScannerModel(
    "ust-10lx",
    {
        "VEND": "Hokuyo Automatic Co., Ltd.",
        "PROD": "UST-10LX",
        "FIRM": "1.0.0(2014-01-31)",
        "PROT": "SCIP 2.2",
        "SERI": "H1400001",
    },
    {**UTM_30LX.parameters, "MODL": "UST-10LX", "DMIN": "20", "DMAX": "30000"},
    1080,
    UTM_30LX.commands - {"MS", "GS", "SS", "HS"},
    65533,
    "sensor is working normally",
    True,
)
"""Source: the simulator of urg_stamped, and scans of urg_node; nobody has held one against it."""

UST_20LX = replace(
    UST_10LX,
    name="ust-20lx",
    version={**UST_10LX.version, "PROD": "UST-20LX"},
    parameters={**UST_10LX.parameters, "MODL": "UST-20LX", "DMAX": "60000"},
)

MODELS = {model.name: model for model in (URG_04LX, UTM_30LX, UTM_30LX_EW, UST_10LX, UST_20LX)}


@dataclass(slots=True)
class ScipFaults:
    """The faults; set it at any time.

    Attributes:
        silent: Nothing leaves the scanner, though it goes on working.
        commands_lost: What the host sends is lost.
        noise: These bytes go out once, before whatever is sent next.
        bad_checksums: So many of the next scans carry a wrong check sum.
        scan_status: The next scan is replaced by this status (``50``: hardware trouble) and measuring ends.
        every_scan_status: Every scan is replaced by this status (``21``: a check) and measuring goes on.
        cut_scan_at: The next scan ends after so many bytes, without its blank line.
        frozen_timer_ms: Every time stamp reads this.
        laser_broken: BM is refused with 01, and measuring ends with 50.
        stat: The text of STAT; None for the model's healthy one.
        statuses: Commands by their letters (``PP``), and the status that they are answered with instead.
        bad_replies: So many of the next answers to commands have a wrong checksum.
        delay_s: Everything leaves so much later.
        bytes_per_second: How fast bytes leave; None for at once.
    """

    silent: bool = False
    commands_lost: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    scan_status: str | None = None
    every_scan_status: str | None = None
    cut_scan_at: int | None = None
    frozen_timer_ms: int | None = None
    laser_broken: bool = False
    stat: str | None = None
    statuses: dict[str, str] = field(default_factory=dict)
    bad_replies: int = 0
    delay_s: float = 0.0
    bytes_per_second: float | None = None


@dataclass(frozen=True, slots=True)
class ScanRequest:
    """The arguments of a measurement command.

    Attributes:
        first: First step.
        last: Last step, inclusive.
        cluster: Steps a value.
        width: Characters a value.
        intensity: Whether each distance is followed by its intensity.
        skip: Turns left out between two scans.
        count: Scans, None for an endless stream.
        every_echo: Whether a beam is answered with each of its echoes.
    """

    first: int
    last: int
    cluster: int
    width: int
    intensity: bool = False
    skip: int = 0
    count: int | None = 1
    every_echo: bool = False


def parse_measurement(command: str, arguments: str, outermost_step: int) -> ScanRequest | str:
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
    every_echo = command[0] in "HN"
    skip, count = (0, 1) if command[0] in "GH" else (int(parts[3]), int(parts[4]) or None)
    return ScanRequest(first, last, cluster, width, intensity, skip, count, every_echo)
