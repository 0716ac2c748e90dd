"""What becomes of rays that meet glass or a mirror, compiled.

Glass lets light through, unless it is met almost at a right angle: then enough comes back to the sensor. A
mirror sends light on, so that the sensor measures the way to whatever it shows, as far as that is: a place
behind the mirror. Nothing is lost or refracted, and a ray is followed over a few surfaces only.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, hit
from florence_bt.simulation.sensors.scene import BOX, CYLINDER, PLANE, Lens, Shapes

_GLASS, _MIRROR = 1, 2
"""``scene.SURFACES``."""

_MOST_SURFACES = 6
_STRAIGHT = math.cos(math.radians(8.0))
"""A ray this straight is sent back by glass (our guess: a scanner sees a pane only where it looks at it
squarely)."""

_BEYOND_M = 1e-6
"""Where a ray goes on: inside of the pane, whose surface is met from outside only."""


@numba.njit(cache=True, error_model="numpy")
def _nearest(shapes: Shapes, start: Floats, along: Floats, skip: int) -> tuple[float, int]:
    """The first shape that a ray meets, and the multiple of its direction; (infinite, -1) for none."""
    kind, position, rotation, size, reach, _, _ = shapes
    best, best_row = np.inf, -1
    length = math.sqrt(along @ along)
    for row in range(len(kind)):
        if row == skip:
            continue
        offset = start - position[row]
        middle = -(offset @ along) / length
        if kind[row] != PLANE and (
            middle + reach[row] < 0.0 or offset @ offset - middle * middle > reach[row] * reach[row]
        ):
            continue
        o, d = rotation[row].T @ offset, rotation[row].T @ along
        t = hit(kind[row], size[row], o[0], o[1], o[2], d[0], d[1], d[2])
        if t < best:
            best, best_row = t, row
    return best, best_row


@numba.njit(cache=True, error_model="numpy")
def _normal(shapes: Shapes, row: int, point: Floats) -> Floats:
    """The direction out of an upright surface at a point: of a box's nearest side, or away from an axis."""
    own = shapes.rotation[row].T @ (point - shapes.position[row])
    normal = np.zeros(3)
    if shapes.kind[row] == BOX:
        axis = int(np.argmin(shapes.size[row] - np.abs(own)))
        normal[axis] = 1.0 if own[axis] > 0.0 else -1.0
    elif shapes.kind[row] == CYLINDER:
        normal[:2] = own[:2] / max(math.hypot(own[0], own[1]), _BEYOND_M)
    else:
        normal[2] = 1.0
    return shapes.rotation[row] @ normal


@numba.njit(cache=True, error_model="numpy")
def _followed(shapes: Shapes, start: Floats, along: Floats, first: float, row: int) -> float:
    """How far a ray goes that meets a surface first: as a multiple of its direction."""
    total, t = 0.0, first
    for _ in range(_MOST_SURFACES):
        if row < 0 or shapes.surface[row] == 0:
            break
        start = start + t * along
        normal = _normal(shapes, row, start)
        across = along @ normal
        if shapes.surface[row] == _GLASS and -across > _STRAIGHT * math.sqrt(along @ along):
            break
        if shapes.surface[row] == _MIRROR:
            along = along - 2.0 * across * normal
        total += t
        t, row = _nearest(shapes, start + _BEYOND_M * along, along, row)
    return total + t


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
    for beam in range(len(distances)):
        if rows[beam] < 0 or shapes.surface[rows[beam]] == 0:
            continue
        angle = first_angle + increment * beam
        along = orientation @ np.array([math.cos(angle), math.sin(angle), 0.0])
        far = _followed(shapes, origin, along, distances[beam], rows[beam])
        distances[beam] = far if far <= max_range else np.inf


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
    """Correct what ``cast_picture`` measured where rays met glass or a mirror; arguments as there.

    The rows stay: in the colour picture glass and mirrors have their own colour.
    """
    focal, cx, cy = lens
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            if rows[v, u] < 0 or shapes.surface[rows[v, u]] == 0:
                continue
            along = orientation @ np.array([(u - cx) / focal, (v - cy) / focal, 1.0])
            far = _followed(shapes, origin, along, float(depth[v, u]), rows[v, u])
            depth[v, u] = far if far <= max_depth else np.inf
