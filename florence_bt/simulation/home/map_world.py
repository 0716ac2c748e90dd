"""A world out of a map, of a building of which nothing else is known: what is occupied becomes a wall."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy  # its parts load at their first use
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.core.text_files import decode, read_bytes
from florence_bt.simulation.home.flat import Flat, FlatHotspot, Room, Solid
from florence_bt.skills.navigation.map_server.map_file import load_map

WALL_HEIGHT_M = 2.0
"""Of the walls of a map, which has no heights. Chosen."""
_WALL, _FLOOR = (214, 208, 196), (150, 140, 128)
_EDGE = np.ones((3, 3), bool)


def is_map(file: Path) -> bool:
    """Tell whether a YAML file describes a map, and not a home."""
    try:
        return re.search(r"^image\s*:", decode(read_bytes(file), file), re.MULTILINE) is not None
    except ConfigError:
        return False  # reading it as a home reports what is wrong


def flat_of_map(file: Path) -> Flat:
    """Return the world of a map: one room without doors, in which the robot starts where most room is.

    Raises:
        ConfigError: The map is wrong, or has no free place.
    """
    grid = load_map(file)
    free = grid.cells == FREE
    if not free.any():
        raise ConfigError("the map has no free cell", file=file)
    walls = _walls(grid.cells)
    rows, columns = np.nonzero(free)
    start = _widest_place(grid, walls)
    x = grid.origin.x + grid.resolution * np.array([columns.min(), columns.max() + 1])
    y = grid.origin.y + grid.resolution * np.array([rows.min(), rows.max() + 1])
    solids = tuple(_solids(grid, walls))
    spans = (float(x[0]), float(x[1])), (float(y[0]), float(y[1]))
    name = re.sub(r"[^a-z0-9_]", "_", file.stem.lower())
    return Flat(
        name=name,
        start=start,
        floor_colour=_FLOOR,
        solids=solids,
        mapped=solids,
        doors=(),
        rooms=(Room("everywhere", *spans, FlatHotspot("everywhere", start)),),
        objects=(),
        seats=(),
        places=(),
    )


def _walls(cells: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Mark the occupied cells, and where free ones end without a wall: at unknown outside, or the edge."""
    framed = np.pad(cells, 1, constant_values=UNKNOWN)
    labels, _ = scipy.ndimage.label(framed == UNKNOWN, structure=_EDGE)
    outside = labels == labels[0, 0]
    free = framed == FREE
    walls = framed == OCCUPIED
    walls |= outside & scipy.ndimage.binary_dilation(free, structure=_EDGE)
    return walls


def _widest_place(grid: OccupancyGrid, walls: NDArray[np.bool_]) -> Pose2:
    room = scipy.ndimage.distance_transform_edt(~walls)[1:-1, 1:-1] * (grid.cells == FREE)
    row, column = np.unravel_index(int(np.argmax(room)), room.shape)
    res = grid.resolution
    return Pose2(float(grid.origin.x + (column + 0.5) * res), float(grid.origin.y + (row + 0.5) * res), 0.0)


def _solids(grid: OccupancyGrid, walls: NDArray[np.bool_]) -> Iterator[Solid]:
    """Yield the walls as few boxes: runs along a row, joined with the same runs of the next rows."""
    res = grid.resolution
    open_runs: dict[tuple[int, int], int] = {}
    for row in range(len(walls) + 1):
        edges = np.diff(np.concatenate([[0], walls[row] if row < len(walls) else [], [0]]).astype(int))
        begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        runs = {(int(a), int(b)) for a, b in zip(begins, ends, strict=True)}
        for run in sorted(set(open_runs) - runs):
            first = open_runs.pop(run)
            # The frame of one cell is left out again.
            x = grid.origin.x + res * ((run[0] + run[1]) / 2 - 1)
            y = grid.origin.y + res * ((first + row) / 2 - 1)
            half = (res * (run[1] - run[0]) / 2, res * (row - first) / 2)
            yield Solid("wall", x, y, 0.0, half, 0.0, 0.0, WALL_HEIGHT_M, _WALL)
        for run in runs - set(open_runs):
            open_runs[run] = row
