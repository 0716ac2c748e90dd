"""Rays that meet glass or a mirror, compiled.

Glass lets light through, unless it is met almost at a right angle: then enough comes back to the sensor. A
mirror sends light on, so that the sensor measures the way to whatever it shows, as far as that is: a place
behind the mirror. Where it is met squarely it shows the sensor itself. Nothing is lost or refracted, and a
ray is followed over a few surfaces only.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, Vector, hit, outward_normal
from florence_bt.simulation.sensors.scene import PLANE, SPHERE, Lens, Shapes

_GLASS = 1
"""``scene.SURFACES``; what is neither plain nor glass is a mirror."""

_MOST_SURFACES = 6
"""Panes and mirrors that a ray meets. Chosen."""
_STRAIGHT = math.cos(math.radians(8.0))
"""A ray this straight is sent back by glass (our guess: a scanner sees a pane only where it looks at it
squarely)."""

_LASER_M, _KINECT_M = 0.025, 0.03
"""Half of the width of a URG-04LX and of the height of a Kinect: as a ball of this radius a mirror shows the
sensor. The rest of the robot it does not show."""

_BEYOND_M = 1e-6
"""Distance after which a ray goes on: inside of the pane, whose surface is met from outside only."""


@numba.njit(cache=True, error_model="numpy")
def _unturned(rotation: Floats, x: float, y: float, z: float) -> Vector:
    """Turn a vector of the map frame into a shape's frame."""
    return (
        rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
        rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
        rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
    )


@numba.njit(cache=True, error_model="numpy")
def _turned(rotation: Floats, x: float, y: float, z: float) -> Vector:
    """Turn a vector of a shape's or the sensor's frame into the map frame."""
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z,
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z,
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z,
    )


@numba.njit(cache=True, error_model="numpy")
def _nearest(shapes: Shapes, start: Vector, along: Vector, skip: int, furthest: float) -> tuple[float, int]:
    """Return the first shape that a ray meets, and the multiple of its direction; (infinite, -1) for none."""
    kind, position, rotation, size, reach, _, _ = shapes
    dx, dy, dz = along
    best, best_row = furthest, -1
    squared = dx * dx + dy * dy + dz * dz
    length = math.sqrt(squared)
    for row in range(len(kind)):
        x, y, z = start[0] - position[row, 0], start[1] - position[row, 1], start[2] - position[row, 2]
        if kind[row] != PLANE:
            middle, radius = -(x * dx + y * dy + z * dz), reach[row]
            if (
                middle + radius * length < 0.0
                or middle - radius * length > best * squared
                or (x * x + y * y + z * z - radius * radius) * squared > middle * middle
            ):
                continue
        if row == skip:
            continue
        ox, oy, oz = _unturned(rotation[row], x, y, z)
        ax, ay, az = _unturned(rotation[row], dx, dy, dz)
        t = hit(kind[row], size[row], ox, oy, oz, ax, ay, az)
        if t < best:
            best, best_row = t, row
    return (best, best_row) if best_row >= 0 else (np.inf, -1)


@numba.njit(cache=True, error_model="numpy")
def _normal(shapes: Shapes, row: int, point: Vector) -> Vector:
    """Return the direction out of a shape at a point of its surface."""
    at, turn = shapes.position[row], shapes.rotation[row]
    x, y, z = _unturned(turn, point[0] - at[0], point[1] - at[1], point[2] - at[2])
    nx, ny, nz = outward_normal(shapes.kind[row], shapes.size[row], x, y, z)
    return _turned(turn, nx, ny, nz)


@numba.njit(cache=True, error_model="numpy")
def _on(start: Vector, along: Vector, t: float) -> Vector:
    return start[0] + t * along[0], start[1] + t * along[1], start[2] + t * along[2]


@numba.njit(cache=True, error_model="numpy")
def _followed(
    shapes: Shapes, start: Vector, along: Vector, first: float, row: int, furthest: float, housing: Floats
) -> float:
    """Return how far a ray from a first surface goes: a multiple of its direction; infinite if too far.

    The sensor, where the ray starts, is a ball with the radius ``housing[0]``: a mirror may show it.
    """
    sensor = start
    total, t = 0.0, first
    for _ in range(_MOST_SURFACES):
        if row < 0 or shapes.surface[row] == 0:
            break
        start = _on(start, along, t)
        normal = _normal(shapes, row, start)
        across = along[0] * normal[0] + along[1] * normal[1] + along[2] * normal[2]
        if shapes.surface[row] == _GLASS:
            length = math.sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2])
            if -across > _STRAIGHT * length:
                break
        else:
            along = _on(along, normal, -2.0 * across)
        total += t
        t, row = _nearest(shapes, _on(start, along, _BEYOND_M), along, row, furthest - total)
        x, y, z = start[0] - sensor[0], start[1] - sensor[1], start[2] - sensor[2]
        itself = hit(SPHERE, housing, x, y, z, along[0], along[1], along[2])
        if itself < t:
            t, row = itself, -1
    return total + t if total + t <= furthest else np.inf


@numba.njit(cache=True, error_model="numpy")
def follow_beams(
    shapes: Shapes,
    origin: Floats,
    orientation: Floats,
    first_angle: float,
    increment: float,
    max_range: float,
    distances: Floats,
    rows: NDArray[np.int16],
) -> None:
    """Correct what ``cast_fan`` measured where beams met glass or a mirror; arguments as there."""
    start = (origin[0], origin[1], origin[2])
    housing = np.array([_LASER_M, 0.0, 0.0])
    for beam in range(len(distances)):
        if rows[beam] < 0 or shapes.surface[rows[beam]] == 0:
            continue
        angle = first_angle + increment * beam
        along = _turned(orientation, math.cos(angle), math.sin(angle), 0.0)
        distances[beam] = _followed(shapes, start, along, distances[beam], rows[beam], max_range, housing)


@numba.njit(cache=True, error_model="numpy")
def follow_pixels(
    shapes: Shapes,
    origin: Floats,
    orientation: Floats,
    lens: Lens,
    max_depth: float,
    depth: NDArray[np.float32],
    rows: NDArray[np.int16],
) -> None:
    """Correct what ``cast_image`` measured where rays met glass or a mirror; arguments as there.

    The rows stay: in the colour image glass and mirrors have their own colour.
    """
    focal, cx, cy = lens
    height, width = depth.shape
    start = (origin[0], origin[1], origin[2])
    housing = np.array([_KINECT_M, 0.0, 0.0])
    for v in range(height):
        for u in range(width):
            if rows[v, u] < 0 or shapes.surface[rows[v, u]] == 0:
                continue
            along = _turned(orientation, (u - cx) / focal, (v - cy) / focal, 1.0)
            depth[v, u] = _followed(shapes, start, along, float(depth[v, u]), rows[v, u], max_depth, housing)
