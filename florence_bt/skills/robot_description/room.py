"""The room that the robot needs on the floor: navigation and who chooses places for it agree on it here."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.limits import CheckedParameters, NotNegative
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, Footprint, corners_from_flat

FOOTPRINT_PADDING_M = 0.01
"""Around the footprint (REFERENCE 7.4)."""
START_CLEARANCE_M = 0.35
"""So far the robot gets away from what it stands too near to; chosen: its radius and
two cells."""
BLOCKED_XY_TOLERANCE_M = 0.12
"""So much before a goal is near enough when something stands there; chosen: two cells
and what the localisation errs."""
RUN_UPS_M = (0.35, 0.45, 0.25)
"""Distances before a goal without room to turn in which to line up, the best first; chosen."""


@dataclass(frozen=True, slots=True)
class RoomParameters(CheckedParameters):
    """The parameters of navigation that decide where the robot gets to and fits.

    Attributes:
        footprint: x, y, x, y, ... of the corners in metres.
        footprint_padding: Metres added all around.
        start_clearance: As of ``PlannerParameters``, metres.
        blocked_xy_tolerance: As of ``ControllerParameters``, metres.
    """

    footprint: tuple[float, ...] = FLORENCE_FOOTPRINT
    footprint_padding: NotNegative = FOOTPRINT_PADDING_M
    start_clearance: NotNegative = START_CLEARANCE_M
    blocked_xy_tolerance: NotNegative = BLOCKED_XY_TOLERANCE_M

    def _check(self) -> None:
        self.make_footprint()

    def make_footprint(self) -> Footprint:
        """Return the padded footprint."""
        return Footprint.from_corners(corners_from_flat(self.footprint), self.footprint_padding)


DEFAULT_ROOM = RoomParameters()
