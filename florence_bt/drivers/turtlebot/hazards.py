"""Hazards that forbid motion: bumpers, dropped wheels, cliffs, a mode left (REFERENCE 1.2, 2.4).

:class:`ChargeWatch` decides when a base that does not charge is to be reset (REFERENCE 2.4, rows 6 and 7).
"""

from __future__ import annotations

import enum
import math

from florence_bt.drivers.turtlebot.battery import battery_of, charge_fraction, is_below
from florence_bt.drivers.turtlebot.codec.packets import (
    BUMP_LEFT,
    BUMP_RIGHT,
    BUMPS,
    DROP_CASTER,
    DROP_LEFT,
    DROP_RIGHT,
    HOME_BASE,
    INTERNAL_CHARGER,
    LEFT_WHEEL_OVERCURRENT,
    RIGHT_WHEEL_OVERCURRENT,
    WHEEL_DROPS,
    WHEEL_OVERCURRENTS,
    ChargingState,
    OiMode,
)
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.wheels import STOPPED, WheelSpeeds

OVERCURRENT_TIMEOUT_S = 0.5
"""A start, or the edge of a carpet, draws too much current for a moment only."""

OVERCURRENT_REST_S = 1.0
"""A blocked motor is given this rest; its current ends with the motion, so the flag alone says nothing."""


class StopReason(enum.Enum):
    """The reasons to hold the base; the value is the sentence, to which :func:`describe` adds the sensor."""

    BUMPER = "a bumper is pressed: forward motion is held"
    WHEEL_DROP = "a wheel hangs in the air: put the base on the floor"
    CLIFF = "a cliff sensor misses the floor: forward motion is held"
    CHARGER = "the charger is plugged in: unplug it before the base drives"
    DOCK = "the base stands on its dock: forward motion is held"
    BATTERY = "the battery is empty: bring the base to its charger"
    GYRO = "the gyro turned while the wheels went straight: the base stands still to calibrate it"
    OVERCURRENT = "a wheel draws too much current: see what blocks it"
    NO_RESPONSE = "the base does not acknowledge its commands: check the wire to it"
    DOCKING = "the base drives to its dock by itself: a velocity command ends that"
    MODE_LOST = "the base left its drive mode: it returns to it with the next velocity command"

    @property
    def code(self) -> str:
        """One word for programs, the ``code`` of florence_interfaces/StopReason."""
        return self.name.lower()


CHARGE_NOT_KNOWN = (
    "the charge of the battery is not known, so it may be empty: bring the base to its charger, or set "
    "lowest_charge to 0 to drive all the same"
)
"""The sentence of ``BATTERY`` for a base whose charge cannot be true."""

HOLDS_ALL = frozenset(
    {
        StopReason.CHARGER,
        StopReason.BATTERY,
        StopReason.GYRO,
        StopReason.OVERCURRENT,
        StopReason.NO_RESPONSE,
    }
)
"""Hazards that hold every motion; the others leave the way back and turns on the spot."""


_VERBS = {
    StopReason.BUMPER: (" is ", " are "),
    StopReason.WHEEL_DROP: (" hangs ", " hang "),
    StopReason.CLIFF: (" misses ", " miss "),
    StopReason.OVERCURRENT: (" draws ", " draw "),
}
"""The verb of a reason's sentence, for one sensor and for several."""


def describe(reason: StopReason, state: SensorState) -> str:
    """Return the sentence of a reason, with the names of the sensors that gave it.

    Args:
        reason: Why the base is held.
        state: All sensors.
    """
    if reason is StopReason.BATTERY and battery_of(state).fraction is None:
        return CHARGE_NOT_KNOWN
    sensors = _sensors(reason, state)
    if not sensors:
        return reason.value
    singular, plural = _VERBS[reason]
    rest = reason.value.partition(singular)[2]
    return " and ".join(sensors) + (singular if len(sensors) == 1 else plural) + rest


def _sensors(reason: StopReason, state: SensorState) -> list[str]:
    """Return the sensors behind a reason; none for one that does not come from a single sensor."""
    bits, currents = state.bumps_wheeldrops, state.motor_overcurrents
    of_reason: dict[StopReason, dict[str, int]] = {
        StopReason.BUMPER: {"left bumper": bits & BUMP_LEFT, "right bumper": bits & BUMP_RIGHT},
        StopReason.WHEEL_DROP: {
            "left wheel": bits & DROP_LEFT,
            "right wheel": bits & DROP_RIGHT,
            "caster": bits & DROP_CASTER,
        },
        StopReason.CLIFF: {
            "left cliff sensor": state.cliff_left,
            "front left cliff sensor": state.cliff_front_left,
            "front right cliff sensor": state.cliff_front_right,
            "right cliff sensor": state.cliff_right,
        },
        StopReason.OVERCURRENT: {
            "left wheel": currents & LEFT_WHEEL_OVERCURRENT,
            "right wheel": currents & RIGHT_WHEEL_OVERCURRENT,
        },
    }
    return [f"the {name}" for name, seen in of_reason.get(reason, {}).items() if seen]


class OvercurrentWatch:
    """A watch that tells whether a wheel motor is blocked, by the overcurrent flags of packet 14."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._blocked_at = -math.inf

    def look(self, state: SensorState, now: float) -> bool:
        """Take all sensors; True from half a second of overcurrent on until the motor has rested."""
        if not state.motor_overcurrents & WHEEL_OVERCURRENTS:
            self._since = None
        elif self._since is None or now < self._since:
            self._since = now
        elif now - self._since >= OVERCURRENT_TIMEOUT_S:
            self._blocked_at = now
        return 0.0 <= now - self._blocked_at < OVERCURRENT_REST_S


def contact(
    state: SensorState, *, use_bumpers: bool, use_cliffs: bool, lowest_charge: float = 0.0
) -> StopReason | None:
    """Return what the base's own sensors object to, the worst first; None when all is well.

    On the home base the cliff sensors count for nothing: its plate looks to them like a missing floor
    (REFERENCE 2.7, row "Cliff Sensor").

    Args:
        state: All sensors.
        use_bumpers: Whether bumpers and wheel drops count.
        use_cliffs: Whether cliff sensors count.
        lowest_charge: The charge, as a fraction of the capacity, below which nothing moves any more; a charge
            that is not known counts as below.
    """
    docked = bool(state.charging_sources_available & HOME_BASE)
    if use_bumpers and state.bumps_wheeldrops & WHEEL_DROPS:
        return StopReason.WHEEL_DROP
    if state.charging_sources_available & INTERNAL_CHARGER:
        return StopReason.CHARGER
    if use_cliffs and state.cliff and not docked:
        return StopReason.CLIFF
    if use_bumpers and state.bumps_wheeldrops & BUMPS:
        return StopReason.BUMPER
    if docked:
        return StopReason.DOCK
    return StopReason.BATTERY if is_below(charge_fraction(state), lowest_charge) else None


def lost_mode(state: SensorState, wanted: OiMode) -> StopReason | None:
    """Tell why the base is not in the drive mode asked for; None when it is, or is meant to be passive.

    A dock is not an obstacle (the base drives off it), the plug of the charger is one: REFERENCE 2.4, row 9.
    """
    if wanted < OiMode.SAFE or state.in_drive_mode:
        return None
    touched = contact(state, use_bumpers=True, use_cliffs=True)
    return StopReason.MODE_LOST if touched in (None, StopReason.DOCK) else touched


def hold_forward(wheels: WheelSpeeds, objection: StopReason | None) -> WheelSpeeds:
    """Stand still instead of driving against an objection; most leave reverse and pure spins allowed.

    Source: REFERENCE 2.4, row "Bump".
    """
    if objection is None:
        return wheels
    return STOPPED if wheels.forward or objection in HOLDS_ALL else wheels


LOW_IN_PASSIVE, LOW_IN_FULL = 0.93, 0.15
"""Charge as a fraction of the capacity below which a base is to charge."""

CHARGING_TIMEOUT_S = 10.0
"""A charger that was just plugged in takes a moment to begin."""

RESET_PAUSE_S = 300.0
"""Between two resets: one that did not help will not help at once."""

_LOW: dict[int, float] = {OiMode.PASSIVE: LOW_IN_PASSIVE, OiMode.FULL: LOW_IN_FULL}
_NOT_CHARGING = (ChargingState.NOT_CHARGING, ChargingState.FAULT)


def needs_reset(state: SensorState) -> bool:
    """Tell whether the base stands at a charger and does not charge, with a low battery or one not known."""
    if not state.charging_sources_available or state.charging_state not in _NOT_CHARGING:
        return False
    return battery_of(state).is_below(_LOW.get(state.oi_mode, 0.0))


class ChargeWatch:
    """Tells when to reset: after a while of standing there in vain, and not again and again."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._last = -math.inf

    def is_due(self, state: SensorState, stamp: float, *, standing: bool) -> bool:
        """Take a state; True starts the pause before the next reset.

        Args:
            state: All sensors.
            stamp: Seconds.
            standing: Nobody wants the base to move.
        """
        if not (standing and needs_reset(state)):
            self._since = None
            return False
        if self._since is None or stamp < self._since:
            self._since = stamp
        if stamp - self._since < CHARGING_TIMEOUT_S or 0.0 <= stamp - self._last < RESET_PAUSE_S:
            return False
        self._last = stamp
        return True
