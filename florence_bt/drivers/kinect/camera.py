"""The optics of the Kinect: which point in space a depth pixel means. Source: REFERENCE 5.4."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import CameraModel

FOCAL_LENGTH_AT_640 = 525.0
"""Pixels; the default of openni_camera for an uncalibrated Kinect."""


def camera_model(width: int, height: int) -> CameraModel:
    """The uncalibrated camera at a resolution; colour and depth share it."""
    focal_length = FOCAL_LENGTH_AT_640 * width / 640.0
    return CameraModel(width, height, focal_length, focal_length, width / 2.0 - 0.5, height / 2.0 - 0.5)


def depth_to_points(depth: NDArray[np.float32], camera: CameraModel) -> NDArray[np.float32]:
    """The points that a depth picture shows.

    Args:
        depth: Shape (height, width), metres along z; NaN where nothing was measured.
        camera: The camera model of that size.

    Returns:
        Shape (height, width, 3), metres in the optical frame (x right, y down, z forward); NaN stays NaN.
    """
    across = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(np.float32)
    down = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)
    points = np.empty((*depth.shape, 3), np.float32)
    np.multiply(depth, across, out=points[..., 0])
    np.multiply(depth, down[:, np.newaxis], out=points[..., 1])
    points[..., 2] = depth
    return points
