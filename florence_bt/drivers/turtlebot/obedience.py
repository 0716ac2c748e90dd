"""Whether the base does what it is told: it says which wheel speeds it was told last (packets 41 and 42)."""

from __future__ import annotations

from collections import deque

from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.wheels import WheelSpeeds

PATIENCE_S = 1.0
"""Long enough for speeds to reach the base, and for the frame that tells them to come back."""


TOLERANCE_MMPS = 10
"""What a firmware may round a speed by before it tells it; no wire breaks that gently."""


class Obedience:
    """Compares the speeds that were sent with those that the base reports.

    A wire that is broken in one direction only leaves a base that reports well and drives on for ever.

    Attributes:
        lost: The base has reported for a while other speeds than any that were sent to it lately.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[float, WheelSpeeds]] = deque()
        self._doubted_since: float | None = None
        self.lost = False

    def clear(self) -> None:
        """Begin anew: nothing was sent yet that the base has to obey."""
        self._sent.clear()
        self._doubted_since = None
        self.lost = False

    def sent(self, wheels: WheelSpeeds, now: float) -> None:
        """Note speeds that went out."""
        if self._sent and now < self._sent[-1][0]:  # the clock was set back
            self.clear()
        if not self._sent or wheels != self._sent[-1][1]:
            self._sent.append((now, wheels))
        while len(self._sent) > 1 and now - self._sent[1][0] > PATIENCE_S:
            self._sent.popleft()

    def look(self, state: SensorState, now: float) -> None:
        """Take what the base reports."""
        if not self._sent:
            return
        told = WheelSpeeds(
            round(1000.0 * state.requested_left_velocity), round(1000.0 * state.requested_right_velocity)
        )
        if any(_near(wheels, told) for _, wheels in self._sent):
            self._doubted_since, self.lost = None, False
        elif self._doubted_since is None or now < self._doubted_since:
            self._doubted_since = now
        elif now - self._doubted_since > PATIENCE_S:
            self.lost = True


def _near(one: WheelSpeeds, other: WheelSpeeds) -> bool:
    differences = one.left_mmps - other.left_mmps, one.right_mmps - other.right_mmps
    return max(map(abs, differences)) <= TOLERANCE_MMPS
