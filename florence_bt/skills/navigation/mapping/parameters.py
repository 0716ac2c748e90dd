"""The parameters of mapping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive, check_order
from florence_bt.core.sensing import MAX_RESOLUTION_M, MIN_RESOLUTION_M


@dataclass(frozen=True, slots=True)
class SlamParameters(CheckedParameters):
    """The parameters of mapping.

    Attributes:
        resolution: Of the map, metres per cell.
        laser_min_range: Nearer beams are ignored: the robot's own structure, metres.
        laser_max_range: Farther beams are ignored, metres; 0 takes the scan's own limit.
        map_range: Beams mark and clear cells of the map up to here, metres.
        no_return_clears: A beam that met nothing clears cells up to here, metres: what is farther and dark,
            or looked at from the side, may have sent nothing back.
        keep_d: A scan is kept when the robot has driven so far since the last one that was, metres.
        keep_a: Or has turned so far, radians.
        close_loops: Whether places are recognised that the robot comes back to.
        loop_least_way: Only places that it has left for so long are looked for, metres driven.
        loop_fit: The part of the beams that has to fit there.
        find_panes: Whether mirrors, glass and what was touched become walls of the map, with nothing behind.
    """

    resolution: Annotated[float, Limits(MIN_RESOLUTION_M, MAX_RESOLUTION_M)] = 0.05
    laser_min_range: NotNegative = 0.25
    laser_max_range: NotNegative = 0.0
    map_range: Positive = 12.0
    no_return_clears: NotNegative = 3.0
    keep_d: Annotated[float, Limits(0.05, 1.0)] = 0.3
    keep_a: Annotated[float, Limits(0.05, 1.0)] = 0.3
    close_loops: bool = True
    loop_least_way: Positive = 8.0
    loop_fit: Annotated[float, Limits(0.0, 1.0)] = 0.6
    find_panes: bool = True

    def _check(self) -> None:
        check_order(self, ("laser_min_range", "map_range"))
        if self.laser_max_range:
            check_order(self, ("laser_min_range", "laser_max_range"))
