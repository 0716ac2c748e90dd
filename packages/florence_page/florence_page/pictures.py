"""Pictures for a browser: grids as PNG, one pixel a cell, the first row at the top; the camera's as JPEG."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import OCCUPIED, OccupancyGrid
from florence_bt.skills.navigation.map_server.image import encode_image

_UNKNOWN_GREY, _FREE_GREY, _WALL_GREY = 214, 255, 60
_COST_OPACITY = 150
CAMERA_WIDTH = 320
_JPEG_QUALITY = 70


def map_picture(grid: OccupancyGrid) -> bytes:
    """Draw a map: white where it is free, dark where something stands, grey where it is unknown."""
    shares = np.clip(grid.cells[::-1].astype(np.float64) / OCCUPIED, 0.0, 1.0)
    grey = _FREE_GREY + (_WALL_GREY - _FREE_GREY) * shares
    return encode_image(np.where(grid.cells[::-1] < 0, _UNKNOWN_GREY, grey).astype(np.uint8), None, "png")


def costmap_picture(grid: OccupancyGrid) -> bytes:
    """Draw a costmap, to be laid over the map: the darker, the more it costs to be there."""
    shares = np.clip(grid.cells[::-1].astype(np.float64) / OCCUPIED, 0.0, 1.0)
    return encode_image(np.zeros(shares.shape, np.uint8), (_COST_OPACITY * shares).astype(np.uint8), "png")


def camera_picture(colours: NDArray[np.uint8]) -> bytes:
    """Make a JPEG of what the camera sees, at most :data:`CAMERA_WIDTH` pixels wide.

    Args:
        colours: Shape (rows, columns, 3), RGB.
    """
    import cv2

    step = -(-colours.shape[1] // CAMERA_WIDTH)
    bgr = np.ascontiguousarray(colours[::step, ::step, ::-1])
    _, data = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY))
    return bytes(data)
