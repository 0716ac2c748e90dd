"""Firmware that drops the part of a millimetre or degree that it did not report, at every reading.

A Create counts distance and angle in whole units and starts again at zero when they are read. Firmware that
keeps the rest loses nothing; one that drops it loses half a unit a reading on the mean, 66 times a second,
and every turn below 67 degrees a second altogether. Units are those of the packets: millimetres and degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

READING_S = 0.015
"""The period of the stream (REFERENCE 1.6)."""
LAG_S = 0.1
"""How far the wheels may be behind their command. Chosen: the velocity filter ramps already."""
LEAST_MM, LEAST_DEG = 1000.0, 10.0
"""The way that must have been commanded before it is judged. Chosen: a push against a chair is shorter, and a
turn is judged before the gyro, which contradicts the counts, is blamed (``gyro.WATCH_WINDOW_S``)."""
MISSING = 0.06
"""Share of the way that is missing when fractions are dropped; 0.5 m/s lose 7 %, less speed more. The scale
of a wheel is not that wrong."""
WHOLE = 0.03
"""Share that may be missing of a base that drops nothing."""
JUDGED_AFTER, FORGOTTEN_AFTER = 3.0, 10.0
"""Multiples of the least way: when it is whole, and when what is not clear is forgotten."""
GYRO_AGREES = (0.5, 2.0)
"""The gyro's turn by the commanded one. Its scale may be wrong; a base that is blocked does not turn."""
LONGEST_STEP_S = 0.25
"""Over a longer gap the commanded speed of one moment says nothing."""


def most_likely(counted: float, commanded: float) -> float:
    """What the base did between two readings, by its command, as far as the count allows that.

    Args:
        counted: Whole units, the rest of them dropped.
        commanded: Units.
    """
    low = counted - (1.0 if counted <= 0.0 else 0.0)
    high = counted + (1.0 if counted >= 0.0 else 0.0)
    return min(max(commanded, low), high)


@dataclass(slots=True)
class Evidence:
    """What was commanded and counted since the last judgement, in one unit.

    Attributes:
        least: How much must have been commanded before anything is judged.
    """

    least: float
    _commanded: float = 0.0
    _counted: float = 0.0
    _turned: float = 0.0
    _would_drop: float = 0.0
    _fastest: float = 0.0
    _readings: int = 0
    _sign: float = 1.0

    def add(self, counted: float, rate: float, turned: float | None = None) -> None:
        """Take one reading.

        Args:
            counted: What it said.
            rate: The commanded speed in units a second.
            turned: What another sensor says about the same motion; None without one.
        """
        step = abs(rate) * READING_S
        if 0.0 < step < 1.0 and turned is None:
            return  # a base that is blocked would look the same
        if step > 0.0:
            self._sign = math.copysign(1.0, rate)
            self._readings += 1
        self._fastest = max(self._fastest, abs(rate))
        self._commanded += step
        self._would_drop += step % 1.0
        self._counted += counted * self._sign
        self._turned += step if turned is None else turned * self._sign

    def judge(self) -> bool | None:
        """Whether fractions are dropped; None as long as that is not clear. A judgement begins anew."""
        way = self._commanded
        if way < self.least:
            return None
        # The part of a unit that is kept for the next reading is not lost.
        lag, missing = self._fastest * LAG_S + 1.0, way - self._counted
        moves = GYRO_AGREES[0] <= self._turned / way <= GYRO_AGREES[1]
        # A reading drops less than one unit; a base that is blocked misses more.
        if moves and MISSING * way + lag < missing < self._readings + lag:
            found: bool | None = True
        elif missing < WHOLE * way and way > JUDGED_AFTER * self.least and self._would_drop > MISSING * way:
            found = False
        elif way > FORGOTTEN_AFTER * self.least:
            found = None
        else:
            return None
        self.clear()
        return found

    def clear(self) -> None:
        """Forget what was taken."""
        self._commanded = self._counted = self._turned = self._would_drop = self._fastest = 0.0
        self._readings = 0


class FractionWatch:
    """Finds out whether a base drops fractions, and then goes by its commands between two counts.

    Attributes:
        drops: Whether it does.
    """

    def __init__(self) -> None:
        self.drops = False
        self._distance, self._angle = Evidence(LEAST_MM), Evidence(LEAST_DEG)
        self._stamp: float | None = None

    def clear(self) -> None:
        """Forget what was seen, but not what was found out: something else moves or holds the base."""
        self._distance.clear()
        self._angle.clear()

    def look(
        self, distance_mm: float, angle_deg: float, speed: tuple[float, float], gyro_degps: float | None
    ) -> None:
        """Take what the base counted since the last reading.

        Args:
            distance_mm: Its count.
            angle_deg: Its count, counter-clockwise positive.
            speed: The commanded mm/s and degrees/s.
            gyro_degps: The turning rate by the gyro; None without one.
        """
        turned = None if gyro_degps is None else gyro_degps * READING_S
        self._distance.add(distance_mm, speed[0])
        self._angle.add(angle_deg, speed[1], turned)
        for found in (self._distance.judge(), self._angle.judge()):
            if found is not None:
                self.drops = found

    def corrected(
        self, stamp: float, distance_mm: float, angle_deg: float, speed: tuple[float, float]
    ) -> tuple[float, float]:
        """The millimetres and degrees since the last reading; the counts of a base that keeps the rest."""
        before, self._stamp = self._stamp, stamp
        if not self.drops or before is None or not 0.0 <= stamp - before <= LONGEST_STEP_S:
            return distance_mm, angle_deg
        duration = stamp - before
        return most_likely(distance_mm, speed[0] * duration), most_likely(angle_deg, speed[1] * duration)
