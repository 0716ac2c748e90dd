"""Ray casting for the Kinect, compiled.

Each shape is tested only against the pixels that its bounding box can cover, which is many times cheaper
than general ray casting. MuJoCo's rays give the same answers the slow way; the tests compare the two.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, Vector, place_corners, place_seen
from florence_bt.simulation.sensors.scene import BOX, CYLINDER, PLANE, SPHERE, Lens, Shapes

Depths = NDArray[np.float32]

NEAR_M = 0.05
"""Distance from a camera below which nothing is drawn."""


@numba.njit(cache=True, error_model="numpy")
def _screen_box(corners: Floats) -> tuple[float, float, float, float, float]:
    """Return the bounds of a box in the image, as x/z and y/z, and its nearest z; empty if behind."""
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
def _draw_plane(
    start: Floats, ray: Vector, slope: Vector, row: int, depth: Depths, rows: NDArray[np.int16]
) -> None:
    """Draw a plane as :func:`_draw_box` draws a box."""
    for u in range(len(depth)):
        t = -start[2] / (ray[2] + slope[2] * u)
        better = (t >= NEAR_M) & (t < depth[u]) & (start[2] > 0.0)
        depth[u] = t if better else depth[u]
        rows[u] = row if better else rows[u]


@numba.njit(cache=True, error_model="numpy")
def _draw_sphere(
    size: Floats, start: Floats, ray: Vector, slope: Vector, row: int, depth: Depths, rows: NDArray[np.int16]
) -> None:
    """Draw a sphere as :func:`_draw_box` draws a box."""
    c = start[0] * start[0] + start[1] * start[1] + start[2] * start[2] - size[0] * size[0]
    for u in range(len(depth)):
        dx, dy, dz = ray[0] + slope[0] * u, ray[1] + slope[1] * u, ray[2] + slope[2] * u
        a = dx * dx + dy * dy + dz * dz
        b = start[0] * dx + start[1] * dy + start[2] * dz
        d = b * b - a * c
        t = (-b - math.sqrt(max(d, 0.0))) / a
        better = (d >= 0.0) & (t >= NEAR_M) & (t < depth[u])
        depth[u] = t if better else depth[u]
        rows[u] = row if better else rows[u]


@numba.njit(cache=True, error_model="numpy")
def _draw_cylinder(
    size: Floats, start: Floats, ray: Vector, slope: Vector, row: int, depth: Depths, rows: NDArray[np.int16]
) -> None:
    """Draw a cylinder as :func:`_draw_box` draws a box."""
    c = start[0] * start[0] + start[1] * start[1] - size[0] * size[0]
    low, high = -size[1] - start[2], size[1] - start[2]
    for u in range(len(depth)):
        dx, dy, iz = ray[0] + slope[0] * u, ray[1] + slope[1] * u, 1.0 / (ray[2] + slope[2] * u)
        a, b = dx * dx + dy * dy, start[0] * dx + start[1] * dy
        d = b * b - a * c
        root = math.sqrt(max(d, 0.0))
        enter, leave = (-b - root) / a, (-b + root) / a
        enter = max(enter, min(low * iz, high * iz))
        leave = min(leave, max(low * iz, high * iz))
        better = (d >= 0.0) & (enter <= leave) & (enter >= NEAR_M) & (enter < depth[u])
        depth[u] = enter if better else depth[u]
        rows[u] = row if better else rows[u]


@numba.njit(cache=True, error_model="numpy")
def _draw_box(
    size: Floats, start: Floats, ray: Vector, slope: Vector, row: int, depth: Depths, rows: NDArray[np.int16]
) -> None:
    """Draw a box into a part of an image's line, without branches, so that many pixels are computed at once.

    Args:
        size: Shape (3,), of the box.
        start: Shape (3,), the camera in the box's frame.
        ray: What the first pixel looks along for a metre of depth, in the box's frame.
        slope: How that changes from pixel to pixel.
        row: Of the scene.
        depth: Shape (n,); what is nearer than what was drawn before is written.
        rows: Shape (n,), as the depth.
    """
    one, near = np.float32(1.0), np.float32(NEAR_M)
    low_x, high_x = np.float32(-size[0] - start[0]), np.float32(size[0] - start[0])
    low_y, high_y = np.float32(-size[1] - start[1]), np.float32(size[1] - start[1])
    low_z, high_z = np.float32(-size[2] - start[2]), np.float32(size[2] - start[2])
    ray_x, ray_y, ray_z = np.float32(ray[0]), np.float32(ray[1]), np.float32(ray[2])
    slope_x, slope_y, slope_z = np.float32(slope[0]), np.float32(slope[1]), np.float32(slope[2])
    for column in range(len(depth)):
        u = np.float32(np.int32(column))
        ix, iy, iz = one / (ray_x + slope_x * u), one / (ray_y + slope_y * u), one / (ray_z + slope_z * u)
        ax, bx = low_x * ix, high_x * ix
        ay, by = low_y * iy, high_y * iy
        az, bz = low_z * iz, high_z * iz
        enter = max(max(min(ax, bx), min(ay, by)), min(az, bz))
        leave = min(min(max(ax, bx), max(ay, by)), max(az, bz))
        better = (enter <= leave) & (enter >= near) & (enter < depth[column])
        depth[column] = enter if better else depth[column]
        rows[column] = row if better else rows[column]


@numba.njit(cache=True, error_model="numpy")
def _is_hidden(depth: Depths, nearest: float) -> bool:
    """Tell whether something whose nearest part is given would be behind all that is drawn of a line."""
    beyond = np.int32(0)
    for u in range(len(depth)):
        beyond += np.int32(depth[u] > np.float32(nearest))
    return beyond == 0


@numba.njit(cache=True, error_model="numpy")
def cast_image(
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
    corners, turn, centre, start = np.empty((8, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    nearest = np.full(len(kind), np.inf)
    bounds = np.empty((len(kind), 4), np.int64)
    for row in range(len(kind)):
        place_seen(centre, turn, start, position[row], rotation[row], origin, orientation)
        if centre[2] + reach[row] < NEAR_M or centre[2] - reach[row] > max_depth:
            continue
        if kind[row] == PLANE:
            nearest[row] = 0.0
            bounds[row] = 0, width - 1, 0, height - 1
            continue
        place_corners(corners, kind[row], size[row], centre, turn)
        left, right, top, bottom, first = _screen_box(corners)
        if left > right or first > max_depth:
            continue
        nearest[row] = first
        bounds[row, 0] = int(max(0.0, math.ceil(focal * left + cx - 1e-6)))
        bounds[row, 1] = int(min(width - 1.0, math.floor(focal * right + cx + 1e-6)))
        bounds[row, 2] = int(max(0.0, math.ceil(focal * top + cy - 1e-6)))
        bounds[row, 3] = int(min(height - 1.0, math.floor(focal * bottom + cy + 1e-6)))
    for row in np.argsort(nearest):  # the nearest first: what they hide need not be drawn
        if nearest[row] == np.inf:
            break
        first_u, last_u, first_v, last_v = bounds[row]
        if first_u > last_u:
            continue
        place_seen(centre, turn, start, position[row], rotation[row], origin, orientation)
        slope = (turn[0, 0] / focal, turn[0, 1] / focal, turn[0, 2] / focal)
        x = (first_u - cx) / focal
        for v in range(first_v, last_v + 1):
            y = (v - cy) / focal
            ray = (
                turn[0, 0] * x + turn[1, 0] * y + turn[2, 0],
                turn[0, 1] * x + turn[1, 1] * y + turn[2, 1],
                turn[0, 2] * x + turn[1, 2] * y + turn[2, 2],
            )
            line, line_rows = depth[v, first_u : last_u + 1], rows[v, first_u : last_u + 1]
            if _is_hidden(line, nearest[row]):
                continue
            if kind[row] == BOX:
                _draw_box(size[row], start, ray, slope, row, line, line_rows)
            elif kind[row] == CYLINDER:
                _draw_cylinder(size[row], start, ray, slope, row, line, line_rows)
            elif kind[row] == SPHERE:
                _draw_sphere(size[row], start, ray, slope, row, line, line_rows)
            else:
                _draw_plane(start, ray, slope, row, line, line_rows)
    for v in range(height):
        for u in range(width):
            if depth[v, u] > max_depth:
                depth[v, u] = np.inf
                rows[v, u] = -1
