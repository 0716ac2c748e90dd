"""Lets pictures through at most at a given rate, judged by their own stamps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.limits import Positive, check_limits

TOLERANCE = 0.1
"""A picture may come this part of a period early, so that a camera that jitters loses none."""


@dataclass(frozen=True, slots=True)
class ThrottleParameters:
    """Parameters of the throttle.

    Attributes:
        max_rate: Most pictures per second; the old system had 20 Hz before its nodelet (REFERENCE 6.1).
    """

    max_rate: Positive = 20.0

    def __post_init__(self) -> None:
        check_limits(self)


class Throttle:
    """Remembers when it last let something through."""

    def __init__(self, parameters: ThrottleParameters | None = None) -> None:
        self._period = (1.0 - TOLERANCE) / (parameters or ThrottleParameters()).max_rate
        self._last = -math.inf

    def admits(self, stamp: float) -> bool:
        """Whether something with this stamp, in seconds, may pass. Stamps that jump back start again."""
        if 0.0 <= stamp - self._last < self._period:
            return False
        self._last = stamp
        return True
