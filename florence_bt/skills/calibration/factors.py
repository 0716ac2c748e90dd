"""Reports of the sensors during a calibration, and the factors that follow from them (REFERENCE 3.3)."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from florence_bt.core.geometry import angle_difference


class Source(enum.Enum):
    """The sources that measure where the robot looks."""

    WALL = "scan of the wall"
    ODOMETRY = "odometry"
    GYRO = "gyro"


@dataclass(frozen=True, slots=True)
class Direction:
    """A direction at a moment.

    Attributes:
        stamp: Seconds.
        angle: Radians, counter-clockwise.
    """

    stamp: float
    angle: float


@dataclass(slots=True)
class Readings:
    """The newest reading of each source, and how far the odometry turned.

    Attributes:
        scales: Factors on the turns of a source that earlier rounds found.
        newest: By source, scaled; the angle counts on from the first one.
        turned: Summed signed turn of the odometry since :meth:`begin_turn`, radians.
        no_wall: Why the last scan showed no wall; empty when it did.
        scanned: The time of the last scan, whatever it showed, seconds.
    """

    scales: Mapping[Source, float] = field(default_factory=dict)
    newest: dict[Source, Direction] = field(default_factory=dict)
    turned: float = 0.0
    no_wall: str = "no scan has come"
    scanned: float = -math.inf
    _raw: dict[Source, float] = field(default_factory=dict)

    def take(self, source: Source, stamp: float, angle: float) -> None:
        """Note a reading; older than the newest, or no number, is dropped."""
        before = self.newest.get(source)
        if not math.isfinite(angle) or (before is not None and stamp <= before.stamp):
            return
        if source is Source.WALL:
            self.no_wall, self.scanned = "", stamp
        if before is None or source is Source.WALL:
            self.newest[source] = Direction(stamp, angle)
        else:
            turn = angle_difference(angle, self._raw[source]) * self.scales.get(source, 1.0)
            self.newest[source] = Direction(stamp, before.angle + turn)
            if source is Source.ODOMETRY:
                self.turned += turn
        self._raw[source] = angle

    def take_no_wall(self, stamp: float, why: str) -> None:
        """Note a scan that shows no wall."""
        self.no_wall, self.scanned = why, stamp

    def begin_turn(self) -> None:
        """Count the turn from here."""
        self.turned = 0.0

    def behind(self, moment: float, sources: tuple[Source, ...]) -> list[Source]:
        """Return the sources that have not spoken since a moment."""
        return [s for s in sources if s not in self.newest or self.newest[s].stamp < moment]


GYRO_PARAMETER = "gyro_scale_correction"
ODOMETRY_PARAMETER = "odom_angular_scale_correction"


@dataclass(frozen=True, slots=True)
class MeasuredTurn:
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
    """The factors for the parameters of the base.

    Attributes:
        odometry: For ``odom_angular_scale_correction``.
        gyro: For ``gyro_scale_correction``; None without a gyro.
        turns: The measurements.
    """

    odometry: float
    gyro: float | None
    turns: tuple[MeasuredTurn, ...]

    def near(self, tolerance: float) -> bool:
        """Tell whether every factor is that close to 1."""
        return all(abs(f - 1.0) <= tolerance for f in (self.odometry, self.gyro) if f is not None)

    def by_parameter(self) -> dict[str, float]:
        """Map each parameter of ``turtlebot_node`` to its factor."""
        factors = {} if self.gyro is None else {GYRO_PARAMETER: self.gyro}
        return {**factors, ODOMETRY_PARAMETER: self.odometry}


def measure_turn(
    speed: float, start: Mapping[Source, Direction], end: Mapping[Source, Direction], drift: float | None
) -> MeasuredTurn:
    """Compute a turn of about 360 degrees from the readings before and after it.

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
    return MeasuredTurn(speed, angles[Source.WALL], angles[Source.ODOMETRY], gyro)


def factors_from_turns(turns: Sequence[MeasuredTurn]) -> Factors:
    """Compute the factors from all turns.

    Source: REFERENCE 3.3, steps 2f and 3.
    """
    odometry = len(turns) / sum(turn.odometry / turn.wall for turn in turns)
    seen = [turn.gyro / turn.wall for turn in turns if turn.gyro is not None]
    return Factors(odometry, len(seen) / sum(seen) if seen else None, tuple(turns))
