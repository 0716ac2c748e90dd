"""Ray casting for the laser scanner, compiled.

Each shape is tested only against the beams that its bounding box can cover, which is many times cheaper
than general ray casting. MuJoCo's rays give the same answers the slow way; the tests compare the two.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.sensors._ray_kernels import Floats, hit, place_corners, place_seen
from florence_bt.simulation.sensors.scene import PLANE, Shapes


@numba.njit(cache=True, error_model="numpy")
def _beam_span(corners: Floats, centre: Floats) -> tuple[float, float]:
    """Return the interval of angles that a bounding box covers in the plane of the beams."""
    middle = math.atan2(centre[1], centre[0])
    low = high = 0.0
    for corner in range(8):
        difference = math.atan2(corners[corner, 1], corners[corner, 0]) - middle
        difference -= 2 * math.pi * math.floor((difference + math.pi) / (2 * math.pi))
        low, high = min(low, difference), max(high, difference)
    if high - low >= math.pi - 1e-6:
        return -math.pi, math.pi
    return middle + low, middle + high


@numba.njit(cache=True, error_model="numpy")
def cast_fan(
    shapes: Shapes,
    origin: Floats,
    orientation: Floats,
    first_angle: float,
    increment: float,
    max_range: float,
    distances: Floats,
    rows: NDArray[np.int16],
) -> None:
    """Measure a fan of beams in the plane z = 0 of a sensor.

    Args:
        shapes: What there is.
        origin: Shape (3,), the sensor in the map frame.
        orientation: Shape (3, 3), from the sensor's to the map frame.
        first_angle: Angle of the first beam, radians.
        increment: Angle between beams, above zero, radians.
        max_range: Shapes further away are left out, metres.
        distances: Shape (n,); is filled with metres, infinite where nothing is met.
        rows: Shape (n,); is filled with the row of the scene that is met, -1 for none.
    """
    kind, position, rotation, size, reach, _, _ = shapes
    count = len(distances)
    distances[:] = np.inf
    rows[:] = -1
    corners, turn, centre, start = np.empty((8, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    cosines = np.cos(first_angle + increment * np.arange(count))
    sines = np.sin(first_angle + increment * np.arange(count))
    for row in range(len(kind)):
        place_seen(centre, turn, start, position[row], rotation[row], origin, orientation)
        if abs(centre[2]) > reach[row] or math.hypot(centre[0], centre[1]) - reach[row] > max_range:
            continue
        low, high = -math.pi, math.pi
        if kind[row] != PLANE:
            place_corners(corners, kind[row], size[row], centre, turn)
            lowest, highest = corners[:, 2].min(), corners[:, 2].max()
            if lowest > 0.0 or highest < 0.0:
                continue
            low, high = _beam_span(corners, centre)
        for lap in range(-1, 2):
            begin = math.ceil((low + 2 * math.pi * lap - first_angle) / increment - 1e-6)
            end = math.floor((high + 2 * math.pi * lap - first_angle) / increment + 1e-6)
            for beam in range(max(begin, 0), min(end + 1, count)):
                c, s = cosines[beam], sines[beam]
                distance = hit(
                    kind[row],
                    size[row],
                    start[0],
                    start[1],
                    start[2],
                    turn[0, 0] * c + turn[1, 0] * s,
                    turn[0, 1] * c + turn[1, 1] * s,
                    turn[0, 2] * c + turn[1, 2] * s,
                )
                if distance < distances[beam]:
                    distances[beam] = distance
                    rows[beam] = row
    for beam in range(count):
        if distances[beam] > max_range:
            distances[beam] = np.inf
            rows[beam] = -1
