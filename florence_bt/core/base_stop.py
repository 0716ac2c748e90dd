"""The stop of the base: its driver says what holds it, and whoever drives it minds that."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.outcome import Result, failure

HELD = ("wheel_drop", "overcurrent", "no_response", "charger", "battery")
"""Causes that keep the base from every motion, a goal ends at once (codes of
florence_interfaces/StopReason)."""

TOUCHES = ("bumper", "cliff", "dock")
"""Causes that keep the base from driving forward; a drive backs off first, a turn in place is not touched."""


@dataclass(frozen=True, slots=True)
class BaseStop:
    """The reason why the base is held.

    Codes that are neither of the two kinds below pass by themselves, such as a gyro that is calibrated.

    Attributes:
        code: One word, empty when nothing holds it.
        text: A sentence that names the sensor.
    """

    code: str = ""
    text: str = ""

    @property
    def holds_all(self) -> bool:
        """Tell whether no motion is possible: a goal ends at once."""
        return self.code in HELD

    @property
    def holds_forward(self) -> bool:
        """Tell whether the base can still back off and turn."""
        return self.code in TOUCHES

    def failure(self, text: str = "") -> Result:
        """End a goal because of it, with another text than its own where one is given."""
        return failure(self.code, text or self.text)
