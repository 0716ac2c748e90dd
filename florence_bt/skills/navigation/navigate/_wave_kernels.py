"""The hot loops of the planner: a wave of potentials over cell costs, and the way back down.

Arrays have a border of obstacles, so that no loop asks whether a neighbour exists. Cells are numbered row by
row.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OBSTACLE = 254
"""Cost from which on a cell is closed: COST_OBS of Nav2's NavFn."""
NEUTRAL = 50
"""Cost of a free cell: COST_NEUTRAL of Nav2's NavFn."""
UNVISITED = 1e10
"""POT_HIGH of Nav2's NavFn."""
_SHORTEST = 0.99
"""The steps of a wave make ways up to half a percent shorter than they are."""


@njit(cache=True)
def _update(
    potential: NDArray[np.float32], cell: np.uint64, columns: np.uint64, cost: np.float32
) -> np.float32:
    """Compute the potential of a cell from its neighbours' by an eikonal step, so that ways are not bound to
    eight directions. In single precision, which is a third faster, and unsigned, so that no index is checked
    for being negative.
    """
    low = min(potential[cell - np.uint64(1)], potential[cell + np.uint64(1)])
    other = min(potential[cell - columns], potential[cell + columns])
    if other < low:
        low, other = other, low
    difference = other - low
    if difference >= cost:
        return low + cost
    part = difference / cost
    return low + cost * (np.float32(-0.2301) * part * part + np.float32(0.5307) * part + np.float32(0.7040))


@njit(cache=True)
def _heuristic(cell: np.int64, target: int, columns: int, cheapest: float) -> float:
    """Return the least cost of the way from a cell to the target: A* by the straight line."""
    if cheapest == 0.0:
        return 0.0
    # Multiplied, not divided: this is done for each cell.
    row = int((cell + 0.5) * (1.0 / columns))
    target_row = target // columns
    du, dv = cell - row * columns - (target - target_row * columns), row - target_row
    return cheapest * math.sqrt(du * du + dv * dv)


@njit(cache=True)
def spread_wave(
    costs: NDArray[np.uint8],
    columns: int,
    starts: NDArray[np.int64],
    target: int,
    step: float,
    cheapest: float = 0.0,
) -> NDArray[np.float32]:
    """Spread a wave; return the potential of each cell: the cost of the cheapest way from the starts.

    The wave is a front that moves slower where cells cost more. Towards a target it may be directed (A*):
    cells come the later the more the way over them costs at least.

    Args:
        costs: Shape (rows * columns,): cost of crossing a cell, :data:`OBSTACLE` and more for walls; the
            border cells must be walls.
        columns: Cells per row.
        starts: Cells where the wave begins, with potential zero.
        target: The wave may stop behind this cell; -1 lets it run to the end.
        step: Potentials are served in slices of this height.
        cheapest: No cell costs less; directs the wave. 0 lets it run to all sides alike.

    Returns:
        Shape (rows * columns,), :data:`UNVISITED` where no way leads, and where a wave that stopped has not
        come.

    Source:
        REFERENCE 7.5 (navfn); Hart, Nilsson and Raphael, 1968.
    """
    size = len(costs)
    potential = np.full(size, UNVISITED, np.float32)
    waiting = np.zeros(size, np.bool_)
    current = np.empty(size, np.int32)
    following = np.empty(size, np.int32)
    later = np.empty(size, np.int32)
    around = np.array([-1, 1, -columns, columns]).astype(np.uint64)  # steps back overflow to where they lead
    n_current, n_following, n_later = 0, 0, 0
    cheapest *= _SHORTEST if target >= 0 else 0.0
    threshold = math.inf
    for start in starts:
        potential[start] = 0.0
        threshold = min(threshold, step + _heuristic(start, target, columns, cheapest))
    for start in starts:
        for offset in around:
            cell = start + offset
            if not waiting[cell] and costs[cell] < OBSTACLE and potential[cell] > 0.0:
                waiting[cell] = True
                current[n_current] = cell
                n_current += 1
    while True:
        if n_current == 0:
            if n_later == 0 or (target >= 0 and potential[target] < threshold):
                break
            threshold += step
            current, later = later, current
            n_current, n_later = n_later, 0
        for k in range(n_current):
            waiting[current[k]] = False
        for k in range(n_current):
            cell = np.uint64(current[k])
            value = _update(potential, cell, np.uint64(columns), np.float32(costs[cell]))
            if value >= potential[cell]:
                continue
            ahead = value + _heuristic(np.int64(cell), target, columns, cheapest)
            if cheapest > 0.0 and ahead >= threshold + step:
                if not waiting[cell]:
                    waiting[cell] = True
                    later[n_later] = cell
                    n_later += 1
                continue
            potential[cell] = value
            for offset in around:
                near = cell + offset
                cost = costs[near]
                if (
                    cost < OBSTACLE
                    and not waiting[near]
                    and potential[near] > value + np.float32(0.7071) * np.float32(cost)
                ):
                    waiting[near] = True
                    if ahead < threshold:
                        following[n_following] = near
                        n_following += 1
                    else:
                        later[n_later] = near
                        n_later += 1
        current, following = following, current
        n_current, n_following = n_following, 0
    return potential


@njit(cache=True)
def descend(
    potential: NDArray[np.float32], columns: int, start: int, steps: int, stride: float
) -> tuple[NDArray[np.float64], bool]:
    """Walk from a cell down the potential.

    Between cells the gradient is interpolated; where it is not usable (beside walls, at cliffs), the walk
    goes to the lowest of the eight neighbours.

    Args:
        potential: From :func:`spread_wave`.
        columns: Cells per row.
        start: Where to begin; must have been reached by the wave.
        steps: Most steps to take.
        stride: Length of a step in cells.

    Returns:
        Shape (n, 2), columns and rows of cell centres with fractions (cell k has the centre k), and whether
        a cell with potential zero was reached.

    Source:
        REFERENCE 7.5, path.
    """
    path = np.empty((steps + 1, 2))
    x, y = float(start % columns), float(start // columns)
    path[0, 0], path[0, 1] = x, y
    lowest = UNVISITED
    stuck = 0
    for k in range(1, steps + 1):
        cell = round(y) * columns + round(x)
        if potential[cell] <= 0.0:
            return path[:k], True
        if potential[cell] < lowest:
            lowest, stuck = potential[cell], 0
        else:
            stuck += 1
        gx, gy, usable = _gradient(potential, columns, x, y)
        if usable and stuck < 6:
            length = math.hypot(gx, gy)
            x, y = x - stride * gx / length, y - stride * gy / length
            reached = potential[round(y) * columns + round(x)]
            usable = reached < UNVISITED and reached <= potential[cell] + 1.5 * NEUTRAL
        if not usable or stuck >= 6:
            best = cell
            for dv in (-1, 0, 1):
                for du in (-1, 0, 1):
                    near = cell + dv * columns + du
                    # A diagonal step must not squeeze between two walls.
                    open_way = potential[cell + du] < UNVISITED and potential[cell + dv * columns] < UNVISITED
                    if open_way and potential[near] < potential[best]:
                        best = near
            if best == cell:
                return path[:k], False
            x, y = float(best % columns), float(best // columns)
            lowest, stuck = potential[best], 0
        path[k, 0], path[k, 1] = x, y
    return path, False


@njit(cache=True)
def _gradient(potential: NDArray[np.float32], columns: int, x: float, y: float) -> tuple[float, float, bool]:
    u, v = math.floor(x), math.floor(y)
    fu, fv = x - u, y - v
    gx, gy = 0.0, 0.0
    for dv in (0, 1):
        for du in (0, 1):
            share = (fu if du else 1.0 - fu) * (fv if dv else 1.0 - fv)
            if share == 0.0:
                continue
            cell = (v + dv) * columns + u + du
            here = potential[cell]
            left, right = potential[cell - 1], potential[cell + 1]
            down, up = potential[cell - columns], potential[cell + columns]
            if here >= UNVISITED:
                return 0.0, 0.0, False
            gx += share * _slope(left, here, right)
            gy += share * _slope(down, here, up)
    return gx, gy, math.hypot(gx, gy) > 1e-6


@njit(cache=True)
def _slope(before: float, here: float, after: float) -> float:
    """Return the slope along one axis; where one side is a wall, the other side alone."""
    if before >= UNVISITED:
        return 0.0 if after >= UNVISITED else min(0.0, after - here)
    if after >= UNVISITED:
        return max(0.0, here - before)
    return 0.5 * (after - before)
