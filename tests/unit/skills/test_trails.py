"""What the camera marked where somebody was who has walked on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters, Rays
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.vacated_cells import VacatedCells
from tests.unit.skills.navigation_world import make_map

ANN, BOB = 1, 2


def test_a_place_is_left_when_the_person_is_a_step_away() -> None:
    trails = VacatedCells()
    left = [trails.saw(0.2 * k, ANN, (0.11 * k, 0.0)) for k in range(12)]
    assert not any(left[:6])
    assert [x for places in left for x, _ in places] == pytest.approx(list(0.11 * np.arange(6)))


def test_who_stands_or_sways_leaves_nothing() -> None:
    trails = VacatedCells()
    assert not any(trails.saw(0.2 * k, ANN, (0.2 * math.sin(k), 0.1 * math.cos(k))) for k in range(50))


def test_a_jump_that_nobody_walks_leaves_nothing() -> None:
    trails = VacatedCells()
    trails.saw(0.0, ANN, (0.0, 0.0))
    assert trails.saw(0.2, ANN, (1.5, 0.0)) == []
    assert trails.saw(0.4, ANN, (1.6, 0.0)) == []


def test_who_was_out_of_sight_for_some_seconds_has_left_where_they_vanished() -> None:
    trails = VacatedCells()
    trails.saw(0.0, ANN, (0.0, 0.0))
    assert trails.saw(3.0, ANN, (2.0, 0.0)) == [(0.0, 0.0)]
    assert trails.saw(100.0, ANN, (3.0, 0.0)) == []


def test_everybody_has_a_trail_of_their_own() -> None:
    trails = VacatedCells()
    trails.saw(0.0, ANN, (0.0, 0.0))
    assert trails.saw(1.0, BOB, (1.0, 0.0)) == []


def test_a_disc_is_cleared_in_the_named_layers_only() -> None:
    costmap = Costmap(CostmapParameters())
    ends = np.array([[1.0, 0.0], [1.2, 0.0], [1.8, 0.0]])
    rays = Rays(0.0, 0.0, ends, np.hypot(*ends.T), 0.1, 4.0)
    for source in ("scan", "depth"):
        costmap.add_rays(source, rays, Pose2())
    costmap.clear_disc(("depth", "absent"), (1.1, 0.0), 0.35)
    layers = {name: marks.copy() for name, marks in costmap._layers.items()}
    cells = [costmap.cell_of(x, 0.0) for x in (1.2, 1.8)]
    assert [layers["depth"][cell] for cell in cells] == [0, LETHAL]
    assert layers["scan"][cells[1]] == LETHAL
    assert (layers["scan"] == LETHAL).sum() > (layers["depth"] == LETHAL).sum()
    costmap.clear_disc(("depth",), (90.0, -90.0), 0.35)


def overhang_at(distance: float, stamp: float) -> LaserScan:
    ranges = np.array([np.nan, distance, np.nan], np.float32)
    return LaserScan(stamp, "camera", -0.01, 0.01, 1.2, 4.0, ranges)


def test_a_person_who_walks_away_leaves_no_overhang_before_the_robot() -> None:
    """Their shoulders hang over; from nearer than 1.2 m no picture says that they have gone."""
    navigator = Navigator(make_map())
    robot = Pose2(1.0, 2.4)
    for k in range(9):
        person = robot.apply(1.4 + 0.1 * k, 0.0)
        navigator.saw_person(0.2 * k, ANN, *person)
        navigator.add_scan(
            "overhangs", overhang_at(1.27 + 0.1 * k, 0.2 * k), Transform3.identity(), robot, Pose2()
        )
        # The robot follows, so that the marks are too near to be cleared by the next picture.
        robot = Pose2(1.0 + 0.1 * (k + 1), 2.4)
    marks = [costmap._layers["overhangs"] for costmap in (navigator.local_costmap, navigator.global_costmap)]
    for costmap, marked in zip((navigator.local_costmap, navigator.global_costmap), marks, strict=True):
        assert not marked[costmap.cell_of(2.27, 2.4)]
        assert (marked == LETHAL).any()
