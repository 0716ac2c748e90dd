"""Worlds out of maps: where a map is occupied, and only there, something stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.simulated import with_world_files
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import default_flat_file, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.map_world import is_map
from florence_bt.skills.navigation.map_server.map_writer import save_map


def map_of(folder: Path, cells: np.ndarray) -> Path:
    return save_map(OccupancyGrid(0.05, Pose2(-1.0, 2.0), cells.astype(np.int8)), folder / "Some Place.yaml")


def covered(flat, grid: OccupancyGrid) -> np.ndarray:
    """Which cells of the grid have their middle in a solid."""
    rows, columns = np.indices(grid.cells.shape)
    x = grid.origin.x + (columns + 0.5) * grid.resolution
    y = grid.origin.y + (rows + 0.5) * grid.resolution
    result = np.zeros(grid.cells.shape, bool)
    for solid in flat.solids:
        result |= (abs(x - solid.x) < solid.half[0]) & (abs(y - solid.y) < solid.half[1])
    return result


@pytest.mark.parametrize("seed", range(4))
def test_walls_stand_where_the_map_is_occupied(tmp_path: Path, seed: int) -> None:
    cells = np.where(np.random.default_rng(seed).random((40, 60)) < 0.1, 100, 0)
    file = map_of(tmp_path, cells)
    flat = choose_flat(file)
    grid = OccupancyGrid(0.05, Pose2(-1.0, 2.0), cells.astype(np.int8))
    assert np.array_equal(covered(flat, grid), cells == 100)
    assert flat.name == "some_place"
    # Fewer boxes than cells, and none of them in another.
    area = sum(4 * solid.half[0] * solid.half[1] for solid in flat.solids)
    outside = 2 * (60 + 40 + 2) * 0.05**2
    assert (cells == 100).sum() * 0.05**2 <= area <= (cells == 100).sum() * 0.05**2 + outside
    assert len(flat.solids) < (cells == 100).sum() + 5


def test_nobody_gets_out_of_the_known_part(tmp_path: Path) -> None:
    cells = np.full((60, 80), -1)
    cells[10:50, 10:70] = 0
    cells[30, 30] = -1  # a speck inside is no wall
    flat = choose_flat(map_of(tmp_path, cells))
    space = free_space_of(flat)
    reached = space.reachable((flat.start.x, flat.start.y), 0.1)
    rows, columns = np.nonzero(reached)
    x, y = space.frame.centres()
    assert x[columns.min()] > -0.5 and x[columns.max()] < 2.5
    assert y[rows.min()] > 2.5 and y[rows.max()] < 4.5
    assert space.clearance_at(-1.0 + 0.05 * 30.5, 2.0 + 0.05 * 30.5) > 0.3
    assert space.clearance_at(flat.start.x, flat.start.y) > 0.8


def test_what_is_no_map_of_a_place_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no free cell"):
        choose_flat(map_of(tmp_path, np.full((5, 5), 100)))
    assert not is_map(default_flat_file())
    assert not is_map(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        choose_flat(tmp_path / "none.yaml")


def test_a_bring_up_takes_the_map_itself(tmp_path: Path) -> None:
    file = save_map(laser_map(load_flat()), tmp_path / "home.yaml")
    options = with_world_files(BringUp(folder=str(tmp_path / "up"), world_file=str(file)))
    assert options.map_file == str(file)
    assert options.hotspots_file is not None and "everywhere" in Path(options.hotspots_file).read_text()
