"""Maps cleaned, cropped, turned and drawn on: the grids."""

import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.mapping.editing import clean, crop, draw, rotate
from florence_bt.skills.navigation.mapping.wall_direction import turned, wall_direction

CELL = 0.05


@pytest.fixture
def grid():
    """A room of 4 x 3 m at (1, -2), walls of one cell, in unknown ground."""
    cells = np.full((100, 120), UNKNOWN, np.int8)
    cells[19:81, 19:101] = OCCUPIED
    cells[20:80, 20:100] = FREE
    return OccupancyGrid(CELL, Pose2(0.0, -3.0), cells)


def count(grid, value):
    return int((grid.cells == value).sum())


def test_clean_leaves_a_clean_map_as_it_is(grid):
    edited = clean(grid)
    assert (edited.grid.cells == grid.cells).all() and edited.done == ("nothing to clean",)


def test_clean_removes_what_is_not_there(grid):
    dirty = OccupancyGrid(CELL, grid.origin, grid.cells.copy())
    dirty.cells[40, 40] = OCCUPIED  # a speck
    dirty.cells[50, 50:52] = UNKNOWN  # a hole in the floor
    dirty.cells[60, 60] = 30  # neither free nor occupied
    dirty.cells[5:8, 5:8] = FREE  # seen through a gap
    dirty.cells[19, 60] = FREE  # a hole in the wall
    dirty.cells[90, 90] = OCCUPIED  # a speck outside
    cleaned = clean(dirty)
    assert (cleaned.grid.cells == grid.cells).all()
    assert len(cleaned.done) == 5
    assert (dirty.cells != grid.cells).any(), "the map itself is not changed"


def test_clean_keeps_what_stands_there(grid):
    for row, column in ((40, 40), (40, 54), (50, 40), (50, 54)):
        grid.cells[row, column] = OCCUPIED  # the legs of a table
    grid.cells[60, 60:66] = OCCUPIED  # longer than a speck
    grid.cells[19, 40:56] = FREE  # a door
    assert (clean(grid).grid.cells == grid.cells).all()
    assert count(clean(grid, speck=0.5).grid, OCCUPIED) == count(grid, OCCUPIED) - 6


def test_crop_keeps_every_place(grid):
    cropped = crop(grid).grid
    assert count(cropped, OCCUPIED) == count(grid, OCCUPIED) and count(cropped, FREE) == count(grid, FREE)
    assert cropped.cells.shape == (62 + 10, 82 + 10)
    for x, y in ((1.02, -1.98), (3.3, -0.4), (4.96, 0.98)):
        assert cropped.cells[cropped.cell_of(x, y)] == grid.cells[grid.cell_of(x, y)]
    box = crop(grid, ((3.0, -1.0), (1.5, 0.5))).grid
    assert box.cells.shape == (30, 30) and (box.cells == FREE).all()
    assert (box.origin.x, box.origin.y) == pytest.approx((1.5, -1.0))


def test_crop_tells_what_it_cannot(grid):
    with pytest.raises(ConfigError, match=r"x 0\.00 to 6\.00 m"):
        crop(grid, ((20.0, 20.0), (21.0, 21.0)))
    with pytest.raises(ConfigError, match="knows nothing"):
        crop(OccupancyGrid(CELL, Pose2(), np.full((5, 5), UNKNOWN, np.int8)))


@pytest.mark.parametrize("degrees", [3.0, -17.0, 44.0, 90.0, 200.0])
def test_a_turned_room_stays_closed(grid, degrees):
    edited = rotate(grid, math.radians(degrees))
    from scipy import ndimage

    pieces, _ = ndimage.label(edited.grid.cells != OCCUPIED)
    inside = pieces[edited.grid.cell_of(*edited.move.apply(3.0, -0.5))]
    assert inside and inside != pieces[0, 0]
    assert (edited.grid.cells[pieces == inside] == FREE).sum() == pytest.approx(count(grid, FREE), rel=0.04)


@pytest.mark.parametrize("degrees", [3.0, -17.0, 44.0])
def test_the_direction_of_walls_is_found(grid, degrees):
    askew = turned(grid, math.radians(degrees))
    assert math.degrees(wall_direction(askew)) == pytest.approx(degrees, abs=0.5)
    straight = rotate(askew, -wall_direction(askew)).grid
    assert math.degrees(wall_direction(straight)) == pytest.approx(0.0, abs=0.3)


def test_what_is_drawn_is_there(grid):
    edited = draw(grid, [("wall", [(2.0, -2.0), (2.0, 1.0)]), ("free", [(1.9, -1.0), (2.1, 0.0)])])
    cells, cell_of = edited.grid.cells, edited.grid.cell_of
    assert cells[cell_of(2.0, 0.5)] == OCCUPIED and cells[cell_of(2.0, -0.5)] == FREE
    assert len(edited.done) == 2 and "made occupied" in edited.done[0]
    triangle = draw(grid, [("unknown", [(2.0, -1.0), (4.0, -1.0), (4.0, 0.0)])]).grid
    assert count(triangle, UNKNOWN) - count(grid, UNKNOWN) == pytest.approx(400, abs=25)


@pytest.mark.parametrize("thickness", [0.0, 0.01, 0.1])
def test_a_drawn_wall_has_no_gap(grid, thickness):
    from scipy import ndimage

    walled = draw(grid, [("wall", [(0.9, -1.7), (3.1, 0.2), (5.1, 0.4)])], thickness).grid
    pieces, _ = ndimage.label(walled.cells == FREE)
    assert pieces[walled.cell_of(1.5, 0.5)] != pieces[walled.cell_of(4.0, -1.5)]


@pytest.mark.parametrize(
    ("kind", "points", "told"),
    [
        ("wal", [(1, 1), (2, 2)], "wall"),
        ("free", [(1, 1)], "one point"),
        ("free", [(50, 50), (51, 51)], "no cell of the map"),
    ],
)
def test_what_cannot_be_drawn_is_told(grid, kind, points, told):
    with pytest.raises(ConfigError, match=told):
        draw(grid, [(kind, points)])
