"""The hot loop of the projected merge. Arrays in, arrays out."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def project_beams(
    ranges: NDArray[np.float64],
    angles: NDArray[np.float64],
    half_width: float,
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    angle_min: float,
    angle_increment: float,
    nearest: NDArray[np.float64],
) -> None:
    """See the hits of one scanner from the place of another.

    Every hit is taken as a short arc as wide as its beam, so that no gaps open in the finer target grid: all
    target beams between the two ends of the arc get the distance of its middle.

    Args:
        ranges: Shape (n,), metres, valid hits only.
        angles: Shape (n,), direction of each hit in the source frame, radians.
        half_width: Half the angle between two source beams, radians.
        rotation: Shape (3, 3), source to target.
        translation: Shape (3,), origin of the source in the target frame, metres.
        angle_min: First angle of the target grid.
        angle_increment: Step of the target grid, not zero.
        nearest: Shape (m,), lowered to the nearest distance seen from the target, metres.
    """
    count = nearest.size
    for i in range(ranges.size):
        x, y = _to_target(ranges[i], angles[i], rotation, translation)
        distance, middle = math.hypot(x, y), math.atan2(y, x)
        low = high = _index(middle, angle_min, angle_increment)
        for side in (-half_width, half_width):
            end_x, end_y = _to_target(ranges[i], angles[i] + side, rotation, translation)
            # Relative to the middle, so that an arc across +-pi stays short.
            turn = (math.atan2(end_y, end_x) - middle + math.pi) % (2.0 * math.pi) - math.pi
            edge = _index(middle + turn, angle_min, angle_increment)
            low, high = min(low, edge), max(high, edge)
        for k in range(max(low, 0), min(high, count - 1) + 1):
            nearest[k] = min(nearest[k], distance)


@njit(cache=True)
def _to_target(
    distance: float, angle: float, rotation: NDArray[np.float64], translation: NDArray[np.float64]
) -> tuple[float, float]:
    """Return the point (x, y) in the target's plane, given by range and angle in the source frame."""
    px, py = distance * math.cos(angle), distance * math.sin(angle)
    return (
        rotation[0, 0] * px + rotation[0, 1] * py + translation[0],
        rotation[1, 0] * px + rotation[1, 1] * py + translation[1],
    )


@njit(cache=True)
def _index(angle: float, angle_min: float, angle_increment: float) -> int:
    """Return the beam nearest to an angle, by floor(x + 0.5); clamped to numbers far outside any grid."""
    place = (angle - angle_min) / angle_increment + 0.5
    return math.floor(min(max(place, -1.0), 1e9))
