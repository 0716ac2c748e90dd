"""Says whether the robot could stand at a place of a map; needs numpy, so it is loaded for ``--map`` only."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.map_file import load_map

ROBOT_RADIUS_M = 0.16
"""Nearer than this the footprint touches whatever its heading (document, section 3.3.2: its half width)."""
_OCCUPIED_FROM = 65


def problem_on_map(
    map_file: Path, warn: Callable[[str], None] = lambda sentence: None
) -> Callable[[float, float], str | None]:
    """Return a function that says what is wrong with a place, None when nothing is.

    Args:
        map_file: The YAML file of the map.
        warn: Told what is probably wrong with the map.

    Returns:
        A function of x and y in metres, map frame; its answer completes the sentence "the hotspot is ...".

    Raises:
        ConfigError: The map cannot be read.
    """
    grid = load_map(map_file, warn)
    return lambda x, y: _problem(grid, x, y, map_file.name)


def _problem(grid: OccupancyGrid, x: float, y: float, name: str) -> str | None:
    problem = grid.problem_with_place(x, y)
    if problem is not None:
        return problem.replace("the map", f"the map {name}", 1)
    row, column = grid.cell_of(x, y)
    if grid.cells[row, column] >= _OCCUPIED_FROM:
        return f"in an obstacle of the map {name}"
    reach = int(np.ceil(ROBOT_RADIUS_M / grid.resolution))
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    near = (np.hypot(rows, columns) * grid.resolution) <= ROBOT_RADIUS_M
    rows, columns = rows[near] + row, columns[near] + column
    inside = (rows >= 0) & (rows < grid.cells.shape[0]) & (columns >= 0) & (columns < grid.cells.shape[1])
    if (grid.cells[rows[inside], columns[inside]] >= _OCCUPIED_FROM).any():
        return f"nearer than {ROBOT_RADIUS_M:g} m to an obstacle of the map {name}"
    return None
