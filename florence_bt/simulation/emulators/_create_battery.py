"""A plausible battery: drains with use, charges at a charger, warms up while it does."""

from __future__ import annotations

NOT_CHARGING, RECONDITIONING, FULL_CHARGING, TRICKLE, WAITING, FAULT = range(6)
"""The values of packet 21 (REFERENCE 1.5)."""

CAPACITY_MAH = 2700.0
IDLE_MA, MOTORS_MA = 250.0, 600.0
CHARGER_MA, TRICKLE_MA, RECONDITIONING_MA = 1250.0, 60.0, 200.0
EMPTY_MV, FULL_MV, CHARGING_LIFT_MV = 13200.0, 16400.0, 600.0
ROOM_C, TOO_WARM_C, COOL_AGAIN_C = 26.0, 45.0, 40.0
WARMING_C_PER_S = 0.006
"""While charging; with the cooling below that ends at 38 degrees."""
COOLING_S = 2000.0
DEEPLY_EMPTY = 0.02
"""Charge below which the charger begins gently, as a fraction of the capacity."""


class Battery:
    """The charge over time.

    Attributes:
        charge_mah: What is left.
        current_ma: Negative while it drains.
        charging: Whether a charger is there and may charge.
        faulty: The charger's contacts or the battery are bad.
        temperature_c: Of the battery.
    """

    def __init__(self, charge_mah: float = 0.9 * CAPACITY_MAH) -> None:
        self.charge_mah = charge_mah
        self.current_ma = -IDLE_MA
        self.charging = False
        self.faulty = False
        self.temperature_c = ROOM_C
        self._too_warm = False
        self._time: float | None = None

    def update(self, now: float, *, load: float) -> None:
        """Drain or charge up to now.

        Args:
            now: Seconds.
            load: How much the motors are asked for, 0 to 1.
        """
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        self.charge_mah += self.current_ma * elapsed / 3600.0
        self.charge_mah = max(0.0, min(CAPACITY_MAH, self.charge_mah))
        warming = WARMING_C_PER_S if self.charging_state == FULL_CHARGING else 0.0
        settled = ROOM_C + warming * COOLING_S
        self.temperature_c += (settled - self.temperature_c) * min(1.0, elapsed / COOLING_S)
        self._too_warm = self.temperature_c > (COOL_AGAIN_C if self._too_warm else TOO_WARM_C)
        self.current_ma = self._current(load)

    def _current(self, load: float) -> float:
        drain = -(IDLE_MA + load * MOTORS_MA)
        return {
            RECONDITIONING: RECONDITIONING_MA,
            FULL_CHARGING: CHARGER_MA,
            TRICKLE: TRICKLE_MA,
        }.get(self.charging_state, drain)

    @property
    def charging_state(self) -> int:
        """Packet 21."""
        if not self.charging:
            return NOT_CHARGING
        if self.faulty:
            return FAULT
        if self._too_warm:
            return WAITING
        if self.charge_mah >= CAPACITY_MAH:
            return TRICKLE
        return RECONDITIONING if self.charge_mah < DEEPLY_EMPTY * CAPACITY_MAH else FULL_CHARGING

    @property
    def voltage_mv(self) -> int:
        """Packet 22: rises with the charge, and while current flows in."""
        lift = CHARGING_LIFT_MV if self.current_ma > 0.0 else 0.0
        return round(EMPTY_MV + (FULL_MV - EMPTY_MV) * self.charge_mah / CAPACITY_MAH + lift)
