"""What the values below DMIN mean: error codes in the place of a distance. Source: REFERENCE 4.8."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

URG_ERRORS: Mapping[int, str] = MappingProxyType(
    {
        0: "too far (may be an echo from 22 m)",
        1: "too weak",
        2: "too weak",
        6: "other error",
        7: "error shared with the neighbour step",
        8: "difference of the two wavelengths",
        9: "error of the same step",
        **dict.fromkeys(range(10, 18), "other error"),
        18: "too strong",
        19: "not measurable",
    }
)
UTM_ERRORS: Mapping[int, str] = MappingProxyType(
    {
        1: "no object",
        2: "too near",
        3: "interference or ambient light",
        4: "out of range at the near end",
        5: "other error",
    }
)

LONG_RANGE_MM = 20000
"""Sensors that reach farther have the codes of the UTM-30LX."""


def range_errors(model: str, maximum_mm: int) -> Mapping[int, str]:
    """The codes of a sensor.

    Args:
        model: MODL of the sensor.
        maximum_mm: DMAX of the sensor.
    """
    return UTM_ERRORS if "UTM" in model or maximum_mm > LONG_RANGE_MM else URG_ERRORS


def without_codes(
    distances_mm: NDArray[np.int32], minimum_mm: int, errors: Mapping[int, str]
) -> NDArray[np.float32]:
    """Ranges as REP 117 wants them: no number where nothing was measured.

    Args:
        distances_mm: Shape (n,).
        minimum_mm: DMIN; smaller values are codes.
        errors: The sensor's codes.

    Returns:
        Shape (n,), metres: +inf for a UTM's "no object", -inf for its "too near", NaN for other codes.
    """
    ranges = np.asarray(distances_mm, np.float32) / np.float32(1000.0)
    ranges[distances_mm < minimum_mm] = np.nan
    if errors is UTM_ERRORS:
        ranges[distances_mm == 1] = np.inf
        ranges[distances_mm == 2] = -np.inf
    return ranges


def summarise(distances_mm: NDArray[np.int32], minimum_mm: int, errors: Mapping[int, str]) -> str:
    """How many values are codes, and which one is the most frequent, in words."""
    codes = distances_mm[distances_mm < minimum_mm]
    if not len(codes):
        return f"0 of {len(distances_mm)}"
    numbers, counts = np.unique(codes, return_counts=True)
    often = int(numbers[counts.argmax()])
    return f"{len(codes)} of {len(distances_mm)}, mostly: {errors.get(often, f'code {often}')}"
