"""The global planner: the cheapest path over a costmap, by a wave from the robot (navfn)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative
from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate._wave_kernels import (
    NEUTRAL,
    OBSTACLE,
    UNVISITED,
    descend,
    spread_wave,
)
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.robot_description.room import START_CLEARANCE_M


@dataclass(frozen=True, slots=True)
class PlannerParameters(CheckedParameters):
    """The parameters of the planner.

    Attributes:
        allow_unknown: Whether the way may lead over unknown cells, at the highest cost.
        neutral_cost: Cost of a free cell.
        cost_factor: How much a costmap value adds.
        start_clearance: Around the robot, cells too near to an obstacle may be crossed up to this
            distance in metres, so that it can leave a place where it should not stand.
        use_astar: Whether the search is directed to a goal that is free; the way is the same.

    Source:
        REFERENCE 7.5.
    """

    allow_unknown: bool = True
    neutral_cost: Annotated[int, Limits(1, OBSTACLE - 2)] = NEUTRAL
    cost_factor: NotNegative = 3.0
    start_clearance: NotNegative = START_CLEARANCE_M
    use_astar: bool = True


@dataclass(frozen=True, slots=True)
class Plan:
    """A path.

    Attributes:
        points: Shape (n, 2), x and y in the costmap's frame, from the robot to the goal, n >= 1.
        length: Metres.
        goal: The last pose; differs from the wanted one when that was blocked and a tolerance given.
    """

    points: NDArray[np.float64]
    length: float
    goal: Pose2

    def poses(self) -> list[Pose2]:
        """Return the points with the headings along the path; the last one has the goal's."""
        steps = np.diff(self.points, axis=0)
        yaws = np.arctan2(steps[:, 1], steps[:, 0])
        inner = zip(self.points[:-1], yaws, strict=True)
        return [Pose2(float(x), float(y), float(yaw)) for (x, y), yaw in inner] + [self.goal]


def plan_path(
    costmap: Costmap,
    start: Pose2,
    goal: Pose2,
    parameters: PlannerParameters,
    *,
    tolerance: float = 0.0,
    costs: Cells | None = None,
) -> Plan | Result:
    """Find the cheapest path.

    Args:
        costmap: The costmap, in the frame of both poses.
        start: The robot.
        goal: Where it should go.
        parameters: How.
        tolerance: When the goal is blocked, the nearest place within this many metres will do.
        costs: Costs to use in place of the costmap's own (the static layer alone), same shape.

    Returns:
        The plan, or a failure: ``goal_outside``, ``start_outside``, ``goal_occupied``, ``no_path``.

    Source:
        REFERENCE 7.5; the codes of 7.9.
    """
    if not goal.is_finite():
        return failure("bad_input", f"the goal {goal} is not finite")
    start_cell, goal_cell = costmap.cell_of(start.x, start.y), costmap.cell_of(goal.x, goal.y)
    if goal_cell is None:
        return failure("goal_outside", f"the goal ({goal.x:.2f}, {goal.y:.2f}) lies outside of the map")
    if start_cell is None:
        return failure("start_outside", f"the robot at ({start.x:.2f}, {start.y:.2f}) is outside of the map")
    cells = costmap.master if costs is None else costs
    crossing = _crossing_costs(cells, parameters)
    columns = crossing.shape[1]
    start_index = (start_cell[0] + 1) * columns + start_cell[1] + 1
    wanted = (goal_cell[0] + 1) * columns + goal_cell[1] + 1
    crossing.flat[start_index] = NEUTRAL
    blocked = bool(crossing.flat[wanted] >= OBSTACLE)
    target = -1 if blocked else wanted
    cheapest = float(min(NEUTRAL, parameters.neutral_cost)) if parameters.use_astar else 0.0
    if blocked and tolerance <= 0.0:
        return _occupied(goal)
    # With room around it the robot keeps away from walls; out of a corner the way is opened when there is no
    # other.
    stands_well = not INSCRIBED <= cells[start_cell] < UNKNOWN_COST
    for opened in (False, True) if stands_well else (True,):
        if opened:
            _open_start(crossing, start_cell, parameters.start_clearance / costmap.resolution)
        potential = spread_wave(
            crossing.ravel(), columns, np.array([start_index]), target, 2.0 * NEUTRAL, cheapest
        )
        grid = potential.reshape(crossing.shape)
        end_cell = _reachable_cell(grid, goal_cell, tolerance / costmap.resolution)
        if end_cell is not None:
            break
    if end_cell is None:
        if blocked:
            return _occupied(goal)
        return failure("no_path", f"no way leads to ({goal.x:.2f}, {goal.y:.2f})")
    points = _path_points(potential, columns, end_cell, costmap)
    if points is None:
        return failure("no_path", f"the way to ({goal.x:.2f}, {goal.y:.2f}) could not be traced back")
    return _finish(points, start, goal, None if end_cell == goal_cell else end_cell, costmap)


def ways_from(cell: tuple[int, int], floor: NDArray[np.bool_], resolution: float) -> NDArray[np.float64]:
    """Return the metres from a cell to each other one over the floor; infinite where no way leads.

    Args:
        cell: Row and column.
        floor: Which cells can be walked or driven over, shape (rows, columns).
        resolution: Metres per cell.
    """
    costs = np.pad(np.where(floor, NEUTRAL, OBSTACLE).astype(np.uint8), 1, constant_values=OBSTACLE)
    columns = costs.shape[1]
    start = np.array([(cell[0] + 1) * columns + cell[1] + 1])
    potential = spread_wave(costs.ravel(), columns, start, -1, 2.0 * NEUTRAL).reshape(costs.shape)[1:-1, 1:-1]
    ways: NDArray[np.float64] = potential.astype(np.float64) * (resolution / NEUTRAL)
    ways[potential >= UNVISITED] = math.inf
    return ways


def _occupied(goal: Pose2) -> Result:
    return failure(
        "goal_occupied", f"the robot does not fit at ({goal.x:.2f}, {goal.y:.2f}): an obstacle is too near"
    )


def _crossing_costs(cells: Cells, parameters: PlannerParameters) -> NDArray[np.uint8]:
    """Return the costs of crossing each cell, with a border of obstacles, shape (rows + 2, columns + 2)."""
    values = np.arange(256)
    table = np.minimum(parameters.neutral_cost + parameters.cost_factor * values, INSCRIBED).astype(np.uint8)
    table[INSCRIBED:] = OBSTACLE
    # Lethal cells are kept apart from those that are only too near to one: see _open_start.
    table[LETHAL] = OBSTACLE + 1
    table[UNKNOWN_COST] = INSCRIBED if parameters.allow_unknown else OBSTACLE
    crossing = np.full((cells.shape[0] + 2, cells.shape[1] + 2), OBSTACLE, np.uint8)
    crossing[1:-1, 1:-1] = table[cells]
    return crossing


def _open_start(crossing: NDArray[np.uint8], start: tuple[int, int], clearance: float) -> None:
    """Let the way lead through cells near the robot that are only too near to an obstacle."""
    row, column = start[0] + 1, start[1] + 1
    reach = math.ceil(clearance)
    first_row, first_column = max(1, row - reach), max(1, column - reach)
    window = crossing[first_row : min(crossing.shape[0] - 1, row + reach + 1), :]
    window = window[:, first_column : min(crossing.shape[1] - 1, column + reach + 1)]
    v, u = np.ogrid[: window.shape[0], : window.shape[1]]
    near = np.hypot(v + first_row - row, u + first_column - column) <= clearance
    window[near & (window == OBSTACLE)] = INSCRIBED


def _reachable_cell(
    potential: NDArray[np.float32], goal: tuple[int, int], tolerance: float
) -> tuple[int, int] | None:
    """Return the cell nearest to the goal that the wave has reached, None when there is none near enough."""
    row, column = goal
    if potential[row + 1, column + 1] < UNVISITED:
        return goal
    rows, columns = np.nonzero(potential[1:-1, 1:-1] < UNVISITED)
    squared = (rows - row) ** 2 + (columns - column) ** 2
    near = squared <= tolerance**2
    if not near.any():
        return None
    best = int(np.lexsort((potential[rows[near] + 1, columns[near] + 1], squared[near]))[0])
    return int(rows[near][best]), int(columns[near][best])


def _path_points(
    potential: NDArray[np.float32], columns: int, end: tuple[int, int], costmap: Costmap
) -> NDArray[np.float64] | None:
    """Return the way from the robot to a cell in metres, shape (n, 2)."""
    index = (end[0] + 1) * columns + end[1] + 1
    cells, arrived = descend(potential, columns, index, 4 * (columns + len(potential) // columns), 0.5)
    if not arrived:
        return None
    # Border and centre: padded cell k has its centre at (k - 1 + 0.5) cells.
    return (cells[::-1] - 0.5) * costmap.resolution + np.array([costmap.origin_x, costmap.origin_y])


def _finish(
    points: NDArray[np.float64], start: Pose2, goal: Pose2, end_cell: tuple[int, int] | None, costmap: Costmap
) -> Plan:
    """Join the path to the exact start and end."""
    end = goal
    if end_cell is not None:
        end = Pose2(
            costmap.origin_x + (end_cell[1] + 0.5) * costmap.resolution,
            costmap.origin_y + (end_cell[0] + 0.5) * costmap.resolution,
            goal.yaw,
        )
    inner = points[1:-1]
    joined = np.vstack([[[start.x, start.y]], inner, [[end.x, end.y]]])
    length = float(np.hypot(*np.diff(joined, axis=0).T).sum())
    return Plan(joined, length, end)
