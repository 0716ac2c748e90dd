"""A plausible battery: drains with use, charges at the plug."""

from __future__ import annotations

NOT_CHARGING, FULL_CHARGING = 0, 2
CAPACITY_MAH = 2700.0
IDLE_MA, MOTORS_MA, CHARGER_MA = 250.0, 600.0, 1250.0
EMPTY_MV, FULL_MV = 13200.0, 16400.0
TEMPERATURE_C = 26


class Battery:
    """The charge over time.

    Attributes:
        charge_mah: What is left.
        current_ma: Negative while it drains.
        charging: Whether the charger works.
    """

    def __init__(self, charge_mah: float = 0.9 * CAPACITY_MAH) -> None:
        self.charge_mah = charge_mah
        self.current_ma = -IDLE_MA
        self.charging = False
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
        self.current_ma = CHARGER_MA if self.charging else -(IDLE_MA + load * MOTORS_MA)

    @property
    def charging_state(self) -> int:
        """Packet 21."""
        return FULL_CHARGING if self.charging else NOT_CHARGING

    @property
    def voltage_mv(self) -> int:
        """Packet 22: rises with the charge."""
        return round(EMPTY_MV + (FULL_MV - EMPTY_MV) * self.charge_mah / CAPACITY_MAH)
