"""From the turns that were measured to the factors for the base's parameters (REFERENCE 3.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from florence_bt.core.geometry import angle_difference
from florence_bt.skills.calibration.readings import Reading, Source

GYRO_PARAMETER = "gyro_scale_correction"
ODOMETRY_PARAMETER = "odom_angular_scale_correction"


@dataclass(frozen=True, slots=True)
class Turn:
    """One whole turn as each source saw it.

    Attributes:
        speed: The speed that was asked for, rad/s.
        wall: Radians by the wall: the truth.
        odometry: Radians by the odometry.
        gyro: Radians by the gyro, drift removed; None without one.
    """

    speed: float
    wall: float
    odometry: float
    gyro: float | None

    def __str__(self) -> str:
        seen = {"wall": self.wall, "odometry": self.odometry, "gyro": self.gyro}
        return ", ".join(
            f"{name} {math.degrees(angle):.1f} deg" for name, angle in seen.items() if angle is not None
        )


@dataclass(frozen=True, slots=True)
class Factors:
    """What to multiply the parameters of the base with.

    Attributes:
        odometry: For ``odom_angular_scale_correction``.
        gyro: For ``gyro_scale_correction``; None without a gyro.
        turns: The measurements.
    """

    odometry: float
    gyro: float | None
    turns: tuple[Turn, ...]

    def near(self, tolerance: float) -> bool:
        """Whether every factor is that close to 1."""
        return all(abs(f - 1.0) <= tolerance for f in (self.odometry, self.gyro) if f is not None)

    def by_parameter(self) -> dict[str, float]:
        """Parameter of ``turtlebot_node`` -> factor."""
        factors = {} if self.gyro is None else {GYRO_PARAMETER: self.gyro}
        return {**factors, ODOMETRY_PARAMETER: self.odometry}


def measure_turn(
    speed: float, start: Mapping[Source, Reading], end: Mapping[Source, Reading], drift: float | None
) -> Turn:
    """A turn of about 360 degrees from the readings before and after it.

    Args:
        speed: What was asked for, rad/s.
        start: The readings before, by source.
        end: The readings after.
        drift: The gyro's turn at rest, rad/s; None without a gyro.

    Source: REFERENCE 3.3, step 2e.
    """
    angles = {s: math.tau + angle_difference(end[s].angle, start[s].angle) for s in end if s in start}
    gyro = None
    if drift is not None:
        lasted = end[Source.GYRO].stamp - start[Source.GYRO].stamp
        gyro = angles[Source.GYRO] - drift * lasted
    return Turn(speed, angles[Source.WALL], angles[Source.ODOMETRY], gyro)


def factors_from_turns(turns: Sequence[Turn]) -> Factors:
    """The factors from all turns.

    Source: REFERENCE 3.3, steps 2f and 3.
    """
    odometry = len(turns) / sum(turn.odometry / turn.wall for turn in turns)
    seen = [turn.gyro / turn.wall for turn in turns if turn.gyro is not None]
    return Factors(odometry, len(seen) / sum(seen) if seen else None, tuple(turns))
