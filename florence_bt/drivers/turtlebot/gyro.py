"""The single-axis rate gyro on the Create's analog pin: its rest offset, rate and heading (REFERENCE 1.8).

:class:`GyroWatch` finds a rest offset that has moved away.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Limits, check_order
from florence_bt.drivers.turtlebot.codec.packets import USER_ANALOG_INPUT


@dataclass(frozen=True, slots=True)
class GyroParameters(CheckedParameters):
    """The parameters that make a rate of counts.

    Attributes:
        measurement_range_degps: Range of the part: 150, 250 or 300 degrees/s.
        scale_correction: Calibrated factor on the rate, 0 to 6.
        rest_samples: How many samples at rest the offset is the mean of.
        first_offset_after: Samples at rest before there is an offset at all.
        settle_s: Rest counts only after this time: a base that is commanded to stop rolls for a moment.
        drift_counts: The offset is learnt again when the newest samples at rest differ by more than this.
        lowest_offset: A lower offset, in counts, means a gyro without power: there is no reading then.
    """

    measurement_range_degps: Annotated[float, Limits(0.0, 300.0, above=True)] = 150.0
    scale_correction: Annotated[float, Limits(0.0, 6.0)] = 1.35
    rest_samples: int = 1000
    first_offset_after: Annotated[int, Limits(1)] = 33
    settle_s: float = 0.5
    drift_counts: float = 4.0
    lowest_offset: float = 100.0

    def _check(self) -> None:
        check_order(self, ("first_offset_after", "rest_samples"), equal=True)


@dataclass(frozen=True, slots=True)
class GyroReading:
    """The reading of the gyro.

    Attributes:
        rate: rad/s, counter-clockwise positive.
        yaw: Heading integrated from the rate, radians, not wrapped.
        offset: The rest offset in counts.
        resting: The base has settled at rest, so the rate is only noise.
        raw_rate: rad/s with the offset that was known first: what the gyro drifts since then stays in it.
        raw_yaw: Heading integrated from the raw rate.
        legacy_raw_rate: rad/s by the old node's formula for ``imu/raw``: no offset, divided by the range.
        legacy_raw_yaw: The heading before this sample, and one step of the legacy rate.
    """

    rate: float
    yaw: float
    offset: float
    resting: bool
    raw_rate: float
    raw_yaw: float
    legacy_raw_rate: float
    legacy_raw_yaw: float


class RestOffset:
    """The mean of the newest samples that were taken at rest."""

    def __init__(self, parameters: GyroParameters) -> None:
        self._parameters = parameters
        self._samples: deque[int] = deque()
        self._sum = 0
        self._recent: deque[int] = deque(maxlen=parameters.first_offset_after)
        self._resting_since: float | None = None
        self.resting = False

    def update(self, stamp: float, adc: int, at_rest: bool) -> None:
        """Take one sample.

        Args:
            stamp: Seconds.
            adc: Counts, 0 to 1023.
            at_rest: The wheels are commanded to stand still and do.
        """
        if not at_rest:
            self._resting_since = None
        elif self._resting_since is None or stamp < self._resting_since:
            self._resting_since = stamp
        self.resting = (
            self._resting_since is not None and stamp - self._resting_since >= self._parameters.settle_s
        )
        if self.resting:
            self._samples.append(adc)
            self._recent.append(adc)
            self._sum += adc
            if len(self._samples) > self._parameters.rest_samples:
                self._sum -= self._samples.popleft()
            self._follow_drift()

    def forget(self) -> None:
        """Forget the offset: it is learnt again after the base has settled."""
        self._samples.clear()
        self._recent.clear()
        self._sum = 0
        self._resting_since = None
        self.resting = False

    def _follow_drift(self) -> None:
        """Let go of old samples when the newest ones say that the offset has moved."""
        if len(self._recent) < self._parameters.first_offset_after or len(self._recent) == len(self._samples):
            return
        recent = sum(self._recent)
        if abs(recent / len(self._recent) - self._sum / len(self._samples)) > self._parameters.drift_counts:
            self._samples = deque(self._recent)
            self._sum = recent

    @property
    def samples(self) -> int:
        """Count the samples that the offset is the mean of."""
        return len(self._samples)

    def value(self) -> float | None:
        """Return the counts at rest; None with too few samples (or only zeros, from a dead gyro)."""
        if len(self._samples) < self._parameters.first_offset_after or self._sum == 0:
            return None
        return self._sum / len(self._samples)


def rate_from_adc(adc: float, offset: float, parameters: GyroParameters) -> float:
    """Return the turning rate that a reading means.

    Args:
        adc: Counts, 0 to 1023.
        offset: Counts at rest, above zero.
        parameters: Range and scale.

    Returns:
        rad/s, counter-clockwise positive; a turn to the left lowers the reading.

    Source: REFERENCE 1.8.
    """
    return (
        -(adc - offset)
        / offset
        * math.radians(parameters.measurement_range_degps)
        * parameters.scale_correction
    )


def legacy_raw_rate(adc: float, parameters: GyroParameters) -> float:
    """Return the old node's rate for ``imu/raw``, in rad/s: the offset stays in, and the range divides.

    Source: REFERENCE 1.8, row "imu/raw quirk".
    """
    return -(adc / parameters.measurement_range_degps) * math.radians(1.0) * parameters.scale_correction


class Gyro:
    """Learns the offset at rest and gives rate and heading from then on.

    Attributes:
        adc: The newest sample in counts, None before the first.
    """

    def __init__(self, parameters: GyroParameters | None = None) -> None:
        self._parameters = parameters or GyroParameters()
        self._rest = RestOffset(self._parameters)
        self._yaw = self._raw_yaw = 0.0
        self._first_offset: float | None = None
        self._stamp: float | None = None
        self.adc: int | None = None

    @property
    def offset(self) -> float | None:
        """The rest offset in counts, also one that is too low to be of use; None before it is known."""
        return self._rest.value()

    @property
    def rest_samples(self) -> int:
        """Count the samples at rest that the offset is the mean of."""
        return self._rest.samples

    @property
    def calibrated(self) -> bool:
        """Tell whether the base has rested long enough to know the offset, be it of use or not."""
        return self._rest.samples >= self._parameters.first_offset_after

    def recalibrate(self) -> None:
        """Forget the rest offset: it is learnt again at rest."""
        self._rest.forget()

    def update(self, stamp: float, adc: int, at_rest: bool) -> GyroReading | None:
        """Take one sample.

        Args:
            stamp: Seconds.
            adc: Counts of the user analog input, 0 to 1023.
            at_rest: The wheels are commanded to stand still and do.

        Returns:
            The reading, or None before the base has rested long enough to know the offset, from a gyro
            without power, and for more counts than there are.
        """
        self.adc = adc
        if not USER_ANALOG_INPUT.is_plausible(adc):
            self._stamp = None
            return None
        self._rest.update(stamp, adc, at_rest)
        offset = self._rest.value()
        if offset is None or offset < self._parameters.lowest_offset:
            self._stamp = None
            return None
        if self._first_offset is None:
            self._first_offset = offset
        duration = 0.0 if self._stamp is None else max(0.0, stamp - self._stamp)
        self._stamp = stamp
        rate = rate_from_adc(adc, offset, self._parameters)
        raw_rate = rate_from_adc(adc, self._first_offset, self._parameters)
        legacy_rate = legacy_raw_rate(adc, self._parameters)
        legacy_yaw = self._yaw + legacy_rate * duration
        self._yaw += rate * duration
        self._raw_yaw += raw_rate * duration
        return GyroReading(
            rate, self._yaw, offset, self._rest.resting, raw_rate, self._raw_yaw, legacy_rate, legacy_yaw
        )


WATCH_WINDOW_S = 3.0
"""Wheels that slip along a wall let the base turn too, but not for this long."""

STRAIGHT_RADPS = 0.1
"""Wheels that turn the base slower than this, on the mean, go straight. In turns an error of the gyro's scale
would look the same as a moved offset."""

BROKEN_RADPS, BROKEN_WINDOW_S = 2.0, 0.5
"""No slip turns the base that fast: a gyro that says so has lost its power or its wire. In turns it must also
be wrong by more than the whole turn: no scale is that wrong."""

LONGEST_WATCH_GAP_S = 0.25
"""Over a longer gap between two readings the comparison begins anew; chosen."""
HAIR_RADPS = 1e-6
"""More than what additions and subtractions of some thousand readings are off by."""


class GyroWatch:
    """Compares gyro and wheels over the last seconds."""

    def __init__(self, limit_radps: float) -> None:
        """Take the limit.

        Args:
            limit_radps: How much they may differ on the mean; 0 for any.
        """
        self._limit_radps = limit_radps
        self._steps: deque[tuple[float, float, float]] = deque()
        self._turned = 0.0

    def clear(self) -> None:
        """Forget all readings."""
        self._steps.clear()
        self._turned = 0.0

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
        if self._steps and not 0.0 <= stamp - self._steps[-1][0] <= LONGEST_WATCH_GAP_S:
            self.clear()
        self._steps.append((stamp, gyro_radps, wheel_turn_rad))
        self._turned += wheel_turn_rad
        while stamp - self._steps[0][0] > WATCH_WINDOW_S:
            self._turned -= self._steps.popleft()[2]
        drifts = self._difference(WATCH_WINDOW_S, self._limit_radps) if self._goes_straight() else None
        if drifts is not None and abs(drifts[0]) < STRAIGHT_RADPS and drifts[1] > self._limit_radps:
            return True
        breaks = self._difference(BROKEN_WINDOW_S, BROKEN_RADPS)
        return breaks is not None and breaks[1] > max(BROKEN_RADPS, abs(breaks[0]))

    def _goes_straight(self) -> bool:
        """Tell whether the wheels may go straight, by a running sum, which is off by a hair."""
        duration = self._steps[-1][0] - self._steps[0][0]
        return abs(self._turned) <= (STRAIGHT_RADPS + HAIR_RADPS) * duration

    def _difference(self, window_s: float, limit_radps: float) -> tuple[float, float] | None:
        """Return the mean rate by the wheels, and the gyro's distance from it; None when of no interest.

        Args:
            window_s: How far back to look; None comes back when the readings do not reach so far.
            limit_radps: When the newest reading of the gyro is below half of it, the rest is not looked at.
        """
        newest, gyro_now = self._steps[-1][:2]
        if newest - self._steps[0][0] < 0.9 * window_s or abs(gyro_now) < limit_radps / 2.0:
            return None
        wheels = gyro = 0.0
        first, count = newest, 0
        for stamp, rate, turn in self._steps:
            if newest - stamp <= window_s:
                first = stamp if count == 0 else first
                wheels, gyro, count = wheels + turn, gyro + rate, count + 1
        wheels, gyro = wheels / (newest - first), gyro / count
        return wheels, abs(gyro - wheels)
