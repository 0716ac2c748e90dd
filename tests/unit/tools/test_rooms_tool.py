"""tools.rooms judges proposals as docs/notes/rooms.md says."""

import dataclasses

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from tools.rooms import driven_map, judge, row_of


def test_right_and_wrong_homes_are_told_apart():
    flat = load_flat()
    grid = laser_map(flat)
    right, rooms = judge(flat, grid, Pose2())
    assert right.right and len(rooms) == right.proposed == len(flat.rooms) and not right.misplaced
    opened = grid.cells.copy()
    row, column = grid.cell_of(4.15, 3.0)  # the kitchen loses its wall to the hall
    opened[row - 20 : row + 20, column - 3 : column + 4] = FREE
    wrong, _ = judge(flat, dataclasses.replace(grid, cells=opened), Pose2())
    assert not wrong.right and wrong.proposed < len(flat.rooms)
    assert row_of([right, wrong])[1] == "1 of 2"


@pytest.mark.slow
def test_a_driven_map_shows_the_walls_where_they_are():
    flat = load_flat()
    grid, frame = driven_map(flat, 1)
    again, _ = driven_map(flat, 1)
    assert (grid.cells == again.cells).all()
    for x, y, value in ((1.0, 3.75, OCCUPIED), (5.4, 7.3, OCCUPIED), (7.0, 3.0, FREE)):
        row, column = grid.cell_of(*frame.inverse().apply(x, y))
        assert (grid.cells[row - 2 : row + 3, column - 2 : column + 3] == value).any()
