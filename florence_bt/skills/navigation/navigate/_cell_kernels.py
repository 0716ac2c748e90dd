"""The hot loops over costmap cells: rays, marks, inflation, footprints. Plain arrays, no state."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from florence_bt.skills.navigation.navigate._ray_kernels import move_points, to_cells

Cells = NDArray[np.uint8]
LETHAL, INSCRIBED, UNKNOWN_COST = 254, 253, 255
"""Costs as in costmap_2d: REFERENCE 7.4."""
CLEARABLE = 250
"""In the marks of a camera: what is above something that the laser sees, and is cleared with it. One less for
each laser scan in a row that has seen nothing there."""
_LEFT_AFTER = 5
"""Looks without it after which a mark is gone. Chosen."""


@njit(cache=True)
def take_rays(
    marks: Cells,
    frame: tuple[float, float, float],
    sensor: tuple[float, float],
    ends: NDArray[np.float64],
    ranges: NDArray[np.float64],
    cleared: tuple[float, float],
    marked_below: float,
    feet: NDArray[np.float64],
    feet_near: float,
) -> None:
    """Clear along the rays of a sensor, then mark their ends, in place.

    Args:
        marks: Shape (rows, columns), of this sensor.
        frame: x and y of the outer corner of cell [0, 0], and the side of a cell, metres.
        sensor: Its x and y, metres.
        ends: Shape (n, 2), metres.
        ranges: Shape (n,), lengths of the rays, metres.
        cleared: From where to where a ray clears, metres; nothing when that is empty.
        marked_below: A ray that is shorter than this marks, metres.
        feet: Shape (m, 2), metres: ends near them are marked as above feet (:func:`mark_above`).
        feet_near: Feet are so near to what is above them, metres; 0 marks everything as lethal.
    """
    origin_x, origin_y, resolution = frame
    cells = to_cells(ends, frame)
    if cleared[0] < cleared[1]:
        clear_rays(
            marks,
            (sensor[0] - origin_x) / resolution,
            (sensor[1] - origin_y) / resolution,
            cells,
            ranges < cleared[1],
            cleared[0] / resolution,
            cleared[1] / resolution,
        )
    wanted = ranges < marked_below
    if feet_near > 0.0:
        mark_above(marks, cells, wanted, to_cells(feet, frame), feet_near / resolution)
    else:
        mark_points(marks, cells, wanted)


@njit(cache=True)
def clear_rays(
    marks: Cells,
    origin_u: float,
    origin_v: float,
    ends: NDArray[np.float64],
    hits: NDArray[np.bool_],
    start: float,
    longest: float,
) -> None:
    """Set the cells along each ray to free, in place.

    Args:
        marks: Shape (rows, columns).
        origin_u: The sensor's column, in cells with fractions.
        origin_v: The sensor's row.
        ends: Shape (n, 2): column and row of each ray's end, in cells with fractions.
        hits: Shape (n,): whether the ray ended at a surface; that cell itself is not cleared.
        start: Cells nearer than this to the sensor are not cleared (it cannot see them).
        longest: Rays are cut there, in cells.
    """
    rows, columns = marks.shape
    for k in range(len(ends)):
        du, dv = ends[k, 0] - origin_u, ends[k, 1] - origin_v
        length = math.hypot(du, dv)
        if length < 1e-9:
            continue
        reach = min(length, longest)
        end_u, end_v = math.floor(ends[k, 0]), math.floor(ends[k, 1])
        # Walk from cell border to cell border (Amanatides and Woo), so that no touched cell is left out.
        u, v = math.floor(origin_u), math.floor(origin_v)
        step_u, step_v = 1 if du > 0 else -1, 1 if dv > 0 else -1
        cross_u = length / abs(du) if du != 0 else math.inf
        cross_v = length / abs(dv) if dv != 0 else math.inf
        next_u = abs((u + (step_u > 0)) - origin_u) * cross_u if du != 0 else math.inf
        next_v = abs((v + (step_v > 0)) - origin_v) * cross_v if dv != 0 else math.inf
        travelled = 0.0
        while travelled <= reach:
            if hits[k] and u == end_u and v == end_v:
                break
            # A cell counts as seen from half of the way through it.
            leave = min(next_u, next_v)
            if 0 <= v < rows and 0 <= u < columns and 0.5 * (travelled + min(leave, length)) >= start:
                marks[v, u] = 0
            travelled = leave
            if next_u < next_v:
                u += step_u
                next_u += cross_u
            else:
                v += step_v
                next_v += cross_v


@njit(cache=True)
def costs_at(
    costs: Cells, origin_x: float, origin_y: float, resolution: float, points: NDArray[np.float64]
) -> Cells:
    """Return the costs at points, shape (n, 2), metres; unknown outside. Shape (n,)."""
    rows, columns = costs.shape
    found = np.full(len(points), UNKNOWN_COST, np.uint8)
    for k in range(len(points)):
        # Compared before they become whole numbers: a NaN is outside.
        u, v = (
            np.floor((points[k, 0] - origin_x) / resolution),
            np.floor((points[k, 1] - origin_y) / resolution),
        )
        if 0.0 <= v < rows and 0.0 <= u < columns:
            found[k] = costs[int(v), int(u)]
    return found


@njit(cache=True)
def mark_points(marks: Cells, ends: NDArray[np.float64], wanted: NDArray[np.bool_]) -> None:
    """Mark the cells of the wanted points as lethal, in place."""
    rows, columns = marks.shape
    for k in range(len(ends)):
        if wanted[k]:
            u, v = math.floor(ends[k, 0]), math.floor(ends[k, 1])
            if 0 <= v < rows and 0 <= u < columns:
                marks[v, u] = LETHAL


@njit(cache=True)
def mark_above(
    marks: Cells, ends: NDArray[np.float64], wanted: NDArray[np.bool_], feet: NDArray[np.float64], near: float
) -> None:
    """Mark the cells of wanted points, in place: :data:`CLEARABLE` where the laser sees feet, else lethal.

    What was marked before without feet stays lethal: somebody stands beside a table.

    Args:
        marks: Shape (rows, columns).
        ends: Shape (n, 2): column and row of the points, in cells with fractions.
        wanted: Shape (n,).
        feet: Shape (m, 2): where beams of the laser end at what the map does not know, as ``ends``.
        near: Feet are so near to what is above them, in cells.
    """
    rows, columns = marks.shape
    for k in range(len(ends)):
        u, v = math.floor(ends[k, 0]), math.floor(ends[k, 1])
        if not (wanted[k] and 0 <= v < rows and 0 <= u < columns) or marks[v, u] == LETHAL:
            continue
        marks[v, u] = LETHAL
        for i in range(len(feet)):
            if _is_near(feet[i, 0] - ends[k, 0], feet[i, 1] - ends[k, 1], near):
                marks[v, u] = CLEARABLE
                break


@njit(cache=True)
def _is_near(du: float, dv: float, near: float) -> bool:
    return du * du + dv * dv < near * near  # many times as fast as hypot


@njit(cache=True)
def forget_what_left(
    marks: Cells,
    origin_u: float,
    origin_v: float,
    ends: NDArray[np.float64],
    are_feet: NDArray[np.bool_],
    near: float,
    reach: float,
) -> None:
    """Free the cells above feet that have gone: the laser looks through there in several scans, in place.

    Args:
        marks: Shape (rows, columns).
        origin_u: The laser's column, in cells with fractions.
        origin_v: The laser's row.
        ends: Shape (m, 2): where its beams end now.
        are_feet: Shape (m,): which ends are at what the map does not know.
        near: As for :func:`mark_above`.
        reach: Cells farther from the laser are left as they are.
    """
    rows, columns = marks.shape
    for v in range(max(0, math.floor(origin_v - reach)), min(rows, math.ceil(origin_v + reach))):
        for u in range(max(0, math.floor(origin_u - reach)), min(columns, math.ceil(origin_u + reach))):
            if not 0 < marks[v, u] <= CLEARABLE:
                continue
            seen = _what_laser_sees(u + 0.5, v + 0.5, origin_u, origin_v, ends, are_feet, near)
            if seen > 0:
                marks[v, u] = CLEARABLE
            elif seen < 0:
                marks[v, u] = marks[v, u] - 1 if marks[v, u] > CLEARABLE - _LEFT_AFTER + 1 else 0


@njit(cache=True)
def _what_laser_sees(
    u: float,
    v: float,
    origin_u: float,
    origin_v: float,
    ends: NDArray[np.float64],
    are_feet: NDArray[np.bool_],
    near: float,
) -> int:
    """Tell what the laser sees: 1 feet near a place, -1 that nothing is there, 0 not the place."""
    du, dv = u - origin_u, v - origin_v
    through, hidden = False, False
    for i in range(len(ends)):
        if are_feet[i] and _is_near(ends[i, 0] - u, ends[i, 1] - v, near):
            return 1
        eu, ev = ends[i, 0] - origin_u, ends[i, 1] - origin_v
        squared, along, across = eu * eu + ev * ev, du * eu + dv * ev, du * ev - dv * eu
        if along > 0.0 and across * across <= squared:
            through |= squared > along
            hidden |= squared <= along
    return -1 if through and not hidden else 0


@njit(cache=True)
def clear_outline(
    marks: Cells,
    frame: tuple[float, float, float],
    outline: NDArray[np.float64],
    x: float,
    y: float,
    yaw: float,
) -> None:
    """Set every cell whose centre lies under the robot to free, in place.

    Args:
        marks: Shape (rows, columns).
        frame: x and y of the outer corner of cell [0, 0], and the side of a cell, metres.
        outline: Shape (n, 2), corners of the robot in its own frame, metres.
        x: The robot, metres.
        y: The robot, metres.
        yaw: Its heading, radians.
    """
    clear_polygon(marks, to_cells(move_points(outline, x, y, yaw), frame))


@njit(cache=True)
def clear_polygon(marks: Cells, corners: NDArray[np.float64]) -> None:
    """Set every cell whose centre lies in a convex polygon to free, in place.

    Args:
        marks: Shape (rows, columns).
        corners: Shape (n, 2): columns and rows, in cells with fractions.
    """
    rows, columns = marks.shape
    for v in range(
        max(0, math.floor(corners[:, 1].min())), min(rows - 1, math.floor(corners[:, 1].max())) + 1
    ):
        for u in range(
            max(0, math.floor(corners[:, 0].min())), min(columns - 1, math.floor(corners[:, 0].max())) + 1
        ):
            left, right = False, False
            for i in range(len(corners)):
                x0, y0 = corners[i - 1]
                x1, y1 = corners[i]
                side = (x1 - x0) * (v + 0.5 - y0) - (y1 - y0) * (u + 0.5 - x0)
                left |= side > 0.0
                right |= side < 0.0
            if not (left and right):
                marks[v, u] = 0


@njit(cache=True)
def add_marks(master: Cells, marks: Cells) -> None:
    """Make every cell lethal that a sensor has marked, in place; both of shape (rows, columns)."""
    rows, columns = master.shape
    for v in range(rows):
        for u in range(columns):
            master[v, u] = LETHAL if marks[v, u] > 0 else master[v, u]


@njit(cache=True)
def inflate(master: Cells, radius: int, table: Cells) -> None:
    """Spread costs around every lethal cell, in place.

    Args:
        master: Shape (rows, columns). Unknown cells stay so unless an obstacle is too near to stand there.
        radius: How far in cells.
        table: Shape (2 radius^2 + 1,): the cost at each squared distance in cells.

    Source:
        REFERENCE 7.4; exact distances in two passes (columns, then rows).
    """
    rows, columns = master.shape
    far = radius + 1
    vertical = np.empty((rows, columns), np.int16)
    # Row by row, as they lie in memory.
    for v in range(rows):
        for u in range(columns):
            above = vertical[v - 1, u] + 1 if v > 0 else far
            vertical[v, u] = 0 if master[v, u] == LETHAL else min(above, far)
    for v in range(rows - 2, -1, -1):
        for u in range(columns):
            vertical[v, u] = min(vertical[v, u], vertical[v + 1, u] + 1)
    unreached = radius * radius + 1
    nearest = np.empty(columns, np.int32)
    for v in range(rows):
        nearest[:] = unreached
        reached = False
        for u in range(columns):
            if vertical[v, u] > radius:
                continue
            reached = True
            high = int(vertical[v, u]) * int(vertical[v, u])
            nearest[u] = min(nearest[u], high)
            for side in (1, -1):
                w, squared = u + side, high + 1
                while squared < unreached and 0 <= w < columns:
                    # From a cell that is as near to an obstacle of its own, that one is nearer all the way.
                    if vertical[v, w] <= radius and int(vertical[v, w]) * int(vertical[v, w]) <= squared:
                        break
                    nearest[w] = min(nearest[w], squared)
                    squared += 2 * abs(w - u) + 1
                    w += side
        if not reached:
            continue
        for u in range(columns):
            if nearest[u] < unreached:
                cost, old = table[nearest[u]], master[v, u]
                if old == UNKNOWN_COST:
                    if cost >= INSCRIBED:
                        master[v, u] = cost
                elif cost > old:
                    master[v, u] = cost


@njit(cache=True)
def footprint_cost(
    cells: Cells,
    origin_x: float,
    origin_y: float,
    resolution: float,
    x: float,
    y: float,
    yaw: float,
    outline: NDArray[np.float64],
    unknown_blocks: bool,
) -> int:
    """Return the greatest cost under the outline of the robot at a pose.

    Returns:
        0..253, or -1 when the outline touches a lethal cell or leaves the map.
    """
    rows, columns = cells.shape
    c, s = math.cos(yaw), math.sin(yaw)
    greatest = 0
    for k in range(len(outline)):
        u = math.floor((x + c * outline[k, 0] - s * outline[k, 1] - origin_x) / resolution)
        v = math.floor((y + s * outline[k, 0] + c * outline[k, 1] - origin_y) / resolution)
        if not (0 <= v < rows and 0 <= u < columns):
            return -1
        cost = int(cells[v, u])
        if cost == UNKNOWN_COST:
            if unknown_blocks:
                return -1
        elif cost == LETHAL:
            return -1
        elif cost > greatest:
            greatest = cost
    return greatest
