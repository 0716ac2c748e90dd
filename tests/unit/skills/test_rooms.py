import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import area, contains, crossing_edges
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.skills.navigation.mapping.editing import clean
from florence_bt.skills.navigation.mapping.rooms import propose_rooms
from florence_bt.skills.navigation.mapping.wall_direction import turned, wall_direction
from tests.sweeps import sweep

CELL = 0.05


def home(width=8.0, depth=4.0, door=0.8, door_at=1.6, wall_at=4.0):
    """Two rooms side by side with a wall of 0.1 m between them that has a door."""
    rows, columns = round(depth / CELL), round(width / CELL)
    cells = np.full((rows + 20, columns + 20), UNKNOWN, np.int8)
    cells[8 : rows + 12, 8 : columns + 12] = OCCUPIED
    cells[10 : rows + 10, 10 : columns + 10] = FREE
    grid = OccupancyGrid(CELL, Pose2(-0.5, -0.5), cells)
    block(grid, wall_at - 0.05, 0.0, wall_at + 0.05, depth)
    block(grid, wall_at - 0.05, door_at, wall_at + 0.05, door_at + door, FREE)
    return grid


def block(grid, left, low, right, high, value=OCCUPIED):
    (row, column), (end_row, end_column) = (
        grid.cell_of(left + 1e-6, low + 1e-6),
        grid.cell_of(right + 1e-6, high + 1e-6),
    )
    grid.cells[row:end_row, column:end_column] = value


def areas(grid):
    return sorted(round(area(room.polygon), 1) for room in propose_rooms(grid))


@pytest.mark.parametrize("door", [0.6, 0.8, 1.1])
def test_a_door_divides_rooms(door):
    assert areas(home(door=door)) == pytest.approx([15.8, 15.8], abs=0.3)


def test_a_door_in_the_corner_divides_rooms_too():
    assert len(areas(home(door_at=0.0))) == 2


@pytest.mark.parametrize("low", [0.6, 3.0, 3.6])
def test_so_does_a_wall_with_a_hole_where_a_mirror_hangs(low):
    grid = home()
    block(grid, 3.95, low, 4.05, low + 0.4, FREE)
    assert areas(grid) == pytest.approx([15.8, 15.8], abs=0.3)


def test_a_wide_opening_does_not():
    assert areas(home(door=1.8)) == pytest.approx([32.0], abs=0.3)


def test_furniture_does_not():
    grid = home(wall_at=5.0)
    block(grid, 1.5, 0.0, 3.1, 3.1)  # a bed across the room, 0.9 m from the opposite wall
    block(grid, 0.0, 3.4, 0.3, 4.0)  # a shelf in a corner
    for x, y in ((3.6, 1.0), (4.3, 1.0), (3.6, 2.0), (4.3, 2.0)):
        block(grid, x, y, x + 0.05, y + 0.05)  # a table
    assert areas(grid) == pytest.approx([11.8, 19.8], abs=0.4)


def test_nor_does_what_stands_alone_between_a_wall_and_a_bed():
    grid = home(wall_at=7.9, door=0.0)
    block(grid, 3.0, 0.0, 5.0, 2.0)  # the bed
    block(grid, 3.6, 2.7, 4.1, 2.95)  # a stool, 0.7 m from the bed and 1 m from the wall
    block(grid, 3.65, 2.75, 4.05, 2.9, UNKNOWN)
    assert len(areas(grid)) == 1


def test_nor_do_short_walls_far_apart():
    grid = home(wall_at=4.0, door=0.0)
    block(grid, 3.9, 0.0, 4.1, 4.0, FREE)
    block(grid, 3.95, 0.0, 4.05, 1.7)
    block(grid, 3.95, 2.8, 4.05, 4.0)
    assert len(areas(grid)) == 2, "a wide door in a wall"
    block(grid, 3.9, 0.4, 4.1, 1.7, FREE)
    block(grid, 3.2, 0.4, 4.1, 1.3)
    block(grid, 3.2, 1.3, 4.1, 1.4, FREE)
    block(grid, 3.9, 2.5, 4.1, 4.0, FREE)
    block(grid, 3.95, 2.4, 4.05, 4.0, FREE)
    assert len(areas(grid)) == 1, "a cupboard and the other wall"


def test_nor_does_an_open_leaf():
    grid = home(depth=1.5, width=9.0, wall_at=8.9, door=0.0)  # a hall
    open_floor = np.vstack([grid.cells[:-10], home(width=9.0, depth=4.0, door=0.8, door_at=1.6).cells[9:]])
    grid = OccupancyGrid(CELL, grid.origin, open_floor)
    block(grid, 2.0, 1.5, 2.8, 1.7, FREE)
    block(grid, 6.0, 1.5, 6.8, 1.7, FREE)
    block(grid, 2.8, 0.7, 2.85, 1.5)  # a leaf of 0.8 m that leaves 0.7 m of the hall
    assert len(areas(grid)) == 3


def test_the_map_may_be_turned():
    grid = turned(home(), math.radians(33.0))
    assert wall_direction(grid) == pytest.approx(math.radians(33.0), abs=math.radians(0.3))
    assert areas(grid) == pytest.approx([15.8, 15.8], abs=0.6)


def test_what_is_seen_through_a_window_is_no_part_of_a_room():
    grid = home()
    grid.cells[30:60, -12:] = FREE  # out of the window
    wider = np.pad(grid.cells, ((0, 0), (0, 60)), constant_values=UNKNOWN)
    wider[10:80, len(grid.cells[0]) :] = FREE
    assert sum(areas(OccupancyGrid(CELL, grid.origin, wider))) < 34.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 7])
def test_a_generated_home(seed):
    flat = generated_flat(seed)
    grid = laser_map(flat)
    rooms = propose_rooms(grid)
    found = {flat.room_at(room.pose.x, room.pose.y).name for room in rooms}
    assert found == {room.name for room in flat.rooms}
    assert len(rooms) == len(flat.rooms)
    for room in rooms:
        assert contains(room.polygon, room.pose.x, room.pose.y)
        assert crossing_edges(room.polygon) is None
        assert len(room.polygon) <= 12
        row, column = grid.cell_of(room.pose.x, room.pose.y)
        assert (grid.cells[row - 4 : row + 5, column - 4 : column + 5] == FREE).all()


def test_nothing_is_proposed_where_nothing_is_known():
    assert propose_rooms(OccupancyGrid(CELL, Pose2(), np.full((50, 50), UNKNOWN, np.int8))) == []
    assert propose_rooms(OccupancyGrid(CELL, Pose2(), np.full((1, 1), FREE, np.int8))) == []
    assert propose_rooms(OccupancyGrid(CELL, Pose2(), np.full((1, 1), OCCUPIED, np.int8))) == []


@pytest.mark.slow
@pytest.mark.parametrize("cell", sweep([0.02, 0.1, 1.0, 0.25], every=2))
def test_cells_may_have_any_size(cell):
    fine = laser_map(generated_flat(1))
    rows, columns = (int(size * CELL / cell) for size in fine.cells.shape)
    row, column = (np.arange(size) * cell / CELL for size in (rows, columns))
    cells = fine.cells[np.ix_(row.astype(int), column.astype(int))]
    for room in propose_rooms(OccupancyGrid(cell, fine.origin, cells)):
        assert contains(room.polygon, room.pose.x, room.pose.y)
    assert clean(OccupancyGrid(cell, fine.origin, cells)).grid.cells.shape == cells.shape


def test_noise_is_no_home_but_does_no_harm():
    rng = np.random.default_rng(1)
    cells = rng.choice(np.array([FREE, OCCUPIED, UNKNOWN], np.int8), (80, 90), p=[0.9, 0.05, 0.05])
    for room in propose_rooms(OccupancyGrid(CELL, Pose2(3.0, -2.0), cells)):
        assert crossing_edges(room.polygon) is None
