"""Polygons in the plane, in pure Python but for :func:`cells_inside`: rooms, and zones of a map.

A polygon is its corners in order, metres; the last edge leads back to the first corner. Inside is what a ray
leaves through an odd number of edges, so that a polygon whose edges cross has an inside, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point = tuple[float, float]
Polygon = tuple[Point, ...]
Edge = tuple[Point, Point]

_LINES = 200
"""So many lines measure how much two polygons have in common: to 1 % of the smaller one's height."""


def edges(polygon: Polygon) -> Iterator[Edge]:
    """Yield the edges, the first from the first corner to the second."""
    return zip(polygon, polygon[1:] + polygon[:1], strict=True)


def contains(polygon: Polygon, x: float, y: float) -> bool:
    """Tell whether a point is inside; False without a polygon."""
    inside = False
    for (ax, ay), (bx, by) in edges(polygon):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside


def area(polygon: Polygon) -> float:
    """Return what the edges enclose, m^2; of edges that cross, parts may cancel out."""
    return abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in edges(polygon))) / 2.0


def crossing_edges(polygon: Polygon) -> tuple[int, int] | None:
    """Return the numbers, from 1 on, of two edges that meet though they are no neighbours, or None."""
    sides = list(edges(polygon))
    for first, one in enumerate(sides):
        for second in range(first + 2, len(sides)):
            if (first, second) != (0, len(sides) - 1) and _meet(one, sides[second]):
                return first + 1, second + 1
    return None


def _meet(one: Edge, other: Edge) -> bool:
    """Tell whether two edges have a point in common."""
    (a, b), (c, d) = one, other
    boxes = all(
        max(min(a[k], b[k]), min(c[k], d[k])) <= min(max(a[k], b[k]), max(c[k], d[k])) for k in (0, 1)
    )
    return boxes and _side(a, b, c) * _side(a, b, d) <= 0.0 and _side(c, d, a) * _side(c, d, b) <= 0.0


def _side(a: Point, b: Point, point: Point) -> float:
    """Return on which side of a line a point is: above zero left of it."""
    turn = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
    return (turn > 0.0) - (turn < 0.0)


def common_area(one: Polygon, other: Polygon) -> float:
    """Return what two polygons have in common, m^2, to about one per cent."""
    low = max(min(y for _, y in polygon) for polygon in (one, other))
    high = min(max(y for _, y in polygon) for polygon in (one, other))
    left = max(min(x for x, _ in polygon) for polygon in (one, other))
    right = min(max(x for x, _ in polygon) for polygon in (one, other))
    if high <= low or right <= left:
        return 0.0
    step = (high - low) / _LINES
    lines = (low + (number + 0.5) * step for number in range(_LINES))
    return step * sum(_common_length(_crossings(one, y), _crossings(other, y)) for y in lines)


def _crossings(polygon: Polygon, y: float) -> list[float]:
    """Return the places along x, in order, where a horizontal line crosses the edges: in, out, in, out."""
    return sorted(
        ax + (y - ay) / (by - ay) * (bx - ax) for (ax, ay), (bx, by) in edges(polygon) if (ay > y) != (by > y)
    )


def _common_length(one: list[float], other: list[float]) -> float:
    return sum(
        max(0.0, min(one[i + 1], other[j + 1]) - max(one[i], other[j]))
        for i in range(0, len(one), 2)
        for j in range(0, len(other), 2)
    )


def cells_inside(
    polygon: Polygon, origin: Point, resolution: float, shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Mark the cells of a grid whose middles are inside.

    Args:
        polygon: Metres.
        origin: The outer corner of cell [0, 0], metres.
        resolution: Metres per cell.
        shape: (rows, columns); row 0 has the smallest y.

    Returns:
        Shape (rows, columns).
    """
    import numpy as np

    rows, columns = shape
    middles = origin[1] + (np.arange(rows) + 0.5) * resolution
    # How many edges are left of a cell: each is counted in the first cell right of it, then summed up.
    begun = np.zeros((rows, columns + 1), np.int64)
    for (ax, ay), (bx, by) in edges(polygon):
        cut = np.flatnonzero((middles < ay) != (middles < by))
        if len(cut):
            at = ax + (middles[cut] - ay) / (by - ay) * (bx - ax)
            first = np.clip(np.ceil((at - origin[0]) / resolution - 0.5), 0, columns).astype(np.int64)
            begun[cut, first] += 1
    inside: NDArray[np.bool_] = np.cumsum(begun[:, :columns], axis=1) % 2 == 1
    return inside


def distance_to(polygon: Polygon, x: float, y: float) -> float:
    """Return how far a point is from the nearest edge, metres."""
    return min(_distance_to_edge(edge, x, y) for edge in edges(polygon))


def _distance_to_edge(edge: Edge, x: float, y: float) -> float:
    (ax, ay), (bx, by) = edge
    squared = (bx - ax) ** 2 + (by - ay) ** 2
    along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / squared if squared else 0.0
    share = max(0.0, min(1.0, along))
    return math.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y)
