"""Errors of a Create's own sensors: slip, calibration errors, residues and the gyro, on the true motion.

The emulator sends these numbers as bytes; the in-process rig hands them on directly, with the same noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from florence_bt.core.limits import CheckedParameters, NotNegative, Positive


class BasePlant(Protocol):
    """The moving base that is measured: physics, or a simple kinematic model."""

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        """Command the wheel speeds in m/s, forward positive; they hold until the next call."""

    def travel(self) -> tuple[float, float]:
        """Return the metres rolled by the left and the right wheel, forward positive."""

    def yaw_rate(self) -> float:
        """Return the true turning rate in rad/s, counter-clockwise positive."""

    def bumpers(self) -> tuple[bool, bool]:
        """Tell whether the left and the right bumper are pressed."""


@dataclass(frozen=True, slots=True)
class BaseNoiseParameters(CheckedParameters):
    """The errors of the sensors; all zero for a perfect base.

    Attributes:
        wheel_scale_sigma: Each wheel's scale error, drawn once: standard deviation as a fraction.
        slip_sigma: Random error of a wheel's travel: standard deviation in metres after one metre.
        wheel_separation: Metres between the wheels, as the base believes.
        gyro_offset: Counts of the gyro at rest, at the start.
        gyro_range_degps: Range of the gyro in degrees/s.
        gyro_scale: True factor on its rate.
        gyro_noise_counts: Standard deviation of each reading (REFERENCE 1.8).
        gyro_bias_walk: Drift of the offset in counts per square root of a second (REFERENCE 1.8).
    """

    wheel_scale_sigma: NotNegative = 0.005
    slip_sigma: NotNegative = 0.002
    wheel_separation: Positive = 0.260
    gyro_offset: Positive = 512.0
    gyro_range_degps: Positive = 150.0
    gyro_scale: Positive = 1.35
    gyro_noise_counts: NotNegative = 1.0
    gyro_bias_walk: NotNegative = 0.01


PERFECT_BASE = BaseNoiseParameters(
    wheel_scale_sigma=0.0, slip_sigma=0.0, gyro_noise_counts=0.0, gyro_bias_walk=0.0
)
"""No noise at all; the whole millimetres, degrees and counts remain."""

ADC_MAX = 1023
"""Largest value of a converter of 10 bits."""
INT16_MAX = 32767
"""Largest value of a signed number of 16 bits."""


class BaseSensors:
    """Measures a plant: wheel travel as whole millimetres and degrees, the turning rate as gyro counts.

    What is smaller than one unit is kept for the next reading, as in firmware that counts on.
    """

    def __init__(self, plant: BasePlant, seed: int, parameters: BaseNoiseParameters | None = None) -> None:
        """Begin to measure from where the plant is now.

        Args:
            plant: What is measured.
            seed: Same seed, same calls: same noise.
            parameters: How wrong the sensors are.
        """
        self._plant = plant
        self._parameters = parameters or BaseNoiseParameters()
        self._random = np.random.default_rng(seed)
        scale_errors = self._random.normal(0.0, self._parameters.wheel_scale_sigma, 2)
        self._scales = (1.0 + float(scale_errors[0]), 1.0 + float(scale_errors[1]))
        self._travel = plant.travel()
        self._time: float | None = None
        self._offset = self._parameters.gyro_offset
        self._distance_mm = 0.0
        self._angle_deg = 0.0

    def update(self, now: float) -> None:
        """Measure the motion since the last call.

        Args:
            now: Seconds, never less than before.
        """
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        travel = self._plant.travel()
        left = self._measure(travel[0] - self._travel[0], self._scales[0])
        right = self._measure(travel[1] - self._travel[1], self._scales[1])
        self._travel = travel
        self._distance_mm += 1000.0 * (left + right) / 2.0
        self._angle_deg += math.degrees((right - left) / self._parameters.wheel_separation)
        if elapsed > 0.0 and self._parameters.gyro_bias_walk > 0.0:
            self._offset += self._random.normal(0.0, self._parameters.gyro_bias_walk * math.sqrt(elapsed))

    def take_distance_mm(self, *, keep: bool = True) -> int:
        """Take the forward travel since the last call in whole millimetres; ``keep`` the rest."""
        whole, rest = _int16(self._distance_mm)
        self._distance_mm = rest if keep else 0.0
        return whole

    def take_angle_deg(self, *, keep: bool = True) -> int:
        """Take the turn since the last call, whole degrees, counter-clockwise positive; ``keep`` the rest."""
        whole, rest = _int16(self._angle_deg)
        self._angle_deg = rest if keep else 0.0
        return whole

    def gyro_adc(self) -> int:
        """Return the gyro's voltage as counts, 0 to 1023; a turn to the left lowers it.

        Source: REFERENCE 1.8, row "Emulator inverse".
        """
        rate_degps = math.degrees(self._plant.yaw_rate())
        full_scale = self._parameters.gyro_range_degps * self._parameters.gyro_scale
        counts = self._offset * (1.0 - rate_degps / full_scale)
        if self._parameters.gyro_noise_counts > 0.0:
            counts += self._random.normal(0.0, self._parameters.gyro_noise_counts)
        return max(0, min(ADC_MAX, round(counts)))

    def _measure(self, travel_m: float, scale: float) -> float:
        """Return what a wheel's sensor makes of its travel; a wheel at rest measures exactly nothing."""
        if travel_m == 0.0:
            return 0.0
        slip = self._parameters.slip_sigma * math.sqrt(abs(travel_m))
        return travel_m * scale + (float(self._random.normal(0.0, slip)) if slip > 0.0 else 0.0)


def _int16(value: float) -> tuple[int, float]:
    """Split into the whole part, toward zero, and the rest; what exceeds 16 bits is lost (REFERENCE 1.5)."""
    whole = math.trunc(value)
    return max(-INT16_MAX - 1, min(INT16_MAX, whole)), value - whole
