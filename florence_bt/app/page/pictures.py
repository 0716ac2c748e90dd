"""Grids as pictures for a browser: PNG, one pixel a cell, the first row at the top."""

from __future__ import annotations

import numpy as np

from florence_bt.core.sensing import OCCUPIED, OccupancyGrid
from florence_bt.skills.navigation.map_server.image import encode_image

_UNKNOWN_GREY, _FREE_GREY, _WALL_GREY = 214, 255, 60
_COST_OPACITY = 150


def map_picture(grid: OccupancyGrid) -> bytes:
    """Draw a map: white where it is free, dark where something stands, grey where it is unknown."""
    shares = np.clip(grid.cells[::-1].astype(np.float64) / OCCUPIED, 0.0, 1.0)
    grey = _FREE_GREY + (_WALL_GREY - _FREE_GREY) * shares
    return encode_image(np.where(grid.cells[::-1] < 0, _UNKNOWN_GREY, grey).astype(np.uint8), None, "png")


def costmap_picture(grid: OccupancyGrid) -> bytes:
    """Draw a costmap, to be laid over the map: the darker, the more it costs to be there."""
    shares = np.clip(grid.cells[::-1].astype(np.float64) / OCCUPIED, 0.0, 1.0)
    return encode_image(np.zeros(shares.shape, np.uint8), (_COST_OPACITY * shares).astype(np.uint8), "png")
