"""``florence hotspot draw``: the map with rooms, hotspots and zones as a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import Point
from florence_bt.core.sensing import UNKNOWN, OccupancyGrid
from florence_bt.skills.locator.hotspots import Hotspots

FORMS = (".png", ".svg")
_MARGIN_M = 1.0
_CELLS = 200
"""Along the longer side of ground that no map knows."""


def draw(hotspots: Hotspots, grid: OccupancyGrid | None, form: str, title: str) -> bytes:
    """Draw the places of a home.

    Args:
        hotspots: What to draw.
        grid: The map; None draws on unknown ground.
        form: ``.png`` or ``.svg``.
        title: A line above the picture.

    Returns:
        The picture.

    Raises:
        ConfigError: There is nothing to draw.
    """
    return _draw(grid or _unknown_ground(hotspots), hotspots, form, title)


def draw_change(
    before: OccupancyGrid, after: OccupancyGrid, hotspots: Hotspots | None, form: str, title: str
) -> bytes:
    """Draw a changed map; cells that have changed in their place are coloured. As :func:`draw`."""
    changed = None
    if before.cells.shape == after.cells.shape and before.origin == after.origin:
        changed = before.cells != after.cells
    return _draw(after, hotspots or Hotspots(), form, title, changed)


def check_form(picture: Path) -> None:
    """Refuse a picture of a form that cannot be written.

    Raises:
        ConfigError: It has another ending than .png or .svg.
    """
    if picture.suffix not in FORMS:
        raise ConfigError(
            f"a picture cannot be written as {picture.name!r}", valid=["places.png", "places.svg"]
        )


def _draw(
    grid: OccupancyGrid,
    hotspots: Hotspots,
    form: str,
    title: str,
    changed: NDArray[np.bool_] | None = None,
) -> bytes:
    from florence_bt.simulation.home.picture import draw_places

    return draw_places(grid, hotspots, form.removeprefix("."), title, changed)


def _unknown_ground(hotspots: Hotspots) -> OccupancyGrid:
    """Return a map that knows nothing, around all places."""
    points: list[Point] = [(spot.pose.x, spot.pose.y) for spot in hotspots]
    for area in (*hotspots, *hotspots.zones):
        points += area.polygon
    if not points:
        raise ConfigError("there is nothing to draw: no hotspots, no zones and no map", valid=["--map FILE"])
    low, high = np.min(points, axis=0) - _MARGIN_M, np.max(points, axis=0) + _MARGIN_M
    side = float((high - low).max()) / _CELLS
    columns, rows = np.ceil((high - low) / side).astype(int)
    return OccupancyGrid(
        side, Pose2(float(low[0]), float(low[1])), np.full((rows, columns), UNKNOWN, np.int8)
    )
