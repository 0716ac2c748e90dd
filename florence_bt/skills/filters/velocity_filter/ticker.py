"""Runs a velocity filter on a clock and rests while there is nothing to say.

No ROS here: the node uses it, and so does whoever drives the parts by hand.
"""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    VelocityFilter,
    VelocityFilterParameters,
)


class VelocityTicker:
    """Steps a :class:`VelocityFilter` at its rate; sleeps from the moment it is idle to the next command.

    The base stops by itself when it hears nothing for 0.6 s (REFERENCE 6.5). That never matters here: the
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
        """Whether steps are being made."""
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
        """Leave the robot standing: no more steps, and a zero as the last word."""
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
