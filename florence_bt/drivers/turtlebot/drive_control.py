"""Control of the wheel speeds: the command, its time-out, what objects to it (REFERENCE 2.4).

:class:`CommandAcknowledgement` compares them with the speeds that the base reports (packets 41 and 42).
"""

from __future__ import annotations

import math
from collections import deque

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.state import SensorState
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

SHORTEST_CHANGE_S = 0.015
"""Changes that come faster than the base looks at them (REFERENCE 1.1) would only fill the line: the newest
waits for its turn. A stop never waits."""


class DriveControl:
    """Keeps the newest velocity command and turns it into bytes.

    Attributes:
        acknowledgement: Whether the base acknowledges its commands.
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
        self.acknowledgement = CommandAcknowledgement()
        self.refused = 0
        self.due = -math.inf

    @property
    def wheels(self) -> WheelSpeeds:
        """The speeds that the base was sent last."""
        return self._sent

    @property
    def speed(self) -> Twist2:
        """The velocity that the base was sent last, in m/s and rad/s."""
        left, right = self._sent.left_mmps / 1000.0, self._sent.right_mmps / 1000.0
        return Twist2((left + right) / 2.0, (right - left) / self._wheels.wheel_separation)

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
        """Tell whether a fresh command asks for motion; one of a time that has not come yet is not fresh."""
        return not self._twist.is_zero() and 0.0 <= now - self._commanded <= self._timeout_s

    def take(self, now: float, objection: StopReason | None, *, enabled: bool) -> bytes:
        """Return the bytes to send now: at once when the speeds change (or soon after the last change),
        otherwise every 1/30 s.

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
            self.acknowledgement.clear()
            return b""
        if self._mode is DriveMode.DRIVE:  # which the base reports as other numbers
            return commands.drive(*arc_from_twist(twist, self._wheels))
        self.acknowledgement.sent(held, now)
        return commands.drive_direct(held.right_mmps, held.left_mmps)

    def _next_turn(self, now: float, wheels: WheelSpeeds) -> float:
        """Return when these speeds are to be sent."""
        if wheels == self._sent:
            return self._sent_at + REPEAT_PERIOD_S
        return now if wheels == STOPPED else self._changed_at + SHORTEST_CHANGE_S

    def _share(self, twist: Twist2) -> WheelSpeeds:
        if twist.is_zero():
            return STOPPED
        share = wheels_one_by_one if self._mode is DriveMode.TURTLE else wheels_from_twist
        return share(twist, self._wheels)


ACKNOWLEDGEMENT_TIMEOUT_S = 1.0
"""Long enough for speeds to reach the base, and for the frame that reports them to come back."""


TOLERANCE_MMPS = 10
"""Rounding of a speed by a firmware before it reports it; a broken wire makes a larger difference."""


class CommandAcknowledgement:
    """Compares the speeds that were sent with those that the base reports.

    A wire that is broken in one direction only leaves a base that reports well and drives on for ever.

    Attributes:
        unresponsive: The base has reported for a while other speeds than any that were sent to it lately.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[float, WheelSpeeds]] = deque()
        self._unacknowledged_since: float | None = None
        self.unresponsive = False

    def clear(self) -> None:
        """Start again: no speeds were sent yet that the base has to acknowledge."""
        self._sent.clear()
        self._unacknowledged_since = None
        self.unresponsive = False

    def sent(self, wheels: WheelSpeeds, now: float) -> None:
        """Note speeds that went out."""
        if not self._sent or wheels != self._sent[-1][1]:
            self._sent.append((now, wheels))
        while len(self._sent) > 1 and now - self._sent[1][0] > ACKNOWLEDGEMENT_TIMEOUT_S:
            self._sent.popleft()

    def look(self, state: SensorState, now: float) -> None:
        """Take what the base reports."""
        if not self._sent:
            return
        reported = WheelSpeeds(
            round(1000.0 * state.requested_left_velocity), round(1000.0 * state.requested_right_velocity)
        )
        if any(_near(wheels, reported) for _, wheels in reversed(self._sent)):
            self._unacknowledged_since, self.unresponsive = None, False
        elif self._unacknowledged_since is None or now < self._unacknowledged_since:
            self._unacknowledged_since = now
        elif now - self._unacknowledged_since > ACKNOWLEDGEMENT_TIMEOUT_S:
            self.unresponsive = True


def _near(one: WheelSpeeds, other: WheelSpeeds) -> bool:
    differences = one.left_mmps - other.left_mmps, one.right_mmps - other.right_mmps
    return max(map(abs, differences)) <= TOLERANCE_MMPS
