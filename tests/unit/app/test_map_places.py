"""Where on a map the robot can stand."""

import numpy as np
import pytest

from florence_bt.app.mission_files.map_places import problem_on_map
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.map_server.map_writer import save_map


@pytest.fixture
def problem_at(tmp_path):
    cells = np.full((40, 60), FREE, np.int8)
    cells[:, 0] = OCCUPIED
    cells[20, 30] = OCCUPIED
    cells[0, 50:] = UNKNOWN
    save_map(OccupancyGrid(0.05, Pose2(-1.0, -1.0, 0.0), cells), tmp_path / "m.yaml")
    return problem_on_map(tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("x", "y", "problem"),
    [
        (0.0, 0.5, None),
        (-0.98, 0.0, "in an obstacle of the map m.yaml"),
        (-0.88, 0.0, "nearer than 0.16 m to an obstacle"),
        (-0.75, 0.0, None),
        (0.525, 0.025, "in an obstacle"),
        (0.525, 0.15, "nearer than"),
        (0.525, 0.3, None),
        (1.9, -0.99, "where the map m.yaml knows nothing"),
        (1.99, 0.99, None),
        (2.01, 0.0, "outside the map m.yaml (x -1 to 2 m, y -1 to 1 m)"),
        (0.0, -1.01, "outside the map"),
    ],
)
def test_places(problem_at, x, y, problem):
    told = problem_at(x, y)
    assert told is None if problem is None else told.startswith(problem)
