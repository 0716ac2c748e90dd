"""Differences between the sensors' view and the map: what they see and it does not know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.state import Costmaps

_MAP_MARGIN_CELLS = 2
"""Cells around the map's obstacles that belong to them. Chosen."""


class MapDifference:
    """Tells what the laser sees and the map does not know.

    Args:
        costmaps: What the map knows.

    """

    def __init__(self, costmaps: Costmaps) -> None:
        self._costmap: Costmap = costmaps.global_costmap
        known = binary_dilation(costmaps.static == LETHAL, iterations=_MAP_MARGIN_CELLS)
        self._known = known.astype(np.uint8)

    def is_known(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points (map frame) belong to something on the map or lie outside it; shape (n,)."""
        return self._costmap.costs_at(points, self._known) > 0
