"""Finds a gyro whose rest offset has moved away: it turns while the wheels go straight."""

from __future__ import annotations

from collections import deque

WINDOW_S = 3.0
"""Wheels that slip along a wall let the base turn too, but not for so long."""

STRAIGHT_RADPS = 0.1
"""Wheels that turn the base slower than this, on the mean, go straight. In turns an error of the gyro's scale
would look the same as a moved offset."""

BROKEN_RADPS, BROKEN_WINDOW_S = 2.0, 0.5
"""No slip turns the base that fast: a gyro that says so has lost its power or its wire. In turns it must also
be wrong by more than the whole turn: no scale is that wrong."""

LONGEST_GAP_S = 0.25


class GyroWatch:
    """Compares gyro and wheels over the last seconds."""

    def __init__(self, limit_radps: float) -> None:
        """Take the limit.

        Args:
            limit_radps: How much they may differ on the mean; 0 for any.
        """
        self._limit_radps = limit_radps
        self._steps: deque[tuple[float, float, float]] = deque()

    def clear(self) -> None:
        """Begin anew."""
        self._steps.clear()

    def disagrees(self, stamp: float, gyro_radps: float, wheel_turn_rad: float) -> bool:
        """Take one reading.

        Args:
            stamp: Seconds.
            gyro_radps: The turning rate by the gyro.
            wheel_turn_rad: The turn by the wheels since the last reading.

        Returns:
            Whether gyro and wheels differ too much over a whole window: of straight driving, or so much that
            the gyro must be broken.
        """
        if self._limit_radps <= 0.0:
            return False
        if self._steps and not 0.0 <= stamp - self._steps[-1][0] <= LONGEST_GAP_S:
            self._steps.clear()
        self._steps.append((stamp, gyro_radps, wheel_turn_rad))
        while stamp - self._steps[0][0] > WINDOW_S:
            self._steps.popleft()
        drifts = self._difference(WINDOW_S, self._limit_radps)
        if drifts is not None and abs(drifts[0]) < STRAIGHT_RADPS and drifts[1] > self._limit_radps:
            return True
        breaks = self._difference(BROKEN_WINDOW_S, BROKEN_RADPS)
        return breaks is not None and breaks[1] > max(BROKEN_RADPS, abs(breaks[0]))

    def _difference(self, window_s: float, limit_radps: float) -> tuple[float, float] | None:
        """The mean rate by the wheels, and how far the gyro is from it; None when that is of no interest.

        Args:
            window_s: How far back to look; None comes back when the readings do not reach so far.
            limit_radps: When the newest reading of the gyro is below half of it, the rest is not looked at.
        """
        newest, gyro_now = self._steps[-1][:2]
        if newest - self._steps[0][0] < 0.9 * window_s or abs(gyro_now) < limit_radps / 2.0:
            return None
        steps = [step for step in self._steps if newest - step[0] <= window_s]
        duration = newest - steps[0][0]
        wheels = sum(step[2] for step in steps) / duration
        gyro = sum(step[1] for step in steps) / len(steps)
        return wheels, abs(gyro - wheels)
