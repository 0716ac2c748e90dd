"""Which wheel speeds to send and when: the command, its time-out, what objects to it (REFERENCE 2.4)."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot.hazards import StopReason, hold_forward
from florence_bt.drivers.turtlebot.obedience import Obedience
from florence_bt.drivers.turtlebot.parameters import DriveMode
from florence_bt.drivers.turtlebot.wheels import (
    STOPPED,
    WheelParameters,
    WheelSpeeds,
    arc_from_twist,
    wheels_from_twist,
    wheels_one_by_one,
)

REPEAT_PERIOD_S = 1.0 / 30.0
"""The speeds are repeated at the old node's loop rate, so that a command lost on the line heals."""

SHORTEST_CHANGE_S = 0.015
"""Changes that come faster than the base looks at them (REFERENCE 1.1) would only fill the line: the newest
waits for its turn. A stop never waits."""


class DriveControl:
    """Keeps the newest velocity command and turns it into bytes.

    Attributes:
        obedience: Whether the base does what it is told.
        refused: Commands with NaN or infinity so far; each stopped the base.
        due: When the speeds are to be sent again, in seconds.
    """

    def __init__(self, wheels: WheelParameters, timeout_s: float, mode: DriveMode = DriveMode.TWIST) -> None:
        self._wheels = wheels
        self._mode = mode
        self._timeout_s = timeout_s
        self._twist = STANDSTILL
        self._commanded = -math.inf
        self._sent = STOPPED
        self._sent_at = self._changed_at = -math.inf
        self.obedience = Obedience()
        self.refused = 0
        self.due = -math.inf

    def command(self, twist: Twist2, now: float) -> None:
        """Take a velocity; it holds until the next one or the time-out."""
        if not (math.isfinite(twist.linear) and math.isfinite(twist.angular)):
            self.refused += 1
            twist = STANDSTILL
        self._twist = twist
        self._commanded = now

    def stop(self) -> None:
        """Forget the command: only a new one moves the base again."""
        self._twist = STANDSTILL

    def wants_motion(self, now: float) -> bool:
        """Whether a fresh command asks for motion; one of a time that has not come yet is not fresh."""
        return not self._twist.is_zero() and 0.0 <= now - self._commanded <= self._timeout_s

    def take(self, now: float, objection: StopReason | None, *, enabled: bool) -> bytes:
        """The bytes to send now: at once when the speeds change (or soon after the last change), otherwise
        every 1/30 s.

        Args:
            now: Seconds.
            objection: What forbids forward motion. The command it hits is forgotten, so that the base does
                not start by itself when the objection goes away.
            enabled: Whether the base is in a mode that takes speeds.
        """
        twist = self._twist if self.wants_motion(now) else STANDSTILL
        wheels = self._share(twist)
        held = hold_forward(wheels, objection)
        if held != wheels:
            self.stop()
            twist = STANDSTILL
        self.due = self._next_turn(now, held)
        if now < self.due:
            return b""
        if held != self._sent:
            self._changed_at = now
        self._sent, self._sent_at = held, now
        self.due = now + REPEAT_PERIOD_S
        if not enabled:
            self.obedience.clear()
            return b""
        if self._mode is DriveMode.DRIVE:  # which the base reports as other numbers
            return codec.drive(*arc_from_twist(twist, self._wheels))
        self.obedience.sent(held, now)
        return codec.drive_direct(held.right_mmps, held.left_mmps)

    def _next_turn(self, now: float, wheels: WheelSpeeds) -> float:
        """When these speeds are to be sent."""
        if now < self._sent_at:  # the clock was set back
            self._sent_at = self._changed_at = -math.inf
        if wheels == self._sent:
            return self._sent_at + REPEAT_PERIOD_S
        return now if wheels == STOPPED else self._changed_at + SHORTEST_CHANGE_S

    def _share(self, twist: Twist2) -> WheelSpeeds:
        if twist.is_zero():
            return STOPPED
        share = wheels_one_by_one if self._mode is DriveMode.TURTLE else wheels_from_twist
        return share(twist, self._wheels)
