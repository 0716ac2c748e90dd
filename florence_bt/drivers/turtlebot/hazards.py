"""What forbids motion: bumpers, dropped wheels, cliffs, a base that left its mode (REFERENCE 1.2, 2.4)."""

from __future__ import annotations

import enum

from florence_bt.drivers.turtlebot.codec.packets import (
    BUMPS,
    HOME_BASE,
    INTERNAL_CHARGER,
    WHEEL_DROPS,
    OiMode,
)
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.wheels import STOPPED, WheelSpeeds


class StopReason(enum.Enum):
    """Why the base is held; the value is the sentence for people."""

    BUMPER = "a bumper is pressed: forward motion is held"
    WHEEL_DROP = "a wheel hangs in the air: put the base on the floor"
    CLIFF = "a cliff sensor misses the floor: forward motion is held"
    CHARGER = "the charger is plugged in: unplug it before the base drives"
    DOCK = "the base stands on its dock: forward motion is held"
    BATTERY = "the battery is empty: bring the base to its charger"
    GYRO = "the gyro turned while the wheels went straight: the base stands still to calibrate it"
    DEAF = "the base does not do what it is told: check the wire to it"
    MODE_LOST = "the base left its drive mode: it returns to it with the next velocity command"


HOLDS_ALL = frozenset({StopReason.CHARGER, StopReason.BATTERY, StopReason.GYRO, StopReason.DEAF})
"""What holds every motion; the others leave the way back and turns on the spot."""


def contact(
    state: SensorState, *, heed_bumps: bool, heed_cliffs: bool, lowest_charge: float = 0.0
) -> StopReason | None:
    """What the base's own sensors object to, the worst first; None when all is well.

    On the home base the cliff sensors count for nothing: its plate looks to them like a missing floor
    (REFERENCE 2.7, row "Cliff Sensor").

    Args:
        state: All sensors.
        heed_bumps: Whether bumpers and wheel drops count.
        heed_cliffs: Whether cliff sensors count.
        lowest_charge: The charge, as a fraction of the capacity, below which nothing moves any more.
    """
    docked = bool(state.charging_sources_available & HOME_BASE)
    if heed_bumps and state.bumps_wheeldrops & WHEEL_DROPS:
        return StopReason.WHEEL_DROP
    if state.charging_sources_available & INTERNAL_CHARGER:
        return StopReason.CHARGER
    if heed_cliffs and state.cliff and not docked:
        return StopReason.CLIFF
    if heed_bumps and state.bumps_wheeldrops & BUMPS:
        return StopReason.BUMPER
    if docked:
        return StopReason.DOCK
    return StopReason.BATTERY if state.charge < lowest_charge * state.capacity else None


def lost_mode(state: SensorState, wanted: OiMode) -> StopReason | None:
    """Why the base is not in the drive mode that was asked for; None when it is, or is meant to be passive.

    A dock is no obstacle (the base drives off it), the plug of the internal charger is: REFERENCE 2.4, row 9.
    """
    if wanted < OiMode.SAFE or state.oi_mode >= OiMode.SAFE:
        return None
    touched = contact(state, heed_bumps=True, heed_cliffs=True)
    return StopReason.MODE_LOST if touched in (None, StopReason.DOCK) else touched


def hold_forward(wheels: WheelSpeeds, objection: StopReason | None) -> WheelSpeeds:
    """Stand still instead of driving against an objection; most leave reverse and pure spins allowed.

    Source: REFERENCE 2.4, row "Bump".
    """
    if objection is None:
        return wheels
    return STOPPED if wheels.forward or objection in HOLDS_ALL else wheels
