"""Cells of a grid map."""

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, LaserScan, OccupancyGrid

# Row 0 has the lowest y; its corner lies at (-1, 2), so that x reaches 0.5 and y reaches 3.
GRID = OccupancyGrid(
    0.5, Pose2(-1.0, 2.0), np.array([[FREE, OCCUPIED, UNKNOWN], [51, 50, FREE]], dtype=np.int8)
)


@pytest.mark.parametrize(
    ("x", "y", "cell", "inside", "occupied"),
    [
        (-1.0, 2.0, (0, 0), True, False),
        (-0.26, 2.4, (0, 1), True, True),
        (0.2, 2.2, (0, 2), True, False),
        (-0.8, 2.6, (1, 0), True, True),
        (-0.3, 2.9, (1, 1), True, False),
        (-1.01, 2.2, (0, -1), False, False),
        (-0.8, 1.9, (-1, 0), False, False),
        (0.5, 2.0, (0, 3), False, False),
        (-0.3, 3.0, (2, 1), False, False),
    ],
)
def test_the_cell_of_a_place(x, y, cell, inside, occupied):
    assert GRID.cell_of(x, y) == cell
    assert GRID.contains(*cell) is inside
    assert GRID.is_occupied(x, y) is occupied


def test_directions_of_beams_are_those_of_their_angles():
    ranges = np.ones(5, np.float32)
    scan = LaserScan(0.0, "laser", -1.0, 0.5, 0.1, 5.0, ranges)
    assert np.array_equal(scan.directions(), np.stack([np.cos(scan.angles()), np.sin(scan.angles())], axis=1))
    turned = LaserScan(0.0, "laser", 1.0, -0.5, 0.1, 5.0, ranges)
    assert np.array_equal(turned.directions(), scan.directions()[::-1])


@pytest.mark.parametrize(
    ("x", "y", "slack", "problem"),
    [
        (-0.9, 2.1, 0.0, None),
        (0.2, 2.2, 0.0, "where the map knows nothing"),
        (0.2, 2.2, 0.5, None),
        (9.0, 2.2, 0.0, "outside the map (x -1 to 0.5 m, y 2 to 3 m)"),
        (9.0, 2.2, 1.0, "outside the map (x -1 to 0.5 m, y 2 to 3 m)"),
        (-9.0, -9.0, 1.0, "outside the map (x -1 to 0.5 m, y 2 to 3 m)"),
        (-1.4, 2.2, 0.5, None),
        (float("nan"), 2.2, 0.5, "not finite"),
    ],
)
def test_whether_the_map_knows_a_place(x, y, slack, problem):
    assert GRID.problem_with_place(x, y, slack) == problem
