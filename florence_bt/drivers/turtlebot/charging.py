"""When a base at a charger that does not charge is to be reset (REFERENCE 2.4, rows 6 and 7)."""

from __future__ import annotations

import math

from florence_bt.drivers.turtlebot.codec.packets import ChargingState, OiMode
from florence_bt.drivers.turtlebot.codec.state import SensorState

LOW_IN_PASSIVE, LOW_IN_FULL = 0.93, 0.15
"""Charge as a fraction of the capacity below which a base is to charge."""

PATIENCE_S = 10.0
"""A charger that was just plugged in takes a moment to begin."""

PAUSE_S = 300.0
"""Between two resets: one that did not help will not help at once."""

_LOW: dict[int, float] = {OiMode.PASSIVE: LOW_IN_PASSIVE, OiMode.FULL: LOW_IN_FULL}
_NOT_CHARGING = (ChargingState.NOT_CHARGING, ChargingState.FAULT)


def needs_reset(state: SensorState) -> bool:
    """Whether the base stands at a charger with a low battery and does not charge."""
    if not state.charging_sources_available or state.charging_state not in _NOT_CHARGING:
        return False
    return state.charge < _LOW.get(state.oi_mode, 0.0) * state.capacity


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
        if stamp - self._since < PATIENCE_S or 0.0 <= stamp - self._last < PAUSE_S:
            return False
        self._last = stamp
        return True
