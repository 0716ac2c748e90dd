"""Directions of the sensor's steps, and laser scans from rows of distances.

Angles are as the sensor gives them: counter-clockwise seen from its top, never negated. That a sensor hangs
upside down is in the transform of its frame (REFERENCE 4.11). Values below DMIN are error codes (REFERENCE
4.8).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError
from florence_bt.core.sensing import FloatArray, LaserScan
from florence_bt.drivers.hokuyo.codec import LARGEST_STEP

LARGEST_MM = (1 << 18) - 1
"""Three characters hold no more (REFERENCE 4.4)."""
SLOWEST_RPM, FASTEST_RPM = 60, 12_000
"""Chosen: a tenth of the slowest sensor's speed and five times the fastest one's (REFERENCE 4.1)."""


@dataclass(frozen=True, slots=True)
class SensorGeometry:
    """The numbers of the PP reply.

    Attributes:
        minimum_mm: DMIN, the smallest distance that is a measurement.
        maximum_mm: DMAX, the largest.
        steps_per_turn: ARES, steps in a full circle.
        first_step: AMIN, the first step that can be measured.
        last_step: AMAX, the last one, inclusive.
        front_step: AFRT, the step that looks along the x axis.
        rpm: SCAN, turns a minute.

    Source: REFERENCE 4.1, 4.5.
    """

    minimum_mm: int
    maximum_mm: int
    steps_per_turn: int
    first_step: int
    last_step: int
    front_step: int
    rpm: int

    @staticmethod
    def from_information(fields: Mapping[str, str]) -> SensorGeometry:
        """Read the fields of a PP reply.

        Raises:
            FrameError: A field is missing, no number, or the numbers cannot be right.
        """
        tags = ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN")
        missing = [tag for tag in tags if not fields.get(tag, "").isdecimal()]
        if missing:
            raise FrameError(f"the reply to PP has no number for {', '.join(missing)}")
        geometry = SensorGeometry(*(int(fields[tag]) for tag in tags))
        sane = (
            geometry.minimum_mm < geometry.maximum_mm <= LARGEST_MM
            and geometry.first_step <= geometry.front_step <= geometry.last_step
            and geometry.last_step - geometry.first_step < geometry.steps_per_turn <= LARGEST_STEP + 1
            and SLOWEST_RPM <= geometry.rpm <= FASTEST_RPM
        )
        if not sane:
            raise FrameError(f"the numbers of the PP reply cannot be right: {geometry}")
        return geometry

    def is_blind(self, distances_mm: NDArray[np.int32]) -> bool:
        """Tell whether none of these is a distance: they are error codes, or beyond DMAX."""
        return not np.any((distances_mm >= self.minimum_mm) & (distances_mm <= self.maximum_mm))

    @property
    def step_angle(self) -> float:
        """Radians between two steps."""
        return 2.0 * math.pi / self.steps_per_turn

    @property
    def scan_period(self) -> float:
        """Seconds a turn."""
        return 60.0 / self.rpm

    @property
    def time_increment(self) -> float:
        """Seconds between two steps."""
        return self.scan_period / self.steps_per_turn

    def angle_of(self, step: int) -> float:
        """Return the direction of a step in radians, zero ahead."""
        return (step - self.front_step) * self.step_angle

    def step_at(self, angle: float) -> int:
        """Return the step that looks nearest to an angle, clipped to what the sensor can measure."""
        step = self.front_step + round(angle / self.step_angle)
        return min(max(step, self.first_step), self.last_step)


URG_04LX = SensorGeometry(20, 5600, 1024, 44, 725, 384, 600)
"""Hokuyo URG-04LX (REFERENCE 4.1)."""

UTM_30LX = SensorGeometry(23, 60000, 1440, 0, 1080, 540, 2400)
"""Hokuyo UTM-30LX (REFERENCE 4.1)."""


def scan_from_distances(
    distances_mm: NDArray[np.int32],
    start_step: int,
    cluster: int,
    geometry: SensorGeometry,
    stamp: float,
    frame_id: str,
    *,
    skip: int = 0,
    intensities: NDArray[np.int32] | None = None,
) -> LaserScan:
    """Make a laser scan of what the sensor measured.

    Error codes (values below DMIN) pass through as a few millimetres, below ``range_min``, so that consumers
    drop them as they drop every range that is too small.

    Args:
        distances_mm: Shape (n,), millimetres, one a cluster.
        start_step: Step of the first value.
        cluster: Steps a value stands for; 0 and 1 both mean one.
        geometry: The sensor's numbers.
        stamp: Time of the first beam in seconds.
        frame_id: The sensor's frame.
        skip: Turns left out between two scans.
        intensities: Shape (n,), device units, or none.

    Source: REFERENCE 4.8, 4.9.
    """
    steps = max(1, cluster)
    return LaserScan(
        stamp=stamp,
        frame_id=frame_id,
        angle_min=geometry.angle_of(start_step),
        angle_increment=geometry.step_angle * steps,
        range_min=geometry.minimum_mm / 1000.0,
        range_max=geometry.maximum_mm / 1000.0,
        ranges=np.asarray(distances_mm, np.float32) / np.float32(1000.0),
        time_increment=geometry.time_increment * steps,
        scan_time=geometry.scan_period * (skip + 1),
        intensities=np.asarray(() if intensities is None else intensities, np.float32),
    )


@dataclass(frozen=True, slots=True)
class MultiEchoScan(LaserScan):
    """A laser scan of the first echoes, with all echoes of each beam; the first is the nearest.

    Attributes:
        echoes: Shape (n, k), metres; NaN from a beam's last echo on.
        echo_intensities: Shape (n, k) likewise, device units; (n, 0) without intensities.
    """

    echoes: FloatArray = field(default_factory=lambda: np.empty((0, 0), np.float32))
    echo_intensities: FloatArray = field(default_factory=lambda: np.empty((0, 0), np.float32))


def with_echoes(
    scan: LaserScan, echoes_mm: NDArray[np.int32], intensities: NDArray[np.int32]
) -> MultiEchoScan:
    """Add all echoes to the scan of the first ones.

    Args:
        scan: Of the first echoes, n beams.
        echoes_mm: Shape (n, k), millimetres, -1 where there is none.
        intensities: Shape (n, k) likewise, or (n, 0).
    """
    metres = np.where(echoes_mm < 0, np.nan, echoes_mm / 1000.0).astype(np.float32)
    strengths = np.where(intensities < 0, np.nan, intensities).astype(np.float32)
    known = {part.name: getattr(scan, part.name) for part in fields(scan)}
    return MultiEchoScan(**known, echoes=metres, echo_intensities=strengths)


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
    """Return the codes of a sensor.

    Args:
        model: MODL of the sensor.
        maximum_mm: DMAX of the sensor.
    """
    return UTM_ERRORS if "UTM" in model or maximum_mm > LONG_RANGE_MM else URG_ERRORS


BEYOND = "farther than the sensor measures"
_BEYOND = -1
"""Stands for every distance beyond DMAX; no code of a sensor is negative."""


def summarise(distances_mm: NDArray[np.int32], geometry: SensorGeometry, errors: Mapping[int, str]) -> str:
    """Return how many values are no distances (codes, beyond DMAX), and what most of them are, in words."""
    beyond = distances_mm > geometry.maximum_mm
    codes = np.where(beyond, _BEYOND, distances_mm)[beyond | (distances_mm < geometry.minimum_mm)]
    if not len(codes):
        return f"0 of {len(distances_mm)}"
    numbers, counts = np.unique(codes, return_counts=True)
    often = int(numbers[counts.argmax()])
    name = BEYOND if often == _BEYOND else errors.get(often, f"code {often}")
    return f"{len(codes)} of {len(distances_mm)}, mostly: {name}"
