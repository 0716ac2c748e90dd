"""Intersections of one ray with one shape, compiled; the other kernels build on them."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors.scene import BOX, CYLINDER, PLANE, SPHERE

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]

_TINY = 1e-12
"""A direction or a size below it is none."""


@numba.njit(cache=True, error_model="numpy")
def _slab(offset: float, slope: float, half: float) -> tuple[float, float]:
    """Return where a line enters and leaves the layer -half..half of one axis."""
    if abs(slope) < _TINY:
        if abs(offset) > half:
            return np.inf, -np.inf
        return -np.inf, np.inf
    a = (-half - offset) / slope
    b = (half - offset) / slope
    if a < b:
        return a, b
    return b, a


@numba.njit(cache=True, error_model="numpy")
def hit(kind: int, size: Floats, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    """Return where a ray meets a shape from outside.

    Args:
        kind: What the shape is.
        size: Its size, shape (3,).
        ox: Start of the ray in the shape's frame (with ``oy``, ``oz``), metres.
        oy: See ``ox``.
        oz: See ``ox``.
        dx: Direction in the shape's frame (with ``dy``, ``dz``), of any length.
        dy: See ``dx``.
        dz: See ``dx``.

    Returns:
        The multiple of the direction at which it is met, infinite for a miss.
    """
    if kind == PLANE:
        return -oz / dz if dz < -_TINY and oz > 0.0 else np.inf
    if kind == SPHERE:
        a = dx * dx + dy * dy + dz * dz
        b = ox * dx + oy * dy + oz * dz
        d = b * b - a * (ox * ox + oy * oy + oz * oz - size[0] * size[0])
        if d < 0.0 or -b < 0.0:
            return np.inf
        t = (-b - math.sqrt(d)) / a
        return t if t > 0.0 else np.inf
    if kind == BOX:
        enter, leave = _slab(ox, dx, size[0])
        a, b = _slab(oy, dy, size[1])
        enter, leave = max(enter, a), min(leave, b)
        a, b = _slab(oz, dz, size[2])
        enter, leave = max(enter, a), min(leave, b)
    else:
        enter, leave = _slab(oz, dz, size[1])
        a = dx * dx + dy * dy
        c = ox * ox + oy * oy - size[0] * size[0]
        if a < _TINY:
            if c > 0.0:
                return np.inf
        else:
            b = ox * dx + oy * dy
            d = b * b - a * c
            if d < 0.0:
                return np.inf
            root = math.sqrt(d)
            enter, leave = max(enter, (-b - root) / a), min(leave, (-b + root) / a)
    return enter if enter <= leave and enter > 0.0 else np.inf


@numba.njit(cache=True, error_model="numpy")
def outward_normal(kind: int, size: Floats, x: float, y: float, z: float) -> Vector:
    """Return the direction out of a shape at a point (x, y, z) of its surface, in its own frame."""
    if kind == PLANE:
        return 0.0, 0.0, 1.0
    if kind == SPHERE:
        return x / size[0], y / size[0], z / size[0]
    if kind == CYLINDER:
        radius = math.hypot(x, y)
        if size[1] - abs(z) < size[0] - radius:
            return 0.0, 0.0, 1.0 if z > 0.0 else -1.0
        return x / radius, y / radius, 0.0
    gap_x, gap_y, gap_z = size[0] - abs(x), size[1] - abs(y), size[2] - abs(z)
    if gap_x <= gap_y and gap_x <= gap_z:
        return 1.0 if x > 0.0 else -1.0, 0.0, 0.0
    if gap_y <= gap_z:
        return 0.0, 1.0 if y > 0.0 else -1.0, 0.0
    return 0.0, 0.0, 1.0 if z > 0.0 else -1.0


@numba.njit(cache=True, error_model="numpy")
def _half_sides(kind: int, size: Floats) -> Vector:
    """Return half of the sides of a shape's bounding box in its own frame."""
    if kind == SPHERE:
        return size[0], size[0], size[0]
    if kind == CYLINDER:
        return size[0], size[0], size[1]
    return size[0], size[1], size[2]


@numba.njit(cache=True, error_model="numpy")
def place_seen(
    centre: Floats,
    turn: Floats,
    start: Floats,
    position: Floats,
    rotation: Floats,
    origin: Floats,
    orientation: Floats,
) -> None:
    """Write a shape's place and rotation as seen from the sensor, and the sensor's place in its frame.

    Without numpy's products, which cost more for three numbers than all that is done with a shape.
    """
    for i in range(3):
        centre[i] = 0.0
        for k in range(3):
            centre[i] += orientation[k, i] * (position[k] - origin[k])
        for j in range(3):
            turn[i, j] = 0.0
            for k in range(3):
                turn[i, j] += orientation[k, i] * rotation[k, j]
    for i in range(3):
        start[i] = -(turn[0, i] * centre[0] + turn[1, i] * centre[1] + turn[2, i] * centre[2])


@numba.njit(cache=True, error_model="numpy")
def place_corners(corners: Floats, kind: int, size: Floats, centre: Floats, turn: Floats) -> None:
    """Write the eight corners of a bounding box, seen from the sensor; bit 0 of the index is x, and so on."""
    hx, hy, hz = _half_sides(kind, size)
    for corner in range(8):
        x = hx if corner & 1 else -hx
        y = hy if corner & 2 else -hy
        z = hz if corner & 4 else -hz
        for axis in range(3):
            corners[corner, axis] = centre[axis] + turn[axis, 0] * x + turn[axis, 1] * y + turn[axis, 2] * z
