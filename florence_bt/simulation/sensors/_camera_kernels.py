"""Ray casting for the Kinect, compiled.

Each shape is tested only against the pixels that its bounding box can cover, which is many times cheaper
than general ray casting. MuJoCo's rays give the same answers the slow way; the tests compare the two.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, hit, place_corners
from florence_bt.simulation.sensors.scene import BOX, PLANE, Lens, Shapes

NEAR_M = 0.05
"""What is nearer than this to a camera is not drawn."""


@numba.njit(cache=True, error_model="numpy")
def _screen_box(corners: Floats) -> tuple[float, float, float, float, float]:
    """Bounds of a box in the picture, as x/z and y/z, and its nearest z; empty when behind the camera."""
    left = top = np.inf
    right = bottom = -np.inf
    nearest = np.inf
    for a in range(8):
        nearest = min(nearest, corners[a, 2])
        for axis in range(3):
            b = a | (1 << axis)
            if b == a:
                continue
            for end in range(2):
                here, other = (a, b) if end == 0 else (b, a)
                x, y, z = corners[here, 0], corners[here, 1], corners[here, 2]
                if z < NEAR_M:
                    if corners[other, 2] < NEAR_M:
                        continue
                    part = (NEAR_M - z) / (corners[other, 2] - z)
                    x += part * (corners[other, 0] - x)
                    y += part * (corners[other, 1] - y)
                    z = NEAR_M
                left, right = min(left, x / z), max(right, x / z)
                top, bottom = min(top, y / z), max(bottom, y / z)
    return left, right, top, bottom, nearest


@numba.njit(cache=True, error_model="numpy")
def _direction(turn: Floats, y: float) -> tuple[float, float, float]:
    """The ray (0, y, 1) of the optical frame in a shape's frame."""
    return turn[1, 0] * y + turn[2, 0], turn[1, 1] * y + turn[2, 1], turn[1, 2] * y + turn[2, 2]


@numba.njit(cache=True, error_model="numpy")
def _draw(
    kind: int,
    size: Floats,
    start: Floats,
    turn: Floats,
    y: float,
    first_x: float,
    step_x: float,
    row: int,
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
) -> None:
    """Draw a shape into a part of a picture's line; the rays are (x, y, 1) in the optical frame."""
    along_x, along_y, along_z = _direction(turn, y)
    across_x, across_y, across_z = turn[0, 0], turn[0, 1], turn[0, 2]
    for u in range(len(depth)):
        x = first_x + u * step_x
        t = hit(
            kind,
            size,
            start[0],
            start[1],
            start[2],
            along_x + across_x * x,
            along_y + across_y * x,
            along_z + across_z * x,
        )
        if NEAR_M <= t < depth[u]:
            depth[u] = t
            rows[u] = row


@numba.njit(cache=True, error_model="numpy")
def _draw_box(
    size: Floats,
    start: Floats,
    turn: Floats,
    y: float,
    first_x: float,
    step_x: float,
    row: int,
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
) -> None:
    """As :func:`_draw` for a box, without branches, so that several pixels are computed at once."""
    low_x, low_y, low_z = -size[0] - start[0], -size[1] - start[1], -size[2] - start[2]
    high_x, high_y, high_z = size[0] - start[0], size[1] - start[1], size[2] - start[2]
    along_x, along_y, along_z = _direction(turn, y)
    across_x, across_y, across_z = turn[0, 0], turn[0, 1], turn[0, 2]
    for u in range(len(depth)):
        x = first_x + u * step_x
        ix = 1.0 / (along_x + across_x * x)
        iy = 1.0 / (along_y + across_y * x)
        iz = 1.0 / (along_z + across_z * x)
        ax, bx = low_x * ix, high_x * ix
        ay, by = low_y * iy, high_y * iy
        az, bz = low_z * iz, high_z * iz
        ex, lx = (ax, bx) if ax < bx else (bx, ax)
        ey, ly = (ay, by) if ay < by else (by, ay)
        ez, lz = (az, bz) if az < bz else (bz, az)
        enter = ex if ex > ey else ey
        enter = enter if enter > ez else ez
        leave = lx if lx < ly else ly
        leave = leave if leave < lz else lz
        better = (enter <= leave) & (enter >= NEAR_M) & (enter < depth[u])
        depth[u] = enter if better else depth[u]
        rows[u] = row if better else rows[u]


@numba.njit(cache=True, error_model="numpy")
def cast_picture(
    shapes: Shapes,
    origin: Floats,
    orientation: Floats,
    lens: Lens,
    max_depth: float,
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
) -> None:
    """Measure what a pinhole camera sees.

    Args:
        shapes: What there is.
        origin: Shape (3,), the camera in the map frame.
        orientation: Shape (3, 3), from the optical to the map frame.
        lens: The camera.
        max_depth: What is further along the axis is left out, metres.
        depth: Shape (height, width); is filled with metres along the axis, infinite where nothing is met.
        rows: Shape (height, width); is filled with the row of the scene that is seen, -1 for none.
    """
    kind, position, rotation, size, reach, _, _ = shapes
    focal, cx, cy = lens
    height, width = depth.shape
    depth[:] = np.inf
    rows[:] = -1
    corners = np.empty((8, 3))
    axis = np.ascontiguousarray(orientation[:, 2])
    for row in range(len(kind)):
        offset = origin - position[row]
        ahead = -(offset @ axis)
        if ahead + reach[row] < NEAR_M or ahead - reach[row] > max_depth:
            continue
        turn = orientation.T @ rotation[row]
        first_u, last_u, first_v, last_v = 0, width - 1, 0, height - 1
        if kind[row] != PLANE:
            place_corners(corners, kind[row], size[row], -(orientation.T @ offset), turn)
            left, right, top, bottom, nearest = _screen_box(corners)
            if nearest > max_depth or left > right:
                continue
            first_u = int(max(0.0, math.ceil(focal * left + cx - 1e-6)))
            last_u = int(min(width - 1.0, math.floor(focal * right + cx + 1e-6)))
            first_v = int(max(0.0, math.ceil(focal * top + cy - 1e-6)))
            last_v = int(min(height - 1.0, math.floor(focal * bottom + cy + 1e-6)))
        start = rotation[row].T @ offset
        for v in range(first_v, last_v + 1):
            y = (v - cy) / focal
            line, line_rows = depth[v, first_u : last_u + 1], rows[v, first_u : last_u + 1]
            first_x = (first_u - cx) / focal
            if kind[row] == BOX:
                _draw_box(size[row], start, turn, y, first_x, 1.0 / focal, row, line, line_rows)
            else:
                _draw(kind[row], size[row], start, turn, y, first_x, 1.0 / focal, row, line, line_rows)
    for v in range(height):
        for u in range(width):
            if depth[v, u] > max_depth:
                depth[v, u] = np.inf
                rows[v, u] = -1
