"""Travel from the wheel encoders of a Create 2 (REFERENCE 1.1, 2.5)."""

from __future__ import annotations

ROUND = 65536
"""Counts after which an encoder begins again at 0."""

MOST_TICKS_TO_ZERO = 100
"""Two wheels that come to 0 at the same moment, from further away than they turn between two frames (17
counts at full speed), did not roll there: a base begins at 0 when it is switched on or reset."""


def ticks_between(before: int, after: int) -> int:
    """Counts from one reading to the next, across the wrap, by the shorter way.

    Args:
        before: 0 to 65535.
        after: 0 to 65535.
    """
    return (after - before + ROUND // 2) % ROUND - ROUND // 2


class EncoderTravel:
    """Distance and turn between readings of both encoders."""

    def __init__(self, metres_per_tick: float, wheel_separation_m: float) -> None:
        """Take the geometry.

        Args:
            metres_per_tick: Travel of a wheel per count.
            wheel_separation_m: Metres between the wheels, above zero.
        """
        self._metres_per_tick = metres_per_tick
        self._separation_m = wheel_separation_m
        self._counts: tuple[int, int] | None = None

    def update(self, left: int, right: int) -> tuple[float, float]:
        """Take a reading.

        Args:
            left: Counts of the left wheel, 0 to 65535.
            right: Counts of the right wheel.

        Returns:
            Metres forward and radians counter-clockwise since the last reading; zero at the first, and when
            the base was switched off and on meanwhile.
        """
        before, self._counts = self._counts or (left, right), (left, right)
        ticks = ticks_between(before[0], left), ticks_between(before[1], right)
        if left == right == 0 and max(map(abs, ticks)) > MOST_TICKS_TO_ZERO:
            ticks = 0, 0
        left_m, right_m = (tick * self._metres_per_tick for tick in ticks)
        return (left_m + right_m) / 2.0, (right_m - left_m) / self._separation_m
