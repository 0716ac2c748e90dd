"""What the sensors said last during a calibration."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from florence_bt.core.geometry import angle_difference


class Source(enum.Enum):
    """Who tells where the robot looks."""

    WALL = "scan of the wall"
    ODOMETRY = "odometry"
    GYRO = "gyro"


@dataclass(frozen=True, slots=True)
class Reading:
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
    """

    scales: Mapping[Source, float] = field(default_factory=dict)
    newest: dict[Source, Reading] = field(default_factory=dict)
    turned: float = 0.0
    no_wall: str = "no scan has come"
    _raw: dict[Source, float] = field(default_factory=dict)

    def take(self, source: Source, stamp: float, angle: float) -> None:
        """Note a reading; older than the newest, or no number, is dropped."""
        before = self.newest.get(source)
        if not math.isfinite(angle) or (before is not None and stamp <= before.stamp):
            return
        if source is Source.WALL:
            self.no_wall = ""
        if before is None or source is Source.WALL:
            self.newest[source] = Reading(stamp, angle)
        else:
            turn = angle_difference(angle, self._raw[source]) * self.scales.get(source, 1.0)
            self.newest[source] = Reading(stamp, before.angle + turn)
            if source is Source.ODOMETRY:
                self.turned += turn
        self._raw[source] = angle

    def begin_turn(self) -> None:
        """Count the turn from here."""
        self.turned = 0.0

    def behind(self, moment: float, sources: tuple[Source, ...]) -> list[Source]:
        """The sources that have not spoken since a moment."""
        return [s for s in sources if s not in self.newest or self.newest[s].stamp < moment]
