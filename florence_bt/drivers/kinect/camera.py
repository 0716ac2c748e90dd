"""The optics of the Kinect: which point in space a depth pixel means. Source: REFERENCE 5.4."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import CameraModel

FOCAL_LENGTH_AT_640 = 525.0
"""Pixels; the default of openni_camera for an uncalibrated Kinect."""


DEPTH_SHIFT_AT_640 = (-5.0, -4.0)
"""Pixels, across and down: the optical axis of the depth camera against that of the colour camera."""

BASELINE_M = 0.024
"""The colour camera is so far to the right of the depth camera."""


class View(enum.Enum):
    """The places from which a depth image may be taken."""

    SHARED = "shared"
    """One lens for depth and colour, as the simulated Kinect has."""
    DEPTH = "depth"
    """From the depth camera."""
    COLOUR = "colour"
    """From the depth camera, and moved by the library to what the colour camera would see ("registered")."""


def camera_model(width: int, height: int, view: View = View.SHARED) -> CameraModel:
    """Return the uncalibrated camera at a resolution.

    Args:
        width: Columns.
        height: Rows.
        view: The depth camera's own optical axis is not in the middle; all others' are.
    """
    scale = width / 640.0
    across, down = DEPTH_SHIFT_AT_640 if view is View.DEPTH else (0.0, 0.0)
    return CameraModel(
        width,
        height,
        FOCAL_LENGTH_AT_640 * scale,
        FOCAL_LENGTH_AT_640 * scale,
        width / 2.0 - 0.5 + across * scale,
        height / 2.0 - 0.5 + down * scale,
    )


def depth_to_points(depth: NDArray[np.float32], camera: CameraModel) -> NDArray[np.float32]:
    """Return the points that a depth image shows.

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
