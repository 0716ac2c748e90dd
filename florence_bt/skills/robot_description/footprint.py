"""The outline of the robot on the floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from florence_bt.core.errors import ConfigError

Polygon = tuple[tuple[float, float], ...]

FOOTPRINT: Polygon = ((-0.16, -0.16), (-0.16, 0.16), (0.19, 0.16), (0.24, 0.0), (0.19, -0.16))
"""Corners in base_footprint, metres (document, section 3.3.2)."""


def polygon_from_numbers(numbers: Sequence[float]) -> Polygon:
    """Corners from a flat list x0, y0, x1, y1, ... as parameters hold it.

    Args:
        numbers: At least three pairs of metres.

    Raises:
        ConfigError: Not pairs, fewer than three corners, a number that is not finite, or no area.
    """
    good = ("-0.16, -0.16, -0.16, 0.16, 0.19, 0.16, 0.24, 0.0, 0.19, -0.16",)
    if len(numbers) % 2 or len(numbers) < 6:
        raise ConfigError(
            f"a footprint needs x and y of at least three corners, not {len(numbers)} numbers", valid=good
        )
    if not all(math.isfinite(number) for number in numbers):
        raise ConfigError("a footprint needs finite numbers", valid=good)
    corners = tuple(zip(numbers[::2], numbers[1::2], strict=True))
    if abs(_signed_area(corners)) < 1e-6:
        raise ConfigError("the corners of the footprint lie on one line", valid=good)
    return corners


def numbers_from_polygon(polygon: Polygon) -> tuple[float, ...]:
    """The flat list of :func:`polygon_from_numbers`."""
    return tuple(number for corner in polygon for number in corner)


def inscribed_radius(polygon: Polygon) -> float:
    """Distance in metres from the origin to the nearest edge."""
    return min(_distance_to_edge(a, b) for a, b in pairwise((*polygon, polygon[0])))


def circumscribed_radius(polygon: Polygon) -> float:
    """Distance in metres from the origin to the furthest corner."""
    return max(math.hypot(x, y) for x, y in polygon)


def _signed_area(polygon: Polygon) -> float:
    return sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairwise((*polygon, polygon[0]))) / 2.0


def _distance_to_edge(a: tuple[float, float], b: tuple[float, float]) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    length_squared = dx * dx + dy * dy
    along = 0.0 if length_squared == 0.0 else max(0.0, min(1.0, -(a[0] * dx + a[1] * dy) / length_squared))
    return math.hypot(a[0] + along * dx, a[1] + along * dy)
