"""Planning, inflation and control beside what others have for it, in processor time and in one run.

The planner against ``MCP_Geometric`` of scikit-image.
"""

from __future__ import annotations

import time

import cv2
import numpy as np
import pytest
from skimage.graph import MCP_Geometric

from benchmarks.measure import seconds_per_call, size
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, inflate
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.controller import Controller
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.people import People
from florence_bt.skills.navigation.navigate.planner import Plan, PlannerParameters, plan_path

SIDES, INFLATED = size([400, 2000, 4000], [200]), size(2000, 200)
"""Cells to a side of the maps."""


def rooms(side: int) -> np.ndarray:
    """Square rooms of 100 cells with doors of 20, cells -1, 0 or 100."""
    cells = np.zeros((side, side), np.int8)
    for at in range(0, side, 100):
        cells[at, :] = cells[:, at] = 100
    for at in range(0, side, 100):
        for middle in range(50, side, 100):
            cells[at, middle - 10 : middle + 10] = 0
            cells[middle - 10 : middle + 10, at] = 0
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return cells


def scattered(side: int) -> np.ndarray:
    """Single obstacles at random, so far apart that there is a way."""
    cells = np.zeros((side, side), np.int8)
    cells[np.random.default_rng(side).random((side, side)) < 0.001] = 100
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return cells


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("make", [rooms, scattered])
def test_planner(benchmark, figures, side, make):
    costmap = Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), make(side)))
    master = costmap.master
    free = np.argwhere(master < INSCRIBED)
    middle = np.array([side, side])
    begin, end = (tuple(free[np.argmin(np.abs(free - share * middle).sum(axis=1))]) for share in (0.1, 0.9))
    start, goal = (Pose2((u + 0.5) * 0.05, (v + 0.5) * 0.05) for v, u in (begin, end))
    crossing = np.where(master >= INSCRIBED, -1.0, 50.0 + 3.0 * np.minimum(master, 252)).clip(-1.0, 253.0)

    def ours():
        return plan_path(costmap, start, goal, PlannerParameters())

    def theirs():
        return MCP_Geometric(crossing).find_costs([begin], [end])

    assert isinstance(ours(), Plan)
    took = []
    for call in (ours, theirs):
        least = float("inf")
        for _ in range(3 if side < 4000 else 1):
            before = time.process_time()
            call()
            least = min(least, time.process_time() - before)
        took.append(least)
    benchmark.pedantic(ours, rounds=1)
    what = f"planner, {side} x {side} cells, {make.__name__}: times faster than MCP_Geometric"
    figures.add(what, f"{took[1] / took[0]:.1f}", f"{1e3 * took[0]:.0f} ms and {1e3 * took[1]:.0f} ms")


@pytest.mark.parametrize("make", [rooms, scattered])
def test_inflation(benchmark, figures, make):
    parameters = CostmapParameters()
    grid = OccupancyGrid(0.05, Pose2(), make(INFLATED))
    costmap = Costmap(parameters, grid)
    marked = np.where(grid.cells == 100, LETHAL, 0).astype(np.uint8)
    reach, table = costmap._reach, costmap._table
    fine = np.concatenate([table, [0]])[
        np.minimum((np.arange(0, reach + 1, 0.01)) ** 2, reach**2 + 1).astype(int)
    ]

    def ours():
        inflate(marked.copy(), reach, table)

    def theirs():
        distance = cv2.distanceTransform(
            (marked != LETHAL).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
        )
        return fine[np.minimum(distance * 100.0, len(fine) - 1).astype(np.int32)]

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    took = seconds_per_call(ours, theirs)
    cv2.setNumThreads(threads)
    benchmark.pedantic(ours, rounds=1)
    what = f"inflation, {INFLATED} x {INFLATED} cells, {make.__name__}: times faster than OpenCV's distance "
    what += "and a table"
    figures.add(what, f"{took[1] / took[0]:.1f}", f"{1e3 * took[0]:.1f} ms and {1e3 * took[1]:.1f} ms")


def test_control_cycle(benchmark, figures):
    parameters = NavigatorParameters()
    navigator = Navigator(load_map("maps/flat.yaml"), parameters)
    costmap, start = navigator.local_costmap, Pose2(2.0, 1.5, 0.3)
    costmap.roll_to(start)
    path = np.stack([np.linspace(2.0, 4.5, 60), 1.5 + 0.2 * np.sin(np.linspace(0.0, 3.0, 60))], axis=1)
    controller = Controller(parameters.controller)
    controller.set_plan(path, Pose2(4.5, 1.5, 0.0))
    marks = np.random.default_rng(1).random(costmap.shape) < 0.002
    costmap._layers["scan"] = np.where(marks, LETHAL, 0).astype(np.uint8)

    def cycle():
        costmap._master = None  # with a new scan
        clearance = Clearance(costmap, start, None, None)
        return controller.control(start, Twist2(0.3, 0.0), costmap, Pose2(), clearance, People())

    (took,) = seconds_per_call(cycle)
    benchmark.pedantic(cycle, rounds=1)
    samples = f"{parameters.controller.vx_samples} x {parameters.controller.vtheta_samples} samples"
    figures.add("one control cycle with a new costmap", f"{1e3 * took:.2f} ms", samples)
