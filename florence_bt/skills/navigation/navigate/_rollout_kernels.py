"""The hot loops of the local controller: simulate many commands and look what they would touch."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL, Cells, footprint_cost

COLLIDES, UNREACHABLE, MEETS = -1.0, -2.0, -3.0
_PEOPLE_STEP_S = 0.1
"""So often a motion is compared with where people will be."""


@njit(cache=True)
def _towards(value: float, wanted: float, limit: float) -> float:
    return value + max(-limit, min(limit, wanted - value))


@njit(cache=True)
def distance_at(grid: NDArray[np.float64], u: float, v: float, unreached: float) -> float:
    """Interpolate a distance grid at a place between cell centres; cell k has its centre at k + 0.5.

    Returns:
        The interpolated value, the nearest cell's where a neighbour was not reached, ``unreached`` where that
        was not reached either or the place is outside.
    """
    rows, columns = grid.shape
    row, column = math.floor(v), math.floor(u)
    if not (0 <= row < rows and 0 <= column < columns) or grid[row, column] >= unreached:
        return unreached
    left, low = math.floor(u - 0.5), math.floor(v - 0.5)
    if 0 <= low < rows - 1 and 0 <= left < columns - 1:
        a, b = grid[low, left], grid[low, left + 1]
        c, d = grid[low + 1, left], grid[low + 1, left + 1]
        if max(max(a, b), max(c, d)) < unreached:
            fu, fv = u - 0.5 - left, v - 0.5 - low
            return (1 - fv) * ((1 - fu) * a + fu * b) + fv * ((1 - fu) * c + fu * d)
    return grid[row, column]


@njit(cache=True)
def _is_too_near(
    people: NDArray[np.float64], seconds: float, x: float, y: float, start_x: float, start_y: float
) -> bool:
    """Tell whether the robot is too near to somebody then, and nearer than if it had not moved."""
    for k in range(len(people)):
        person_x = people[k, 0] + people[k, 2] * seconds
        person_y = people[k, 1] + people[k, 3] * seconds
        distance = math.hypot(person_x - x, person_y - y)
        if distance < people[k, 4] and distance < math.hypot(person_x - start_x, person_y - start_y):
            return True
    return False


@njit(cache=True)
def meets_somebody(
    people: NDArray[np.float64], pose: NDArray[np.float64], twist: NDArray[np.float64], seconds: float
) -> bool:
    """Tell whether driving on with a velocity leads too near to somebody who walks on.

    Args:
        people: Shape (n, 5): x, y, vx, vy of each person, and how near the robot may come, metres.
        pose: x, y, yaw of the robot.
        twist: Its linear and angular velocity.
        seconds: How far to look ahead.
    """
    x, y, yaw = pose
    steps = max(1, math.ceil(seconds / _PEOPLE_STEP_S))
    dt = seconds / steps
    for step in range(1, steps + 1):
        heading = yaw + 0.5 * twist[1] * dt
        x, y, yaw = (
            x + twist[0] * math.cos(heading) * dt,
            y + twist[0] * math.sin(heading) * dt,
            yaw + twist[1] * dt,
        )
        if _is_too_near(people, step * dt, x, y, pose[0], pose[1]):
            return True
    return False


@njit(cache=True)
def roll_out(
    cells: Cells,
    frame: NDArray[np.float64],
    state: NDArray[np.float64],
    commands: NDArray[np.float64],
    limits: NDArray[np.float64],
    outline: NDArray[np.float64],
    harmless_below: int,
    path_grid: NDArray[np.float64],
    goal_grid: NDArray[np.float64],
    biases: NDArray[np.float64],
    unreached: float,
    people: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Simulate commands and rate where they lead.

    Args:
        cells: Shape (rows, columns), the local costmap.
        frame: origin_x, origin_y, resolution of all grids.
        state: x, y, yaw, linear, angular of the robot in the costmap's frame.
        commands: Shape (n, 2): linear and angular speed wanted.
        limits: acc_lim_x, acc_lim_th, sim_time, sim_granularity (m), angular granularity (rad).
        outline: Shape (k, 2), points along the padded footprint.
        harmless_below: Where the cost under the robot's centre is below this, the outline touches nothing.
        path_grid: Distance from the path at each cell.
        goal_grid: Distance from the local goal at each cell.
        biases: path_distance_bias, goal_distance_bias, occdist_scale.
        unreached: Distances from here on mean "not reached".
        people: Shape (n, 5), as for :func:`meets_somebody`.

    Returns:
        Shape (n,): the cost, smaller is better; :data:`COLLIDES`, :data:`UNREACHABLE` or :data:`MEETS` for
        unusable ones.

    Source:
        REFERENCE 7.6.
    """
    rows, columns = cells.shape
    ratings = np.empty(len(commands))
    for i in range(len(commands)):
        x, y, yaw, linear, angular = state
        wanted_linear, wanted_angular = commands[i, 0], commands[i, 1]
        length = max(abs(wanted_linear), abs(linear)) * limits[2] / limits[3]
        turn = max(abs(wanted_angular), abs(angular)) * limits[2] / limits[4]
        steps = max(1, int(max(length, turn) + 0.5))
        if len(people):
            steps = max(steps, math.ceil(limits[2] / _PEOPLE_STEP_S))
        dt = limits[2] / steps
        rating, worst = 0.0, 0
        for step in range(1, steps + 1):
            linear = _towards(linear, wanted_linear, limits[0] * dt)
            angular = _towards(angular, wanted_angular, limits[1] * dt)
            heading = yaw + 0.5 * angular * dt
            x, y, yaw = (
                x + linear * math.cos(heading) * dt,
                y + linear * math.sin(heading) * dt,
                yaw + angular * dt,
            )
            column, row = math.floor((x - frame[0]) / frame[2]), math.floor((y - frame[1]) / frame[2])
            if not (0 <= row < rows and 0 <= column < columns):
                rating = COLLIDES
                break
            cost = int(cells[row, column])
            if cost >= LETHAL:
                rating = COLLIDES
                break
            if cost >= harmless_below:
                under = footprint_cost(cells, frame[0], frame[1], frame[2], x, y, yaw, outline, True)
                if under < 0:
                    rating = COLLIDES
                    break
                cost = max(cost, under)
            worst = max(worst, cost)
            if _is_too_near(people, step * dt, x, y, state[0], state[1]):
                rating = MEETS
                break
        if rating < 0.0:
            ratings[i] = rating
            continue
        u, v = (x - frame[0]) / frame[2], (y - frame[1]) / frame[2]
        from_path, from_goal = (
            distance_at(path_grid, u, v, unreached),
            distance_at(goal_grid, u, v, unreached),
        )
        if from_path >= unreached or from_goal >= unreached:
            ratings[i] = UNREACHABLE
        else:
            ratings[i] = biases[0] * from_path + biases[1] * from_goal + biases[2] * worst
    return ratings


@njit(cache=True)
def count_touches(
    cells: Cells, frame: NDArray[np.float64], x: float, y: float, yaw: float, outline: NDArray[np.float64]
) -> int:
    """Count the points of the outline that lie in lethal cells (unknown and outside do not count)."""
    rows, columns = cells.shape
    c, s = math.cos(yaw), math.sin(yaw)
    touches = 0
    for k in range(len(outline)):
        u = math.floor((x + c * outline[k, 0] - s * outline[k, 1] - frame[0]) / frame[2])
        v = math.floor((y + s * outline[k, 0] + c * outline[k, 1] - frame[1]) / frame[2])
        if 0 <= v < rows and 0 <= u < columns and cells[v, u] == LETHAL:
            touches += 1
    return touches


@njit(cache=True)
def free_motion(
    cells: Cells,
    frame: NDArray[np.float64],
    pose: NDArray[np.float64],
    way: float,
    turn: float,
    steps: int,
    outline: NDArray[np.float64],
) -> float:
    """Return how much of a straight way, a turn or an arc is free.

    A robot that touches a lethal cell already (cells are coarse, sensors noisy) may move as long as it
    touches no more than at the start.

    Args:
        cells: The costmap.
        frame: origin_x, origin_y, resolution.
        pose: x, y, yaw at the start.
        way: Metres along the heading, below zero backwards.
        turn: Radians, spread evenly over the way.
        steps: How many poses to look at.
        outline: Points along the footprint.

    Returns:
        The free part of the motion, 1.0 when nothing is in the way.
    """
    allowed = count_touches(cells, frame, pose[0], pose[1], pose[2], outline)
    x, y, yaw = pose
    for k in range(steps):
        heading = yaw + 0.5 * turn / steps
        x, y, yaw = (
            x + way / steps * math.cos(heading),
            y + way / steps * math.sin(heading),
            yaw + turn / steps,
        )
        if count_touches(cells, frame, x, y, yaw, outline) > allowed:
            return k / steps
    return 1.0
