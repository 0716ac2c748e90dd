"""The battery as the base reports it, as far as that can be true.

A Create counts its charge in 16 bits and below zero on to 65,535: one that is empty says that it holds 65 Ah.
A number that cannot be true is not known; it is never taken for the nearest one that could be.
"""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.drivers.turtlebot.codec.packets import ChargingState
from florence_bt.drivers.turtlebot.codec.state import SensorState

VOLTAGE_MV = (6_000, 22_000)
"""Chosen: 12 cells of NiMH or four of lithium are far inside, and the base does not talk below."""
MOST_CURRENT_MA = 10_000
"""Chosen: more than all motors draw, or a charger gives."""
TEMPERATURE_C = (-30, 90)
"""Chosen: a battery is ruined outside."""
MOST_CAPACITY_MAH = 10_000
"""Chosen: one and a half times the largest that is sold for these bases."""
MOST_OVER_CAPACITY = 1.1
"""Chosen: the capacity is an estimate of the base's, which a fresh battery may exceed."""


@dataclass(frozen=True, slots=True)
class Battery:
    """The battery of a base; None is what is not known.

    Attributes:
        voltage_v: Volts.
        current_a: Amperes, negative while discharging.
        temperature_c: Degrees Celsius.
        charge_ah: What is left.
        capacity_ah: What it holds when full.
        fraction: The charge as a fraction of the capacity, 0 to 1.
        doubts: What the base says that cannot be true, a sentence each.
    """

    voltage_v: float | None
    current_a: float | None
    temperature_c: float | None
    charge_ah: float | None
    capacity_ah: float | None
    fraction: float | None
    doubts: tuple[str, ...] = ()

    def is_below(self, fraction: float) -> bool:
        """Tell whether the charge is below a fraction of the capacity, or may be; 0 for never."""
        return is_below(self.fraction, fraction)


def is_below(charge: float | None, fraction: float) -> bool:
    """Tell whether a charge is below a fraction of the capacity, or may be, as it is not known.

    Args:
        charge: As a fraction of the capacity; None when it is not known.
        fraction: 0 for never.
    """
    return fraction > 0.0 and (charge is None or charge < fraction)


def charge_fraction(state: SensorState) -> float | None:
    """Return the charge as a fraction of the capacity, 0 to 1; None when it is not known."""
    has_capacity = 0 < state.capacity <= MOST_CAPACITY_MAH
    if not has_capacity or state.charge > MOST_OVER_CAPACITY * state.capacity:
        return None
    return min(1.0, state.charge / state.capacity)


def battery_of(state: SensorState) -> Battery:
    """Return what is known of the battery.

    Args:
        state: All sensors.
    """
    has_capacity = 0 < state.capacity <= MOST_CAPACITY_MAH
    fraction = charge_fraction(state)
    known = {
        "voltage": VOLTAGE_MV[0] <= state.voltage <= VOLTAGE_MV[1],
        "current": abs(state.current) <= MOST_CURRENT_MA,
        "temperature": TEMPERATURE_C[0] <= state.temperature <= TEMPERATURE_C[1],
        "charge": fraction is not None,
        "capacity": has_capacity,
    }
    said = {
        "voltage": f"{state.voltage / 1000:g} V",
        "current": f"{state.current / 1000:g} A",
        "temperature": f"{state.temperature} C",
        "charge": f"{state.charge / 1000:g} Ah of {state.capacity / 1000:g}",
        "capacity": f"{state.capacity / 1000:g} Ah",
    }
    if not has_capacity:
        del said["charge"]  # says nothing without it
    return Battery(
        state.voltage / 1000 if known["voltage"] else None,
        state.current / 1000 if known["current"] else None,
        float(state.temperature) if known["temperature"] else None,
        state.charge / 1000 if known["charge"] else None,
        state.capacity / 1000 if known["capacity"] else None,
        fraction,
        tuple(f"the base says {text} for the {name}" for name, text in said.items() if not known[name]),
    )


def is_full(state: SensorState) -> bool:
    """Tell whether the charger keeps a battery full that is known to be."""
    return state.charging_state == ChargingState.TRICKLE and battery_of(state).fraction == 1.0
