"""The calibration as a state machine, round after round: readings in, velocities out (REFERENCE 3.3).

States: rest (the gyro's drift), then for each speed align, sync, rotate, return, sync. Return is ours: a base
whose odometry is wrong by a tenth has lost sight of the wall after the turn, and looks for it again. Each has
a time limit, so that a robot without a wall, or one that cannot turn, ends with a reason and stops turning.

Rounds are repeated until the factors are near 1. The base uses new factors only after its next start, so the
rounds after the first one multiply what the base reports with the factors found so far: for turns that is the
same.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import STANDSTILL, Twist2, angle_difference
from florence_bt.core.limits import CheckedParameters, Limits, Positive
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.calibration.factors import (
    Direction,
    Factors,
    MeasuredTurn,
    Readings,
    Source,
    factors_from_turns,
    measure_turn,
)


@dataclass(frozen=True, slots=True)
class CalibrationParameters(CheckedParameters):
    """The parameters of the turns, and of what counts as calibrated.

    Attributes:
        has_gyro: Whether the gyro is calibrated too (document: ``turtlebot_node/has_gyro``).
        speeds: Turning speeds of the measurements in rad/s, counter-clockwise (REFERENCE 3.3).
        initial_wall_angle: The robot looks straight at the wall when the angle is at most this, radians
            (REFERENCE 3.1: ``inital_wall_angle``).
        align_speed: Turning speed towards the wall, rad/s (REFERENCE 3.3, step 2a).
        braking: How fast a turn ends, rad/s^2: what the velocity filter allows (document, table 8).
        imu_calibrate_time: Seconds at rest to measure the gyro's drift (REFERENCE 3.3, step 1).
        settle: Every sensor must have spoken this long after a stop before it counts, seconds (step 2b).
        near: The calibration is over when both factors are within this of 1 (REFERENCE 3.3, stop rule).
        rounds: How often it is repeated at most (REFERENCE 3.3, stop rule).
        patience: How long any sensor may be silent, seconds.
    """

    has_gyro: bool = True
    speeds: tuple[float, ...] = (0.3, 0.7, 1.0, 1.5)
    initial_wall_angle: Positive = 0.1
    align_speed: Positive = 0.3
    braking: Positive = 1.0
    imu_calibrate_time: Positive = 10.0
    settle: Positive = 0.5
    near: Positive = 0.01
    rounds: Annotated[int, Limits(1, 20)] = 5
    patience: Positive = 5.0

    def _check(self) -> None:
        if not self.speeds or not all(0.05 <= speed <= 3.0 for speed in self.speeds):
            raise ConfigError(
                f"speeds is {self.speeds}", valid=("[0.3, 0.7, 1.0, 1.5], each 0.05 to 3 rad/s",)
            )


NO_WALL, NO_SENSOR, NO_TURN, BAD_TURN = "no_wall", "no_sensor", "no_turn", "bad_turn"
STEP_PERIOD_S = 0.05
"""Period of calling :meth:`Calibration.step` (REFERENCE 3.3, step 2a: 20 Hz)."""
NEW_SCAN_S = 0.5
"""An older scan says nothing about where the robot looks now: it turns on with the next one."""
ALIGN_GAIN, SLOWEST_RADPS = 0.5, 0.05
"""1/s and rad/s: the less is left, the slower it turns, and a late scan does not take it past the wall."""
CLOSE = 0.5
"""Radians: where the odometry puts the wall it is to be found within this."""
TRIES = 5
"""Times that the robot turns back to a wall that it stopped at and then does not see."""
LARGEST_ERROR = math.pi / 2
"""A source further from a whole turn than this is broken: beyond half a turn the sum is ambiguous. Nor is the
wall looked for further away."""
SWEEPS = 5.0
"""Turn of the robot to find the wall again, in largest errors: to one side, to the other, and back."""


class State(enum.Enum):
    """The states of the calibration."""

    REST = "standing still for the gyro's drift"
    ALIGN = "turning towards the wall"
    SYNC_BEFORE = "waiting for all sensors before the turn"
    ROTATE = "turning round once"
    RETURN = "turning back to the wall"
    SYNC_AFTER = "waiting for all sensors after the turn"
    DONE = "done"


@dataclass(slots=True)
class _Mark:
    """The start of what goes on."""

    moment: float
    readings: Mapping[Source, Direction]


class Calibration:
    """One round.

    Args:
        parameters: How to turn.
        scales: Factors that earlier rounds found, by source.

    Attributes:
        state: What goes on.
        readings: What the sensors said; the owner puts new readings into it.
        result: The end, or None.
        turns: What was measured so far.
        factors: What was found, once the result is a success.
    """

    def __init__(
        self,
        parameters: CalibrationParameters | None = None,
        scales: Mapping[Source, float] | None = None,
    ) -> None:
        self.state = State.REST
        self.readings = Readings(scales or {})
        self.result: Result | None = None
        self.factors: Factors | None = None
        self.turns: list[MeasuredTurn] = []
        self._parameters = parameters or CalibrationParameters()
        with_gyro = (Source.GYRO,) if self._parameters.has_gyro else ()
        self._sources = (Source.WALL, Source.ODOMETRY, *with_gyro)
        self._since: float | None = None
        self._entered = self._stepped = self._passed = 0.0
        self._rest: _Mark | None = None
        self._before: Mapping[Source, Direction] = {}
        self._drift: float | None = None
        self._direction = 0.0
        self._tries = 0

    @property
    def feedback(self) -> str:
        """Say what goes on, for people."""
        if self.state in (State.REST, State.DONE):
            return self.state.value
        count = len(self._parameters.speeds)
        return f"turn {len(self.turns) + 1} of {count} at {self._speed:g} rad/s: {self.state.value}"

    def step(self, now: float) -> Twist2:
        """Do what is due; call it every :data:`STEP_PERIOD_S`.

        Args:
            now: Seconds, on the clock of the stamps.

        Returns:
            The velocity for the base; standstill once there is a result.
        """
        if self._since is None:
            self._since = self._entered = self._stepped = now
        self._passed, self._stepped = now - self._stepped, now
        match self.state:
            case State.REST:
                return self._measure_rest(now)
            case State.ALIGN | State.RETURN:
                return self._align(now)
            case State.SYNC_BEFORE | State.SYNC_AFTER:
                return self._sync(now)
            case State.ROTATE:
                return self._rotate(now)
            case _:
                return STANDSTILL

    @property
    def _speed(self) -> float:
        return self._parameters.speeds[len(self.turns)]

    def _measure_rest(self, now: float) -> Twist2:
        if not self._parameters.has_gyro:
            return self._go(State.ALIGN, now)
        gyro = self.readings.newest.get(Source.GYRO)
        assert self._since is not None
        if gyro is None or gyro.stamp < self._since:
            return self._wait_for_sensors(now, (Source.GYRO,), self._since)
        if self._rest is None:
            self._rest = _Mark(now, {Source.GYRO: gyro})
            return STANDSTILL
        start = self._rest.readings[Source.GYRO]
        lasted = gyro.stamp - start.stamp
        if lasted < self._parameters.imu_calibrate_time:
            moved_on = self._rest.moment + self._parameters.imu_calibrate_time + self._parameters.patience
            return STANDSTILL if now <= moved_on else self._silent((Source.GYRO,))
        self._drift = angle_difference(gyro.angle, start.angle) / lasted
        return self._go(State.ALIGN, now)

    def _align(self, now: float) -> Twist2:
        assert self._since is not None
        # Two turns are enough to see every wall that there is.
        furthest = 2.0 * math.tau if self.state is State.ALIGN else SWEEPS * LARGEST_ERROR
        limit = furthest / self._parameters.align_speed + self._parameters.patience
        if now - self.readings.scanned > NEW_SCAN_S:
            return self._wait_for_scan(now)
        speed = self._parameters.align_speed
        left = self._whole() - self.readings.turned
        if self.state is State.RETURN and abs(left) > self._largest_error():
            self._direction = math.copysign(1.0, left)
        elif not self.readings.no_wall:
            angle = self.readings.newest[Source.WALL].angle
            if abs(angle) <= self._parameters.initial_wall_angle:
                return self._go(State.SYNC_BEFORE if self.state is State.ALIGN else State.SYNC_AFTER, now)
            self._direction = -1.0 if angle > 0.0 else 1.0
            speed = min(speed, max(SLOWEST_RADPS, ALIGN_GAIN * abs(angle)))
        elif self._direction == 0.0:
            self._direction = 1.0
        if now - self._since > limit:
            why = self.readings.no_wall or "the robot never looked straight at it"
            return self._end(
                failure(
                    NO_WALL,
                    f"no straight wall found: {why}; put the robot in front of a bare wall, 1 to 2 m away",
                )
            )
        return Twist2(0.0, self._direction * speed)

    def _wait_for_scan(self, now: float) -> Twist2:
        """Stand still, which does not count as turning."""
        assert self._since is not None
        if now - max(self._entered, self.readings.scanned) > self._parameters.patience:
            return self._no_sensor((Source.WALL,))
        self._since += self._passed
        return STANDSTILL

    def _largest_error(self) -> float:
        """Return the largest angle that the wall may be off from where the odometry puts it.

        Further away the next wall round the corner would be taken for the one that the turn began with, or
        half a turn too many for none.
        """
        return CLOSE if self.turns or self.readings.scales else LARGEST_ERROR

    def _sync(self, now: float) -> Twist2:
        assert self._since is not None
        after = self._since + self._parameters.settle
        behind = self.readings.behind(after, self._sources)
        if now >= after and behind == [Source.WALL] and self.readings.no_wall and self._tries < TRIES:
            # A base that stopped late turned past the wall: back to it.
            self._tries += 1
            self._direction = -self._direction
            return self._go(State.ALIGN if self.state is State.SYNC_BEFORE else State.RETURN, now)
        if now < after or behind:
            return self._wait_for_sensors(now, self._sources, after)
        self._tries = 0
        seen = {source: self.readings.newest[source] for source in self._sources}
        if self.state is State.SYNC_BEFORE:
            self._before = seen
            self.readings.begin_turn()
            return self._go(State.ROTATE, now)
        turn = measure_turn(self._speed, self._before, seen, self._drift)
        problem = _problem_with(turn)
        if problem:
            return self._end(failure(BAD_TURN, problem))
        self.turns.append(turn)
        if len(self.turns) < len(self._parameters.speeds):
            self._direction = 0.0
            return self._go(State.ALIGN, now)
        self.factors = factors_from_turns(self.turns)
        return self._end(success())

    def _rotate(self, now: float) -> Twist2:
        assert self._since is not None
        if self.readings.turned >= self._enough():
            wall = self.readings.newest[Source.WALL]
            # A wall that was seen again and left lies behind: the base turned too far, not too little.
            passed = wall.stamp > (self._since + now) / 2.0 and wall.angle > 0.0
            self._direction = -1.0 if passed else 1.0
            return self._go(State.RETURN, now)
        limit = 2.0 * math.tau / self._speed + self._parameters.patience
        if now - self._since > limit:
            turned = math.degrees(self.readings.turned)
            return self._end(
                failure(
                    NO_TURN,
                    f"the odometry turned {turned:.0f} of 360 degrees in {limit:.0f} s: is the base in a "
                    "mode that drives, and is nothing in its way?",
                )
            )
        return Twist2(0.0, self._speed)

    def _whole(self) -> float:
        """Return a whole turn by the odometry, with what is known of it by now."""
        if not self.turns:
            return math.tau
        return math.tau * sum(turn.odometry / turn.wall for turn in self.turns) / len(self.turns)

    def _enough(self) -> float:
        """Return the turn by the odometry after which to brake, so that the wall is in sight again."""
        return self._whole() - self._speed**2 / (2.0 * self._parameters.braking)

    def _wait_for_sensors(self, now: float, sources: tuple[Source, ...], moment: float) -> Twist2:
        if now - moment > self._parameters.patience:
            return self._silent(tuple(self.readings.behind(moment, sources)) or sources)
        return STANDSTILL

    def _silent(self, sources: tuple[Source, ...]) -> Twist2:
        if sources == (Source.WALL,) and self.readings.no_wall:
            return self._end(failure(NO_WALL, f"the wall is out of sight: {self.readings.no_wall}"))
        return self._no_sensor(sources)

    def _no_sensor(self, sources: tuple[Source, ...]) -> Twist2:
        names = " and ".join(source.value for source in sources)
        return self._end(
            failure(NO_SENSOR, f"nothing came from the {names} for {self._parameters.patience:g} s")
        )

    def _go(self, state: State, now: float) -> Twist2:
        self.state, self._since, self._entered = state, now, now
        return STANDSTILL

    def _end(self, result: Result) -> Twist2:
        self.state, self.result = State.DONE, result
        return STANDSTILL


def _problem_with(turn: MeasuredTurn) -> str:
    """Tell why a turn cannot be used; empty when it can."""
    seen = {Source.WALL: turn.wall, Source.ODOMETRY: turn.odometry, Source.GYRO: turn.gyro}
    for source, angle in seen.items():
        if angle is not None and abs(angle - math.tau) > LARGEST_ERROR:
            return (
                f"at {turn.speed:g} rad/s the {source.value} saw {math.degrees(angle):.0f} degrees instead "
                "of about 360; repair or coarsely set that first"
            )
    return ""


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
        """Compute the factor for ``odom_angular_scale_correction`` from all rounds together."""
        return self._scales.get(Source.ODOMETRY, 1.0)

    @property
    def gyro(self) -> float | None:
        """Compute the factor for ``gyro_scale_correction``; None without a gyro."""
        return self._scales.get(Source.GYRO, 1.0) if self._parameters.has_gyro else None

    @property
    def feedback(self) -> str:
        """Say what goes on, for people."""
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
