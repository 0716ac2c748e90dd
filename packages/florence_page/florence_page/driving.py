"""Driving by hand: what a viewer's hand wants goes to the base while the manual override is on."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.app.teleop.hands import (
    HAND_PERIOD_S,
    STEPS,
    Gamepad,
    GamepadLayout,
    TeleopParameters,
    stepped,
)
from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.geometry import STANDSTILL, Twist2

HAND_SILENT_S = 0.5
"""The robot stands still when the hand has said nothing for so long; the page says where it is ten times a
second."""
_PAD = GamepadLayout(axis_linear=0, axis_angular=1, enable_button=0, turbo_button=-1)


class HandDriving:
    """One viewer at a time drives; who begins has the robot until the hand lets go, is silent, or is gone.

    Args:
        clock: Steady seconds.
        may_drive: Tells whether the manual override is on.
        command: Sends a velocity to the base.
        show: Told the speeds of a full push when they change.
    """

    def __init__(
        self,
        clock: Clock,
        may_drive: Callable[[], bool],
        command: Callable[[Twist2], None],
        show: Callable[[Twist2], None],
    ) -> None:
        self._clock = clock
        self._may_drive = may_drive
        self._command = command
        self._show = show
        self._hand = Gamepad(TeleopParameters(timeout=HAND_SILENT_S), _PAD)
        self._driver: object = None
        self._stopped: object = None
        self._timer: Timer | None = None
        show(self._hand.speeds)

    def push(self, viewer: object, forward: float, left: float) -> None:
        """Take where the hand of a viewer is: -1 to 1 each, both 0 when it lets go."""
        if viewer is self._stopped:
            if forward == left == 0.0:
                self._stopped = None
            return
        if self._driver not in (None, viewer) or not self._may_drive():
            return
        if forward == left == 0.0:
            self.let_go(viewer)
            return
        self._driver = viewer
        self._hand.take((forward, left), (1,), self._clock.now())
        if self._timer is None:
            self._send()
            self._timer = call_every(self._clock, HAND_PERIOD_S, self._send)

    def step(self, viewer: object, key: str) -> None:
        """Change the speeds by a key of ``teleop``."""
        if key in STEPS and self._driver in (None, viewer):
            self._hand.speeds = stepped(self._hand.speeds, key)
            self._show(self._hand.speeds)

    def let_go(self, viewer: object) -> None:
        """Stop the robot if it is this viewer who drives it."""
        if self._driver is not viewer or viewer is None:
            return
        self._driver = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._may_drive():
            self._command(STANDSTILL)

    def stop(self) -> None:
        """Take the robot out of the hand: somebody has pressed STOP. Who drove must let go to drive again."""
        driver = self._driver
        self.let_go(driver)
        self._stopped = driver

    def _send(self) -> None:
        wanted = self._hand.wanted(self._clock.now())
        if wanted == STANDSTILL or not self._may_drive():
            self.let_go(self._driver)
        else:
            self._command(wanted)
