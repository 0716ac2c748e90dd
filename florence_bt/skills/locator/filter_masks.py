"""The zones as masks of the map, for Nav2's costmap filters (KeepoutFilter and SpeedFilter)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from florence_bt.core.polygons import cells_inside
from florence_bt.core.sensing import FREE, OCCUPIED, OccupancyGrid
from florence_bt.core.zones import KEEP_OUT, Zone

KEEP_OUT_TYPE, SPEED_LIMIT_TYPE = 0, 2
"""``type`` of nav2_msgs/CostmapFilterInfo: keep-out, and a speed limit in m/s."""
MPS_PER_VALUE = 0.01
"""m/s for each step of the speed mask, whose values are 1 to 100; 0 is no limit."""


def keep_out_mask(zones: Iterable[Zone], grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map's cells with 100 in every keep-out zone, and 0 elsewhere."""
    cells = np.full(grid.cells.shape, FREE, np.int8)
    for zone in zones:
        if zone.kind == KEEP_OUT:
            cells[_inside(zone, grid)] = OCCUPIED
    return replace(grid, cells=cells)


def speed_mask(zones: Iterable[Zone], grid: OccupancyGrid, greatest: float) -> OccupancyGrid:
    """Return the map's cells with the lowest limit of the slow zones there, and 0 elsewhere.

    Args:
        zones: The zones.
        grid: The map.
        greatest: What shares are of, m/s.
    """
    cells = np.full(grid.cells.shape, FREE, np.int8)
    slow = [zone for zone in zones if zone.kind != KEEP_OUT]
    for zone in sorted(slow, key=lambda zone: -zone.limit_mps(greatest)):
        cells[_inside(zone, grid)] = max(1, min(100, round(zone.limit_mps(greatest) / MPS_PER_VALUE)))
    return replace(grid, cells=cells)


def _inside(zone: Zone, grid: OccupancyGrid) -> np.ndarray:
    return cells_inside(zone.polygon, (grid.origin.x, grid.origin.y), grid.resolution, grid.cells.shape)
