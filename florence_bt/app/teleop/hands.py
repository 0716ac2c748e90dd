"""Driving by hand: keys or a gamepad in, a velocity out, the time given to it.

A hand must go on saying that it is there. A terminal tells no release of a key, but repeats one that is held;
a gamepad has a button to be held. Without news for the time-out the robot stands still.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.limits import CheckedParameters, Limits

MAX_LINEAR_MPS = 0.5
"""The wheels do no more (REFERENCE 2.3)."""
MAX_ANGULAR_RADPS = 2.0
"""Chosen below what the base can do, 3 rad/s: a person cannot steer faster."""
LEAST_LINEAR_MPS, LEAST_ANGULAR_RADPS = 0.02, 0.1
HAND_PERIOD_S = 0.05
"""Seconds between two commands of a hand: a fifth of what the velocity filter waits for one."""
STEP = 1.1
"""Factor of a speed step, as in teleop_twist_keyboard."""
DEAD_ZONE = 0.05
"""Part of an axis around its middle that counts as the middle; the default of joy_node."""

DIRECTIONS = {
    "up": (1, 0),
    "down": (-1, 0),
    "left": (0, 1),
    "right": (0, -1),
    "u": (1, 1),
    "i": (1, 0),
    "o": (1, -1),
    "j": (0, 1),
    "k": (0, 0),
    "l": (0, -1),
    "m": (-1, -1),
    ",": (-1, 0),
    ".": (-1, 1),
    " ": (0, 0),
}
"""Key -> parts of the forward and of the turning speed; the letters are those of teleop_twist_keyboard."""
STEPS = {
    "q": (STEP, STEP),
    "z": (1 / STEP, 1 / STEP),
    "w": (STEP, 1.0),
    "x": (1 / STEP, 1.0),
    "e": (1.0, STEP),
    "c": (1.0, 1 / STEP),
}
"""Key -> factors of the forward and of the turning speed, as in teleop_twist_keyboard."""


@dataclass(frozen=True, slots=True)
class TeleopParameters(CheckedParameters):
    """The parameters of driving by hand.

    Attributes:
        speed: Forward speed at the start, m/s.
        turn: Turning speed at the start, rad/s.
        timeout: Seconds without news of the hand after which the robot stands still. A held key is repeated
            after 0.25 to 0.66 s for the first time, by the settings of most desktops.
    """

    speed: Annotated[float, Limits(LEAST_LINEAR_MPS, MAX_LINEAR_MPS)] = 0.2
    turn: Annotated[float, Limits(LEAST_ANGULAR_RADPS, MAX_ANGULAR_RADPS)] = 0.8
    timeout: Annotated[float, Limits(0.1, 1.0)] = 0.7


@dataclass(frozen=True, slots=True)
class GamepadLayout(CheckedParameters):
    """The axes and buttons of ``sensor_msgs/Joy`` that drive; the defaults fit PlayStation and Xbox pads.

    Attributes:
        axis_linear: Axis for forward and backward: the left stick, up and down.
        axis_angular: Axis for turns: the left stick, left and right.
        enable_button: Dead-man button, to be held: the left shoulder, L1 or LB.
        turbo_button: Dead-man button for twice the speed: the right shoulder, R1 or RB; -1 for none.
    """

    axis_linear: Annotated[int, Limits(0, 99)] = 1
    axis_angular: Annotated[int, Limits(0, 99)] = 0
    enable_button: Annotated[int, Limits(0, 99)] = 4
    turbo_button: Annotated[int, Limits(-1, 99)] = 5


class Hand(Protocol):
    """Somebody who drives.

    Attributes:
        speeds: The forward and the turning speed that a full push gives, m/s and rad/s.
    """

    speeds: Twist2

    def wanted(self, now: float) -> Twist2:
        """Return the velocity that is wanted at a moment in seconds."""


def stepped(speeds: Twist2, key: str) -> Twist2:
    """Return the speeds after a key of :data:`STEPS`."""
    linear, angular = STEPS[key]
    return Twist2(
        _within(speeds.linear * linear, LEAST_LINEAR_MPS, MAX_LINEAR_MPS),
        _within(speeds.angular * angular, LEAST_ANGULAR_RADPS, MAX_ANGULAR_RADPS),
    )


class Keys:
    """A hand on the keys of a terminal.

    Args:
        parameters: Speeds and time-out.
    """

    def __init__(self, parameters: TeleopParameters) -> None:
        self.speeds = Twist2(parameters.speed, parameters.turn)
        self._timeout_s = parameters.timeout
        self._direction = (0, 0)
        self._pressed_at = -math.inf

    def press(self, key: str, now: float) -> None:
        """Take a key; one that means nothing stops the robot."""
        if key in STEPS:
            self.speeds = stepped(self.speeds, key)
            return
        self._direction, self._pressed_at = DIRECTIONS.get(key, (0, 0)), now

    def wanted(self, now: float) -> Twist2:
        """Return the velocity that is wanted at a moment in seconds."""
        if not 0.0 <= now - self._pressed_at < self._timeout_s:
            return STANDSTILL
        forward, left = self._direction
        return Twist2(forward * self.speeds.linear, left * self.speeds.angular)


class Gamepad:
    """A hand on a gamepad.

    Args:
        parameters: Speeds and time-out.
        layout: What the axes and buttons mean.

    Attributes:
        problem: Why the pad cannot drive; empty when it can.
    """

    def __init__(self, parameters: TeleopParameters, layout: GamepadLayout) -> None:
        self.speeds = Twist2(parameters.speed, parameters.turn)
        self.problem = ""
        self._layout = layout
        self._timeout_s = parameters.timeout
        self._push = STANDSTILL
        self._came_at = -math.inf

    def take(self, axes: Sequence[float], buttons: Sequence[int], now: float) -> None:
        """Take a message of the pad.

        Args:
            axes: -1 to 1 each; up and left are positive.
            buttons: 1 for each that is held.
            now: Seconds.
        """
        layout = self._layout
        self._came_at, self._push = now, STANDSTILL
        farthest = max(layout.axis_linear, layout.axis_angular)
        if farthest >= len(axes) or layout.enable_button >= len(buttons):
            self.problem = (
                f"the pad has {len(axes)} axes and {len(buttons)} buttons, "
                f"axis {farthest} and button {layout.enable_button} were asked for"
            )
            return
        self.problem = ""
        turbo = 0 <= layout.turbo_button < len(buttons) and buttons[layout.turbo_button]
        if turbo or buttons[layout.enable_button]:
            factor = 2.0 if turbo else 1.0
            self._push = Twist2(
                factor * _axis(axes[layout.axis_linear]), factor * _axis(axes[layout.axis_angular])
            )

    def wanted(self, now: float) -> Twist2:
        """Return the velocity that is wanted at a moment in seconds."""
        if not 0.0 <= now - self._came_at < self._timeout_s:
            return STANDSTILL
        return Twist2(
            _within(self._push.linear * self.speeds.linear, -MAX_LINEAR_MPS, MAX_LINEAR_MPS),
            _within(self._push.angular * self.speeds.angular, -MAX_ANGULAR_RADPS, MAX_ANGULAR_RADPS),
        )


def _axis(value: float) -> float:
    return 0.0 if abs(value) < DEAD_ZONE else _within(value, -1.0, 1.0)


def _within(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
