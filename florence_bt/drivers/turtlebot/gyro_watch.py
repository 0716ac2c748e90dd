"""Finds a gyro whose rest offset has moved away: it turns while the wheels go straight."""

from __future__ import annotations

from collections import deque

WINDOW_S = 3.0
"""Wheels that slip along a wall let the base turn too, but not for so long."""

BROKEN_RADPS, BROKEN_WINDOW_S = 2.0, 0.5
"""No slip turns the base that fast: a gyro that says so has lost its power or its wire."""

STRAIGHT_RADPS = 0.1
"""Wheels that turn the base slower than this, on the mean, go straight. In turns an error of the gyro's scale
would look the same as a moved offset."""

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
            Whether gyro and wheels differ too much over a whole window of straight driving.
        """
        if self._limit_radps <= 0.0:
            return False
        if self._steps and not 0.0 <= stamp - self._steps[-1][0] <= LONGEST_GAP_S:
            self._steps.clear()
        self._steps.append((stamp, gyro_radps, wheel_turn_rad))
        while stamp - self._steps[0][0] > WINDOW_S:
            self._steps.popleft()
        return self._differs(WINDOW_S, self._limit_radps) or self._differs(BROKEN_WINDOW_S, BROKEN_RADPS)

    def _differs(self, window_s: float, limit_radps: float) -> bool:
        newest = self._steps[-1][0]
        if newest - self._steps[0][0] < 0.9 * window_s:
            return False
        # Only the newest reading decides whether it is worth to look at all of them.
        if abs(self._steps[-1][1]) < limit_radps / 2.0:
            return False
        steps = [step for step in self._steps if newest - step[0] <= window_s]
        duration = newest - steps[0][0]
        wheels = sum(step[2] for step in steps) / duration
        gyro = sum(step[1] for step in steps) / len(steps)
        return abs(wheels) < STRAIGHT_RADPS and abs(gyro - wheels) > limit_radps
