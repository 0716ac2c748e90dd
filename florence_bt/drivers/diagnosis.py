"""How well a device does, as plain values; the nodes turn them into diagnostic messages."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field

FREQUENCY_TOLERANCE = 0.05
"""hokuyo_node's window around the expected rate (REFERENCE 4.9)."""


class Level(enum.IntEnum):
    """The levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One line of diagnostics.

    Attributes:
        level: How bad it is.
        message: What it is, in words.
        values: Details by name.
    """

    level: Level
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def is_off(rate: float, expected: float, tolerance: float = FREQUENCY_TOLERANCE) -> bool:
    """Whether a rate lies outside of the window around the expected one."""
    return abs(rate - expected) > tolerance * expected
