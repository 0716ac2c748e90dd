"""Which wheel speeds to send and when: the command, its time-out, what objects to it (REFERENCE 2.4)."""

from __future__ import annotations

import math

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot.hazards import StopReason, hold_forward
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


class DriveControl:
    """Keeps the newest velocity command and turns it into bytes.

    Attributes:
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
        """Whether a fresh command asks for motion."""
        return not self._twist.is_zero() and now - self._commanded <= self._timeout_s

    def take(self, now: float, objection: StopReason | None, *, enabled: bool) -> bytes:
        """The bytes to send now: at once when the speeds change, otherwise every 1/30 s.

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
        if held == self._sent and now < self.due:
            return b""
        self._sent = held
        self.due = now + REPEAT_PERIOD_S
        if not enabled:
            return b""
        if self._mode is DriveMode.DRIVE:
            return codec.drive(*arc_from_twist(twist, self._wheels))
        return codec.drive_direct(held.right_mmps, held.left_mmps)

    def _share(self, twist: Twist2) -> WheelSpeeds:
        if twist.is_zero():
            return STOPPED
        share = wheels_one_by_one if self._mode is DriveMode.TURTLE else wheels_from_twist
        return share(twist, self._wheels)
