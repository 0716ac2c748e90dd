"""Firmware that drops the part of a millimetre or degree that it did not report, at every reading.

A Create counts distance and angle in whole units and starts again at zero when they are read. Firmware that
keeps the rest loses nothing; one that drops it loses half a unit a reading on the mean, 66 times a second,
and every turn below 67 degrees a second altogether. Units are those of the packets: millimetres and degrees.
"""

from __future__ import annotations

import math

READING_S = 0.015
"""The period of the stream (REFERENCE 1.6)."""
STEADY_S, STEADY_SHARE = 0.3, 0.1
"""Only a speed that was commanded for so long, within this share, counts: then the wheels have it, too."""
LEAST_MM = 1000.0
"""The way that must have been driven before it is judged. Chosen: a push against a chair is shorter."""
MISSING, WHOLE = 0.06, 0.03
"""Shares of the way. At 0.5 m/s dropping loses 7 %, below that more; no wheel's scale is that wrong."""
JUDGED_AFTER, FORGOTTEN_AFTER = 3.0, 10.0
"""Multiples of the least way: when it is whole, and when what is not clear is forgotten."""
LEAST_DEG = 15.0
"""Of a turn. Chosen: it is judged before the gyro, which contradicts the counts, is blamed
(``gyro.WATCH_WINDOW_S``)."""
SLOW_DEGPS = 60.0
"""A turn below it counts hardly anything when fractions are dropped, and everything otherwise."""
HARDLY_COUNTED, COUNTED = 0.3, 0.6
"""Shares of what the gyro says."""
GYRO_AGREES = (0.5, 2.0)
"""The gyro's turn by the commanded one. Its scale may be wrong; a base that is blocked does not turn."""
LONGEST_STEP_S = 0.25
"""Over a longer gap the commanded speed of one moment says nothing."""


def most_likely(counted: float, commanded: float) -> float:
    """Estimate what the base did between two readings, by its command, as far as the count allows that.

    Args:
        counted: Whole units, the rest of them dropped.
        commanded: Units.
    """
    low = counted - (1.0 if counted <= 0.0 else 0.0)
    high = counted + (1.0 if counted >= 0.0 else 0.0)
    return min(max(commanded, low), high)


class DistanceEvidence:
    """The distances commanded and counted at steady speeds, in millimetres."""

    def __init__(self) -> None:
        self._speed = 0.0
        self._steady_s = 0.0
        self.clear()

    def look(self, counted: float, speed: float) -> bool | None:
        """Take one reading.

        Args:
            counted: What it said.
            speed: The commanded one, in mm/s.

        Returns:
            Whether fractions are dropped; None as long as that is not clear. A judgement begins anew.
        """
        if abs(speed - self._speed) > STEADY_SHARE * abs(self._speed):
            self._speed, self._steady_s = speed, 0.0
        self._steady_s += READING_S
        step = abs(speed) * READING_S
        if self._steady_s < STEADY_S or step < 1.0:
            return None  # below, a base that is blocked would look the same
        self._commanded += step
        self._counted += counted if speed > 0.0 else -counted
        self._would_drop += step % 1.0
        self._readings += 1
        return self._judge()

    def _judge(self) -> bool | None:
        way, missing = self._commanded, self._commanded - self._counted
        if way < LEAST_MM:
            return None
        # A reading drops less than one unit; a base that is blocked misses more.
        if MISSING * way < missing < self._readings:
            found: bool | None = True
        elif missing < WHOLE * way and way > JUDGED_AFTER * LEAST_MM and self._would_drop > MISSING * way:
            found = False
        elif way > FORGOTTEN_AFTER * LEAST_MM:
            found = None
        else:
            return None
        self.clear()
        return found

    def clear(self) -> None:
        """Forget what was taken."""
        self._commanded = self._counted = self._would_drop = 0.0
        self._readings = 0


class TurnEvidence:
    """The angles commanded, counted and measured by the gyro in slow turns, in degrees."""

    def __init__(self) -> None:
        self.clear()

    def look(self, counted: float, rate: float, gyro: float) -> bool | None:
        """Take one reading.

        Args:
            counted: What it said.
            rate: The commanded one, in degrees/s.
            gyro: What the gyro says, in degrees/s.

        Returns:
            Whether fractions are dropped; None as long as that is not clear. A judgement begins anew.
        """
        if rate == 0.0 or max(abs(rate), abs(gyro)) > SLOW_DEGPS:
            return None
        sign = math.copysign(1.0, rate)
        self._commanded += abs(rate) * READING_S
        self._turned += gyro * READING_S * sign
        self._counted += counted * sign
        if self._turned < LEAST_DEG:
            return None
        counts, agrees = self._counted / self._turned, self._turned / self._commanded
        self.clear()
        if not GYRO_AGREES[0] <= agrees <= GYRO_AGREES[1] or HARDLY_COUNTED < counts < COUNTED:
            return None
        return counts < COUNTED

    def clear(self) -> None:
        """Forget what was taken."""
        self._commanded = self._counted = self._turned = 0.0


class FractionWatch:
    """Finds out whether a base drops fractions, and then goes by its commands between two counts.

    Attributes:
        drops: Whether it does.
    """

    def __init__(self) -> None:
        self.drops = False
        self._distance, self._angle = DistanceEvidence(), TurnEvidence()
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
        found = self._distance.look(distance_mm, speed[0])
        if gyro_degps is not None and found is None:
            found = self._angle.look(angle_deg, speed[1], gyro_degps)
        if found is not None:
            self.drops = found

    def corrected(
        self, stamp: float, distance_mm: float, angle_deg: float, speed: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the mm and degrees since the last reading; the counts if the base keeps the rest."""
        before, self._stamp = self._stamp, stamp
        if not self.drops or before is None or not 0.0 <= stamp - before <= LONGEST_STEP_S:
            return distance_mm, angle_deg
        duration = stamp - before
        return most_likely(distance_mm, speed[0] * duration), most_likely(angle_deg, speed[1] * duration)
