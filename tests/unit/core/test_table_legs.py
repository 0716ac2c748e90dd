"""Tables and chairs of a map, of which a laser saw the legs only."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.table_legs import with_tables
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import Solid
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import CostmapParameters
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters

TABLE = Pose2(3.0, 2.0, 0.0)


def room(*furniture: tuple[Pose2, float, float], without: int = 0) -> OccupancyGrid:
    """Legs in a map of 6 m by 4 m: poses, lengths and widths between the legs of each piece.

    Args:
        furniture: As above.
        without: This many legs of the last piece are not on the map.
    """
    grid = OccupancyGrid(0.05, Pose2(-0.02, 0.01), np.zeros((80, 120), np.int8))
    legs = [
        pose.apply(along * length / 2, across * width / 2)
        for pose, length, width in furniture
        for along in (1, -1)
        for across in (1, -1)
    ]
    for x, y in legs[: len(legs) - without]:
        grid.cells[grid.cell_of(x, y)] = 100
    return grid


@pytest.mark.parametrize("turn_deg", [0.0, 17.0, 45.0, 90.0])
@pytest.mark.parametrize("size", [(0.84, 0.54), (1.1, 0.7), (0.38, 0.38)])
def test_the_place_under_a_table_is_occupied(turn_deg: float, size: tuple[float, float]) -> None:
    table = Pose2(TABLE.x, TABLE.y, math.radians(turn_deg))
    grid = with_tables(room((table, *size)))
    for along, across in ((0.0, 0.0), (0.35, 0.0), (-0.35, 0.3), (0.0, -0.35)):
        assert grid.is_occupied(*table.apply(along * size[0], across * size[1]))
    assert not grid.is_occupied(*table.apply(0.5 * size[0] + 0.12, 0.0))


@pytest.mark.parametrize("size", [(1.9, 0.7), (0.15, 0.15)])
def test_what_is_too_large_or_small_for_a_table_stays_as_it_is(size: tuple[float, float]) -> None:
    grid = room((TABLE, *size))
    assert np.array_equal(with_tables(grid).cells, grid.cells)


def test_three_legs_and_crooked_ones_are_no_table() -> None:
    for grid in (room((TABLE, 0.84, 0.54), without=1), room((TABLE, 0.84, 0.54), without=1)):
        grid.cells[grid.cell_of(*TABLE.apply(-0.42, -0.05))] = 100
        assert not with_tables(grid).is_occupied(TABLE.x, TABLE.y)


def test_between_two_chairs_there_is_a_way() -> None:
    chairs = [(Pose2(x, 2.0), 0.38, 0.38) for x in (2.0, 3.1)]
    grid = with_tables(room(*chairs))
    assert grid.is_occupied(2.0, 2.0) and grid.is_occupied(3.1, 2.0)
    assert not grid.is_occupied(2.55, 2.0)


def test_a_table_among_its_chairs_is_filled_and_noise_is_not() -> None:
    table = (TABLE, 1.1, 0.7)
    chairs = [(Pose2(TABLE.x + x, TABLE.y + y), 0.38, 0.38) for x in (-0.3, 0.3) for y in (-0.75, 0.75)]
    assert with_tables(room(table, *chairs)).is_occupied(TABLE.x, TABLE.y)

    noise = OccupancyGrid(0.05, Pose2(), np.zeros((300, 300), np.int8))
    noise.cells[np.random.default_rng(1).random(noise.cells.shape) < 0.04] = 100
    inside = with_tables(noise).cells[40:-40, 40:-40]
    assert np.array_equal(inside, noise.cells[40:-40, 40:-40])


def test_a_table_at_the_edge_of_the_map_is_filled_up_to_it() -> None:
    grid = room((Pose2(0.45, 0.4), 0.84, 0.7))
    assert with_tables(grid).is_occupied(0.45, 0.4)


def test_walls_and_the_given_map_stay() -> None:
    grid = room((TABLE, 0.84, 0.54))
    grid.cells[:, 5] = 100
    before = grid.cells.copy()
    assert (with_tables(grid).cells >= before).all()
    assert np.array_equal(grid.cells, before)


@pytest.mark.parametrize("seed", [601, 604, 607])
def test_the_glass_tables_of_generated_homes_are_found(seed: int) -> None:
    flat = choose_flat(None, seed)
    grid = with_tables(laser_map(flat))
    tops = [each for each in flat.mapped if _is_glass_top(each)]
    assert all(grid.is_occupied(top.x, top.y) for top in tops)


def _is_glass_top(solid: Solid) -> bool:
    return solid.name.startswith("glass_table") and solid.surface == "glass"


def test_navigation_fills_tables_unless_it_is_told_not_to() -> None:
    grid = room((TABLE, 0.84, 0.54))
    for fill in (True, False):
        settings = NavigatorParameters(costmap=CostmapParameters(fill_tables=fill))
        assert (Navigator(grid, settings).cost_at(TABLE.x, TABLE.y) == LETHAL) == fill
