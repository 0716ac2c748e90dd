"""The calibration round after round, until the factors are near 1 (REFERENCE 3.3, stop rule).

The base uses new factors only after its next start, so the rounds after the first one multiply what the base
says with the factors found so far: for turns that is the same.
"""

from __future__ import annotations

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.calibration.calibration import Calibration
from florence_bt.skills.calibration.factors import Factors
from florence_bt.skills.calibration.parameters import CalibrationParameters
from florence_bt.skills.calibration.readings import Source

NOT_STEADY = "not_steady"


class CalibrationRounds:
    """All rounds.

    Args:
        parameters: How to turn, and when it is enough.

    Attributes:
        current: The round that goes on; the owner puts readings into it.
        rounds: The factors of each round that is over.
        result: The end, or None.
    """

    def __init__(self, parameters: CalibrationParameters | None = None) -> None:
        self._parameters = parameters or CalibrationParameters()
        self._scales: dict[Source, float] = {}
        self.rounds: list[Factors] = []
        self.result: Result | None = None
        self.current = Calibration(self._parameters)

    @property
    def odometry(self) -> float:
        """What to multiply ``odom_angular_scale_correction`` with, all rounds together."""
        return self._scales.get(Source.ODOMETRY, 1.0)

    @property
    def gyro(self) -> float | None:
        """What to multiply ``gyro_scale_correction`` with; None without a gyro."""
        return self._scales.get(Source.GYRO, 1.0) if self._parameters.has_gyro else None

    @property
    def feedback(self) -> str:
        """What goes on, for people."""
        return f"round {len(self.rounds) + 1}: {self.current.feedback}"

    def step(self, now: float) -> Twist2:
        """Do what is due; see :meth:`Calibration.step`."""
        if self.result is not None:
            return STANDSTILL
        twist = self.current.step(now)
        if self.current.result is not None:
            self._end_round(self.current.result)
        return twist

    def _end_round(self, result: Result) -> None:
        factors = self.current.factors
        if factors is None:
            self.result = result
            return
        self.rounds.append(factors)
        self._scales[Source.ODOMETRY] = self.odometry * factors.odometry
        if factors.gyro is not None:
            self._scales[Source.GYRO] = self._scales.get(Source.GYRO, 1.0) * factors.gyro
        if factors.near(self._parameters.near):
            self.result = success()
        elif len(self.rounds) == self._parameters.rounds:
            self.result = failure(
                NOT_STEADY,
                f"after {len(self.rounds)} rounds the factors are still not within {self._parameters.near:g} "
                "of 1: the floor may be slippery, or the wall not straight",
            )
        else:
            self.current = Calibration(self._parameters, self._scales)
