"""Diagnoses as values; the nodes turn them into messages for ``diagnostics``."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field

DIAGNOSIS_PERIOD_S = 1.0
"""Seconds between two words of a node on how it does; one that has missed three of them counts as silent."""


class Severity(enum.IntEnum):
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

    level: Severity
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Diagnoses:
    """The word of a component on how well it does.

    Attributes:
        found: Diagnoses by what they are about.
        hardware: Which device or frame.
    """

    found: Mapping[str, Diagnosis]
    hardware: str
