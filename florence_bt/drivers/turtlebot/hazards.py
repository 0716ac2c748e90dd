"""What forbids motion: bumpers, dropped wheels, cliffs, a base that left its mode (REFERENCE 1.2, 2.4)."""

from __future__ import annotations

import enum

from florence_bt.drivers.turtlebot.codec.packets import (
    BUMPS,
    INTERNAL_CHARGER,
    WHEEL_DROPS,
    OiMode,
    SensorState,
)
from florence_bt.drivers.turtlebot.wheels import STOPPED, WheelSpeeds


class StopReason(enum.Enum):
    """Why the base is held; the value is the sentence for people."""

    BUMPER = "a bumper is pressed: forward motion is held"
    WHEEL_DROP = "a wheel hangs in the air: put the base on the floor"
    CLIFF = "a cliff sensor misses the floor: forward motion is held"
    CHARGER = "the charger is plugged in and the base left its drive mode: unplug it"
    MODE_LOST = "the base left its drive mode: it returns to it with the next velocity command"


def contact(state: SensorState, *, heed_bumps: bool, heed_cliffs: bool) -> StopReason | None:
    """What the sensors around and under the base object to, the worst first; None when all is well.

    Args:
        state: All sensors.
        heed_bumps: Whether bumpers and wheel drops count.
        heed_cliffs: Whether cliff sensors count.
    """
    if heed_bumps and state.bumps_wheeldrops & WHEEL_DROPS:
        return StopReason.WHEEL_DROP
    if heed_cliffs and state.cliff:
        return StopReason.CLIFF
    if heed_bumps and state.bumps_wheeldrops & BUMPS:
        return StopReason.BUMPER
    return None


def lost_mode(state: SensorState, wanted: OiMode) -> StopReason | None:
    """Why the base is not in the drive mode that was asked for; None when it is, or is meant to be passive.

    A dock is no obstacle (the base drives off it), the plug of the internal charger is: REFERENCE 2.4, row 9.
    """
    if wanted < OiMode.SAFE or state.oi_mode >= OiMode.SAFE:
        return None
    if state.charging_sources_available & INTERNAL_CHARGER:
        return StopReason.CHARGER
    return contact(state, heed_bumps=True, heed_cliffs=True) or StopReason.MODE_LOST


def hold_forward(wheels: WheelSpeeds, objection: StopReason | None) -> WheelSpeeds:
    """Stand still instead of driving forward against an objection; reverse and pure spins stay allowed.

    Source: REFERENCE 2.4, row "Bump".
    """
    return STOPPED if objection is not None and wheels.forward else wheels
