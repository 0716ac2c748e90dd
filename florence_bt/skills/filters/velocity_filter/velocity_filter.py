"""The acceleration limit, tick by tick: numbers in, numbers out, the time given to it.

Source: REFERENCE 6.5; document, section 3.6.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.limits import CheckedParameters, NotNegative, Positive

HELD_UP_S = 1.0
"""Time between two steps after which the process counts as held up, and the supervisor has stopped the base
meanwhile (docs/manual/runtime.md): the next step begins at standstill."""
BACKLOG_S = 0.01
"""Time after that in which commands are refused: those that waited for this process, nobody knows how long,
are served within milliseconds. Chosen below the period of the steps."""


@dataclass(frozen=True, slots=True)
class VelocityFilterParameters(CheckedParameters):
    """Parameters of the velocity filter.

    Attributes:
        max_linear_acc: Largest change of the forward speed in m/s^2, from one command to another.
        max_angular_acc: Largest change of the turning speed in rad/s^2, from one command to another.
        max_linear_braking: The same when the robot shall stand still, by a command or for want of one: for
            that there is a reason (Nav2's velocity smoother brakes with 2.5 m/s^2 and 3.2 rad/s^2, too).
        max_angular_braking: The same for turning, in rad/s^2.
        publishing_rate: Steps per second in Hz.
        command_timeout: A command this old, in seconds, counts as a command to stand still. The base stands
            within it and the time to brake when navigation falls silent: 0.25 s + 0.45 m/s / 2.5 m/s^2 =
            0.43 s. Navigation commands every 0.1 s.
        silent_until_command: Publish nothing before the first command; False is the old behaviour.
        idle_after: Seconds of zeros after which publishing pauses until the next command, so that a resting
            robot costs nothing; 0 publishes for ever (the old behaviour).
    """

    max_linear_acc: Positive = 1.0
    max_angular_acc: Positive = 1.0
    max_linear_braking: Positive = 2.5
    max_angular_braking: Positive = 3.2
    publishing_rate: Positive = 50.0
    command_timeout: Positive = 0.25
    silent_until_command: bool = True
    idle_after: NotNegative = 1.0


class VelocityFilter:
    """Follows the wanted velocity as fast as the acceleration limits allow.

    Attributes:
        output: The velocity after the last step.
        rejected: How many commands were refused because a number in them was not finite.
        stopped: Whether a hard stop holds.
    """

    def __init__(self, parameters: VelocityFilterParameters | None = None) -> None:
        self.parameters = parameters or VelocityFilterParameters()
        self.output = STANDSTILL
        self.rejected = 0
        self.stopped = False
        self._wanted = STANDSTILL
        self._commanded_at = -math.inf
        self._stepped_at = math.inf
        self._held_up_at = -math.inf
        self._steps_at_rest = 0

    @property
    def idle(self) -> bool:
        """Tell whether only zeros came out for ``idle_after`` seconds: further steps say nothing new."""
        enough = round(self.parameters.idle_after * self.parameters.publishing_rate)
        return enough > 0 and self._steps_at_rest >= enough

    def command(self, twist: Twist2, now: float) -> bool:
        """Take a velocity command.

        Args:
            twist: The wanted velocity.
            now: The time in seconds.

        Returns:
            Whether it counts: not with a NaN or an infinity in it (the last good command then ages on), not
            while a hard stop holds, and not when the process was held up: it may be old.
        """
        if not (math.isfinite(twist.linear) and math.isfinite(twist.angular)):
            self.rejected += 1
            return False
        held_up = not self.idle and now - self._stepped_at >= HELD_UP_S
        if self.stopped or held_up or 0.0 <= now - self._held_up_at < BACKLOG_S:
            return False
        self._wanted, self._commanded_at = twist, now
        self._steps_at_rest = 0
        return True

    def hard_stop(self) -> None:
        """Stand still at once, past every limit, and stay so until :meth:`release`."""
        self.stopped = True
        self.output = self._wanted = STANDSTILL
        self._steps_at_rest = 0

    def release(self) -> None:
        """End a hard stop. The robot stays where it is until a new command comes."""
        self.stopped = False

    def step(self, now: float) -> Twist2:
        """Compute the next velocity; call it once per 1 / publishing_rate.

        Args:
            now: The time in seconds. A time before the last command (a clock that was set back) makes the
                command too old.

        Returns:
            The velocity to drive with.
        """
        p = self.parameters
        if not 0.0 <= now - self._commanded_at < p.command_timeout:
            self._wanted = STANDSTILL
        if now - self._stepped_at >= HELD_UP_S:
            self.output = STANDSTILL
            self._held_up_at = now
        self._stepped_at = now
        brakes = self._wanted.is_zero()
        linear = p.max_linear_braking if brakes else p.max_linear_acc
        angular = p.max_angular_braking if brakes else p.max_angular_acc
        self.output = Twist2(
            _approach(self.output.linear, self._wanted.linear, linear, p.publishing_rate),
            _approach(self.output.angular, self._wanted.angular, angular, p.publishing_rate),
        )
        at_rest = self.output.is_zero() and self._wanted.is_zero()
        self._steps_at_rest = self._steps_at_rest + 1 if at_rest else 0
        return self.output


ROUNDING = 1e-9
"""Relative slack of the acceleration limit: sums of steps such as 0.02 m/s carry rounding errors, which must
not cost an extra tick."""


def _approach(now: float, wanted: float, max_acc: float, rate: float) -> float:
    """Take one step from a speed towards another, at most max_acc / rate."""
    acc = (wanted - now) * rate
    if abs(acc) <= max_acc * (1.0 + ROUNDING):
        return wanted
    return now + math.copysign(max_acc / rate, acc)


class VelocityTicker:
    """Steps a :class:`VelocityFilter` at its rate; sleeps from the moment it is idle to the next command.

    The base stops by itself when no command comes for 0.6 s (REFERENCE 6.5). That never matters here: the
    ticker falls silent only at standstill.
    """

    def __init__(
        self,
        clock: Clock,
        publish: Callable[[Twist2], None],
        parameters: VelocityFilterParameters | None = None,
    ) -> None:
        self.filter = VelocityFilter(parameters)
        self._clock = clock
        self._publish = publish
        self._timer: Timer | None = None
        if not self.filter.parameters.silent_until_command:
            self._wake()

    @property
    def running(self) -> bool:
        """Tell whether steps are being made."""
        return self._timer is not None

    def command(self, twist: Twist2) -> bool:
        """Take a velocity command; False when it was refused (see :meth:`VelocityFilter.command`)."""
        accepted = self.filter.command(twist, self._clock.now())
        if accepted:
            self._wake()
        return accepted

    def hard_stop(self) -> None:
        """Publish a zero at once and hold it until :meth:`release`."""
        self.filter.hard_stop()
        self._publish(STANDSTILL)
        self._wake()

    def stop(self) -> None:
        """Publish a zero at once; unless a hard stop holds, the next command counts."""
        held = self.filter.stopped
        self.hard_stop()
        if not held:
            self.release()

    def release(self) -> None:
        """End a hard stop."""
        self.filter.release()

    def close(self) -> None:
        """Leave the robot standing: no more steps, and a zero as the last command."""
        self.filter.hard_stop()
        self._rest()
        self._publish(STANDSTILL)

    def _wake(self) -> None:
        if self._timer is None:
            period = 1.0 / self.filter.parameters.publishing_rate
            self._timer = call_every(self._clock, period, self._step, start=self._clock.now())

    def _rest(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _step(self) -> None:
        self._publish(self.filter.step(self._clock.now()))
        if self.filter.idle:
            self._rest()
