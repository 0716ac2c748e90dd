"""Says whether the robot could stand at a place of a map; needs numpy, so it is loaded for ``--map`` only."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from florence_bt.skills.navigation.map_server.map_file import load_map

HALF_WIDTH_M = 0.16
"""Nearer than this the footprint touches whatever its heading (document, section 3.3.2: its half width)."""


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
    grid, name = load_map(map_file, warn), f"the map {map_file.name}"

    def problem_at(x: float, y: float) -> str | None:
        problem = grid.problem_with_standing(x, y, HALF_WIDTH_M)
        return problem and problem.replace("the map", name, 1)

    return problem_at
