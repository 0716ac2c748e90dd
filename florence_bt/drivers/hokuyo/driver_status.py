"""How the driver is, for diagnostics."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field


class Phase(enum.Enum):
    """What the driver is about."""

    STOPPED = "stopped"
    STARTING = "starting"
    MEASURING = "measuring"
    TESTING = "testing itself"
    RESTING = "resting before it starts again"


@dataclass(slots=True)
class DriverStatus:
    """A picture of the driver for diagnostics.

    Attributes:
        phase: What it is about.
        problem: The last failure, empty since the last scan.
        device: What VV told: VEND, PROD, FIRM, PROT, SERI.
        device_status: The sensor's own STAT text.
        scans: Scans received.
        corrupted: Replies with wrong check sums or layout.
        lost: How often a running stream broke.
        failures: Failures in a row, since it last measured for a while.
        pause_s: The rest after the last of them, in seconds.
    """

    phase: Phase = Phase.STOPPED
    problem: str = ""
    device: Mapping[str, str] = field(default_factory=dict)
    device_status: str = "unknown"
    scans: int = 0
    corrupted: int = 0
    lost: int = 0
    failures: int = 0
    pause_s: float = 0.0
