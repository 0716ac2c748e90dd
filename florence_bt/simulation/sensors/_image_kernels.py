"""Turns what a camera ray meets into what a Kinect says: raw disparities with noise, and a shaded image."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, outward_normal
from florence_bt.simulation.sensors.scene import Lens, Shapes

NO_VALUE = 2047
"""Raw disparity of a pixel without a measurement. Source: REFERENCE 5.3."""

FORMULA_A = (3.3309495161, 0.0030711016)
"""z = 1 / (a - b raw). Source: REFERENCE 5.3, formula A."""

_EDGE_JUMP_M = 0.08
_EDGE_LOST = 0.35
_EDGE_SWAPPED = 0.5

_NOTHING_LEVEL = 205
"""Grey level of the ceiling, which is not a shape."""


@numba.njit(cache=True, error_model="numpy")
def to_raw(
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
    noise: NDArray[np.float32],
    chance: NDArray[np.float32],
    nearest: float,
    furthest: float,
    raw: NDArray[np.uint16],
) -> None:
    """Quantise a depth image as the Kinect does; at edges pixels are lost or take the other side's depth.

    Args:
        depth: Shape (height, width), metres along the axis.
        rows: Shape (height, width), what is seen.
        noise: Shape (height, width), added to the raw value.
        chance: Shape (height, width), uniform in [0, 1).
        nearest: What is nearer gives no value, metres.
        furthest: What is further gives no value, metres.
        raw: Shape (height, width); is filled.
    """
    height, width = depth.shape
    raw_per_inverse_metre = 1.0 / FORMULA_A[1]
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            value = (FORMULA_A[0] - 1.0 / z) * raw_per_inverse_metre + noise[v, u] + 0.5
            raw[v, u] = np.uint16(value) if nearest <= z <= furthest else np.uint16(NO_VALUE)
    _spoil_edges(depth, rows, chance, raw)


@numba.njit(cache=True, error_model="numpy")
def _spoil_edges(
    depth: NDArray[np.float32], rows: NDArray[np.int16], chance: NDArray[np.float32], raw: NDArray[np.uint16]
) -> None:
    """Spoil pixels where things meet at different depths: no value, or that of the next column."""
    height, width = depth.shape
    for v in range(height):
        up, down = max(v - 1, 0), min(v + 1, height - 1)
        for u in range(width):
            row, left, right = rows[v, u], max(u - 1, 0), min(u + 1, width - 1)
            if rows[v, left] == row and rows[v, right] == row and rows[up, u] == row and rows[down, u] == row:
                continue
            z = depth[v, u]
            jump = max(
                abs(depth[v, left] - z),
                abs(depth[v, right] - z),
                abs(depth[up, u] - z),
                abs(depth[down, u] - z),
            )
            if jump > _EDGE_JUMP_M:
                if chance[v, u] < _EDGE_LOST:
                    raw[v, u] = NO_VALUE
                elif chance[v, u] < _EDGE_SWAPPED:
                    raw[v, u] = raw[v, left]


@numba.njit(cache=True, error_model="numpy")
def shade(
    shapes: Shapes,
    origin: Floats,
    orientation: Floats,
    lens: Lens,
    light: Floats,
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
    noise: NDArray[np.int8],
    pixels: NDArray[np.uint8],
) -> None:
    """Colour an image.

    Args:
        shapes: What there is.
        origin: Shape (3,), the camera in the map frame.
        orientation: Shape (3, 3), from the optical to the map frame.
        lens: The camera.
        light: Shape (3,), unit vector towards the light, map frame.
        depth: Shape (height, width), metres along the axis.
        rows: Shape (height, width), what is seen, -1 for nothing.
        noise: Shape (height, width), levels to add.
        pixels: Shape (height, width, 3); is filled.
    """
    kind, position, rotation, size, _, colour, _ = shapes
    focal, cx, cy = lens
    height, width = depth.shape
    count = len(kind)
    start = np.empty((count, 3))
    turn = np.empty((count, 3, 3))
    lamp = np.empty((count, 3))
    for row in range(count):
        start[row] = rotation[row].T @ (origin - position[row])
        turn[row] = rotation[row].T @ orientation
        lamp[row] = rotation[row].T @ light
    for v in range(height):
        y = (v - cy) / focal
        for u in range(width):
            row = rows[v, u]
            if row < 0:
                for channel in range(3):
                    pixels[v, u, channel] = _NOTHING_LEVEL
                continue
            x, z, m, o, la = (u - cx) / focal, depth[v, u], turn[row], start[row], lamp[row]
            dx = m[0, 0] * x + m[0, 1] * y + m[0, 2]
            dy = m[1, 0] * x + m[1, 1] * y + m[1, 2]
            dz = m[2, 0] * x + m[2, 1] * y + m[2, 2]
            nx, ny, nz = outward_normal(kind[row], size[row], o[0] + z * dx, o[1] + z * dy, o[2] + z * dz)
            facing = -(nx * dx + ny * dy + nz * dz) / math.sqrt(dx * dx + dy * dy + dz * dz)
            bright = 0.5 + 0.3 * max(0.0, nx * la[0] + ny * la[1] + nz * la[2]) + 0.2 * max(0.0, facing)
            for channel in range(3):
                level = colour[row, channel] * bright + noise[v, u]
                pixels[v, u, channel] = int(min(max(level, 0.0), 255.0))
