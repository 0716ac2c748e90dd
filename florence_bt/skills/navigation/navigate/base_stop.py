"""What the base says that holds it, and what a goal makes of it. Source: florence_interfaces/StopReason."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate.results import HELD_FAILURES, STOP_CODES, TOUCH_FAILURES


@dataclass(frozen=True, slots=True)
class BaseStop:
    """What holds the base.

    Codes that are neither of the two kinds below pass by themselves, such as a gyro that is calibrated.

    Attributes:
        code: One word, empty when nothing holds it.
        text: A sentence that names the sensor.
    """

    code: str = ""
    text: str = ""

    @property
    def holds_all(self) -> bool:
        """Whether no motion is possible: a goal ends at once."""
        return self.code in HELD_FAILURES

    @property
    def holds_forward(self) -> bool:
        """Whether the base can still back off and turn."""
        return self.code in TOUCH_FAILURES

    def failure(self, text: str = "") -> Result:
        """The end of a goal because of it, with another text than its own where one is given."""
        return failure(self.code, text or self.text, server_code=STOP_CODES[self.code])
