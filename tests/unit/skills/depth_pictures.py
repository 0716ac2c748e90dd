"""Depth pictures made by hand: a floor, a wall, and boxes before it."""

from __future__ import annotations

import numpy as np

from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaserParameters

CAMERA = CameraModel(320, 240, 262.5, 262.5, 159.5, 119.5)
CAMERA_HEIGHT = 0.54
WHOLE_BAND = FakeLaserParameters(min_height=-0.39, max_height=0.46, unseen_as_nan=True)
MIDDLE = WHOLE_BAND.beam_count // 2
DOWN = ((np.arange(CAMERA.height) - CAMERA.cy) / CAMERA.fy)[:, None]
RIGHT = ((np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx)[None, :]


def floor(tilt: float = 0.0) -> np.ndarray:
    """Depth of the floor, 4.5 m of wall above it; the camera tilted upwards by some radians."""
    slope = np.tan(np.arctan(DOWN) - tilt)
    with np.errstate(divide="ignore"):
        depth = np.where(slope > 0, CAMERA_HEIGHT / slope, np.inf)
    return np.broadcast_to(np.minimum(depth, 4.5), (240, 320)).copy()


def with_box(
    depth: np.ndarray, away: float, heights: tuple[float, float], left: float, right: float
) -> np.ndarray:
    """The picture with the front of a box between two heights, and two sides in metres to the left."""
    above, across = CAMERA_HEIGHT - DOWN * away, -RIGHT * away
    front = (above >= heights[0]) & (above <= heights[1]) & (across <= left) & (across >= right)
    return np.where(front & (depth > away), away, depth)


def picture(depth: np.ndarray) -> DepthImage:
    return DepthImage(7.0, "optical", CAMERA, depth.astype(np.float32))
