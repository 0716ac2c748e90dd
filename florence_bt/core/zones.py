"""Zones of a map: where no part of the robot is to get in, and where it is to drive slowly."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.polygons import Polygon, contains

KEEP_OUT, SLOW = "keep_out", "slow"
KINDS = (KEEP_OUT, SLOW)
MAX_ZONES, MAX_CORNERS = 100, 1000
"""So many zones are looked at in each cycle, and marked in a map within some 50 ms."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the map with a rule for driving.

    Attributes:
        label: Its name.
        kind: ``keep_out`` or ``slow``.
        polygon: Its corners in order, map frame, metres.
        speed_limit: Of a slow zone: m/s, or a share of the greatest speed (0..1).
        is_share: Which of the two it is.
    """

    label: str
    kind: str
    polygon: Polygon
    speed_limit: float = 0.0
    is_share: bool = False

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point (map frame, metres) is inside."""
        return contains(self.polygon, x, y)

    def limit_mps(self, greatest: float) -> float:
        """Return the limit in m/s, given the greatest speed of the robot."""
        return self.speed_limit * greatest if self.is_share else self.speed_limit

    @property
    def limit_text(self) -> str:
        """The limit as in the file, empty for a keep-out zone."""
        if self.kind != SLOW:
            return ""
        return f"{100.0 * self.speed_limit:.10g} %" if self.is_share else f"{self.speed_limit:.10g} m/s"
