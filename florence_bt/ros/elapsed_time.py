"""Time that only goes forward and never leaps, made of a clock that may be set. ROS is not known here."""

from __future__ import annotations

from collections.abc import Callable

MOST_STEP_S = 10.0
"""Between two readings of a simulated clock; what is more is a jump, unless that much time went by. Chosen: a
process that was held up misses less, and whoever sets a clock sets it by more."""
MAX_SPEED = 100.0
"""No simulation runs faster than this many times the machine's time (``--speed``)."""
SLEW = 0.01
"""A machine's clock that is corrected without being set runs faster or slower by less than this (the kernel's
limit is 500 ppm)."""
TOLERANCE_S = 0.1
"""Between reading the machine's clock and its steady one (chosen: ntpd slews errors up to 0.128 s)."""

CountedStep = Callable[[float, float], float]
"""Given a step of a clock and how much steady time has passed, the seconds that count as time."""


def machine_step(step: float, passed: float) -> float:
    """Return the length of a step of the machine's clock; if it was set, what the steady one says."""
    tolerance = TOLERANCE_S + SLEW * passed
    return step if step >= 0.0 and abs(step - passed) <= tolerance else passed


def simulated_step(step: float, passed: float) -> float:
    """Return the length of a step of a simulated clock; it may stand or run fast, not go back or leap."""
    return step if 0.0 <= step <= max(MOST_STEP_S, MAX_SPEED * passed) else 0.0


class ElapsedTime:
    """The time of a clock without its jumps. As long as there was none, both say the same.

    Attributes:
        told: What the clock said last.
        offset: What the clock is ahead: the sum of its jumps.
    """

    def __init__(self, counted: CountedStep, told: float, steady: float) -> None:
        """Begin with what the clock says.

        Args:
            counted: How much time a step of the clock is.
            told: What the clock says, seconds.
            steady: The steady time of that moment, seconds.
        """
        self._counted = counted
        self._steady = steady
        self.told = told
        self.offset = 0.0

    @property
    def now(self) -> float:
        """The time, as of the last reading."""
        return self.told - self.offset

    def read(self, told: float, steady: float) -> float:
        """Take a new reading of the clock.

        Returns:
            By how much it has jumped; zero when it has simply gone on.
        """
        step, passed = told - self.told, steady - self._steady
        jump = step - self._counted(step, passed)
        self.told, self._steady = told, steady
        self.offset += jump
        return jump

    def begin_again(self, told: float, steady: float) -> None:
        """Begin with what the clock says, as if there had been nothing before."""
        self.told, self._steady, self.offset = told, steady, 0.0
