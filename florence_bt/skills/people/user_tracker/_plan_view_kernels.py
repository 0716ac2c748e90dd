"""The hot loop of the detector: from a depth picture to points and a plan view of what is tall."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


@njit(cache=True)
def project_to_plan(
    depth: F32,
    intrinsics: F64,
    rotation: F64,
    translation: F64,
    limits: F64,
    cell: float,
    shape: tuple[int, int],
) -> tuple[F32, I32, I32]:  # pragma: no cover - compiled
    """Project a depth picture into the robot's frame and into a plan view from above.

    Args:
        depth: Shape (h, w), metres along the optical axis.
        intrinsics: fx, fy, cx, cy in pixels.
        rotation: Shape (3, 3), robot frame from optical frame.
        translation: Shape (3,), metres.
        limits: lowest and highest height, height from which a point counts as tall, largest depth, x and y of
            the plan view's corner; metres.
        cell: Metres per cell of the plan view.
        shape: Rows (along y) and columns (along x) of the plan view.

    Returns:
        The points, shape (h, w, 3), NaN where there is none in the limits; the flat index of each point's
        cell, shape (h, w), -1 where there is none; the number of tall points in each cell, shape ``shape``.
    """
    height, width = depth.shape
    fx, fy, cx, cy = intrinsics
    low, high, tall, far, x0, y0 = limits
    rows, columns = shape
    points = np.full((height, width, 3), np.nan, np.float32)
    cells = np.full((height, width), -1, np.int32)
    tall_count = np.zeros((rows, columns), np.int32)
    for v in range(height):
        ray_y = (v - cy) / fy
        for u in range(width):
            d = depth[v, u]
            if not (0.0 < d < far):
                continue
            ray_x = (u - cx) / fx
            z = d * (rotation[2, 0] * ray_x + rotation[2, 1] * ray_y + rotation[2, 2]) + translation[2]
            if z < low or z > high:
                continue
            x = d * (rotation[0, 0] * ray_x + rotation[0, 1] * ray_y + rotation[0, 2]) + translation[0]
            y = d * (rotation[1, 0] * ray_x + rotation[1, 1] * ray_y + rotation[1, 2]) + translation[1]
            column = int(np.floor((x - x0) / cell))
            row = int(np.floor((y - y0) / cell))
            if 0 <= row < rows and 0 <= column < columns:
                points[v, u, 0] = x
                points[v, u, 1] = y
                points[v, u, 2] = z
                cells[v, u] = row * columns + column
                if z >= tall:
                    tall_count[row, column] += 1
    return points, cells, tall_count
