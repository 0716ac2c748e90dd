"""Costmaps: the values of REFERENCE 7.4, rays, layers, rolling."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate.costmap import (
    Costmap,
    CostmapParameters,
    SourceParameters,
    cost_at_distance,
    rays_of,
)
from florence_bt.skills.robot_description.footprint import Footprint, corners_from_flat

PARAMETERS = CostmapParameters()
ORIGIN = Pose2()


def one_beam(length: float, angle: float = 0.0, range_min: float = 0.02, range_max: float = 5.6) -> LaserScan:
    return LaserScan(0.0, "laser", angle, 0.1, range_min, range_max, np.array([length], np.float32))


def add(costmap: Costmap, source: str, scan: LaserScan, robot: Pose2 = ORIGIN) -> None:
    costmap.add_rays(source, rays_of(scan, Transform3.from_pose2(robot)), robot)


def test_cost_at_distance() -> None:
    costs = [cost_at_distance(d, 0.17, PARAMETERS) for d in (0.20, 0.25, 0.30, 0.35, 0.40)]
    assert costs == [186, 113, 68, 41, 25]
    assert [cost_at_distance(d, 0.17, PARAMETERS) for d in (0.0, 0.1, 0.17, 0.401)] == [254, 253, 253, 0]


def test_padded_footprint() -> None:
    footprint = PARAMETERS.make_footprint()
    assert np.allclose(
        footprint.corners, [(-0.17, -0.17), (-0.17, 0.17), (0.20, 0.17), (0.25, 0.01), (0.20, -0.17)]
    )
    assert footprint.inscribed_radius == pytest.approx(0.17)
    assert footprint.circumscribed_radius == pytest.approx(0.2625, abs=1e-4)
    true = PARAMETERS.make_true_footprint()
    assert (true.inscribed_radius, true.circumscribed_radius) == pytest.approx((0.16, 0.2484), abs=1e-4)


def test_outline_is_dense() -> None:
    outline = PARAMETERS.make_footprint().outline(0.025)
    gaps = np.hypot(*(outline - np.roll(outline, 1, axis=0)).T)
    assert gaps.max() <= 0.025 + 1e-9


@pytest.mark.parametrize(
    "corners",
    [[(0.1, 0.0), (0.2, 0.0)], [(0.1, 0.0), (0.2, 0.0), (0.2, 0.1)], [(-1, -1), (1, 1), (1, -1), (-1, 1)]],
)
def test_bad_footprints(corners: list[tuple[float, float]]) -> None:
    with pytest.raises(ConfigError):
        Footprint.from_corners(corners)


@pytest.mark.parametrize("numbers", [[0.1, 0.2, 0.3], [0.1, math.nan]])
def test_bad_footprint_lists(numbers: list[float]) -> None:
    with pytest.raises(ConfigError, match="not a list of x, y"):
        corners_from_flat(numbers)


@pytest.mark.parametrize("name", ["obstacle_range", "inflation_radius", "local_size", "footprint_padding"])
def test_bad_parameters(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        CostmapParameters(**{name: -1.0})  # type: ignore[arg-type]


def test_inflation_is_exact() -> None:
    cells = np.zeros((41, 41), np.int8)
    cells[20, 20] = cells[3, 35] = 100
    costmap = Costmap(PARAMETERS, OccupancyGrid(0.05, Pose2(), cells))
    rows, columns = np.indices(cells.shape)
    nearest = np.minimum(np.hypot(rows - 20, columns - 20), np.hypot(rows - 3, columns - 35)) * 0.05
    expected = np.vectorize(lambda d: cost_at_distance(d, 0.17, PARAMETERS))(np.round(nearest, 9))
    assert np.array_equal(costmap.master, expected)


def test_unknown_cells_stay_unknown_unless_an_obstacle_is_too_near() -> None:
    cells = np.full((30, 30), -1, np.int8)
    cells[15, 15] = 100
    costmap = Costmap(PARAMETERS, OccupancyGrid(0.05, Pose2(), cells))
    assert [int(costmap.master[15, 15 + k]) for k in (0, 1, 3, 4, 8)] == [254, 253, 253, 255, 255]
    grid = costmap.to_grid()
    assert [int(grid.cells[15, 15 + k]) for k in (0, 1, 4)] == [100, 99, -1]
    free = Costmap(CostmapParameters(track_unknown_space=False), OccupancyGrid(0.05, Pose2(), cells))
    assert [int(free.master[15, 15 + k]) for k in (4, 9)] == [186, 0]


def test_a_beam_marks_its_end_and_clears_its_way() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(1.0))
    assert costmap.cost_at(1.01, 0.01) == 254
    add(costmap, "scan", one_beam(2.0))
    assert costmap.cost_at(1.01, 0.01) == 0
    assert costmap.cost_at(2.01, 0.01) == 254


def test_ranges_limit_marking_and_clearing() -> None:
    costmap = Costmap(CostmapParameters(local_size=8.0))
    add(costmap, "scan", one_beam(2.45))
    add(costmap, "scan", one_beam(2.55))
    # The second end is beyond obstacle_range: it clears, but does not mark.
    assert costmap.cost_at(2.46, 0.01) == 0
    assert costmap.cost_at(2.56, 0.01) == 0


def test_each_sensor_may_have_its_own_ranges_and_only_mark_or_only_clear() -> None:
    own = CostmapParameters(
        scan=SourceParameters(marking=False),
        depth=SourceParameters(clearing=False),
        low=SourceParameters(obstacle_range=1.5, raytrace_range=1.2),
    )
    costmap = Costmap(own)
    add(costmap, "scan", one_beam(1.0))
    assert costmap.cost_at(1.01, 0.01) == 0
    add(costmap, "depth", one_beam(1.0))
    add(costmap, "depth", one_beam(2.0))
    assert costmap.cost_at(1.01, 0.01) == 254
    costmap.reset_outside(0.0, 0.0, 0.0)
    add(costmap, "low", one_beam(1.65))
    assert costmap.cost_at(1.66, 0.01) == 0
    add(costmap, "low", one_beam(1.45))
    add(costmap, "low", one_beam(5.0))
    assert costmap.cost_at(1.46, 0.01) == 254
    with pytest.raises(ConfigError, match="obstacle_range"):
        SourceParameters(obstacle_range=-1.0)


@pytest.mark.parametrize("useless", [math.nan, math.inf, 5.6, 0.01])
def test_invalid_beams_neither_mark_nor_clear(useless: float) -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(1.0))
    add(costmap, "scan", one_beam(useless))
    assert costmap.cost_at(1.01, 0.01) == 254


def test_a_far_beam_clears() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(1.0))
    add(costmap, "scan", one_beam(5.5999))
    assert costmap.cost_at(1.01, 0.01) == 0


def test_what_one_sensor_marked_is_cleared_by_that_sensor_only() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "depth", one_beam(1.0))
    add(costmap, "scan", one_beam(5.5999))
    assert costmap.cost_at(1.01, 0.01) == 254
    add(costmap, "depth", one_beam(3.0))
    assert costmap.cost_at(1.01, 0.01) == 0


def test_a_sensor_does_not_clear_nearer_than_it_sees() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "depth", one_beam(0.9))
    add(costmap, "depth", one_beam(0.47))
    far = one_beam(3.0, range_min=0.6)
    add(costmap, "depth", far)
    assert costmap.cost_at(0.46, 0.01) == 254
    assert costmap.cost_at(0.91, 0.01) == 0


def test_what_lies_under_the_robot_is_free() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(0.1))
    assert costmap.cost_at(0.11, 0.01) == 0


def test_an_upside_down_sensor_sees_the_other_side() -> None:
    costmap = Costmap(PARAMETERS)
    mount = Transform3.from_xyz_rpy((0.0, 0.0, 0.1), (math.pi, 0.0, 0.0))
    costmap.add_rays("scan", rays_of(one_beam(1.0, angle=math.pi / 2), mount), Pose2())
    assert costmap.cost_at(0.01, -0.99) == 254
    assert costmap.cost_at(0.01, 1.01) == 0


def test_rolling_keeps_places() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(1.0))
    costmap.roll_to(Pose2(0.7, -0.4, 0.0))
    assert costmap.cost_at(1.01, 0.01) == 254
    assert costmap.cell_of(0.7, -0.4) == (50, 50)
    costmap.roll_to(Pose2(9.0, 0.0, 0.0))
    costmap.roll_to(Pose2())
    assert costmap.cost_at(1.01, 0.01) == 0  # it had left the window


def test_reset_keeps_a_window() -> None:
    costmap = Costmap(PARAMETERS)
    add(costmap, "scan", one_beam(1.0))
    add(costmap, "scan", one_beam(2.0, angle=math.pi / 2))
    costmap.reset_outside(0.0, 0.0, 3.0)
    assert costmap.cost_at(1.01, 0.01) == 254
    assert costmap.cost_at(0.01, 2.01) == 0
    costmap.reset_outside(0.0, 0.0, 0.0)
    assert costmap.cost_at(1.01, 0.01) == 0


def test_what_was_touched_is_forgotten_only_with_everything() -> None:
    costmap = Costmap(PARAMETERS)
    costmap.add_contact(Pose2(1.8, 0.01), 0.0)
    costmap.reset_outside(0.0, 0.0, 3.0)
    assert costmap.cost_at(2.01, 0.01) == 254
    costmap.reset_outside(0.0, 0.0, 0.0)
    assert costmap.cost_at(2.01, 0.01) == 0


def test_footprint_cost() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[30, 40] = 100
    costmap = Costmap(PARAMETERS, OccupancyGrid(0.05, Pose2(), cells))
    wall_x, y = 2.0, 1.525
    assert costmap.footprint_cost(Pose2(wall_x - 0.24, y, 0.0)) == -1
    assert costmap.footprint_cost(Pose2(wall_x - 0.28, y, 0.0)) == 253
    assert costmap.footprint_cost(Pose2(wall_x - 0.24, y, math.pi)) == 253
    assert costmap.footprint_cost(Pose2(0.6, 0.6, 0.5)) == 0
    assert costmap.footprint_cost(Pose2(0.1, 0.6, 0.0)) == -1


def test_outside_is_unknown() -> None:
    costmap = Costmap(PARAMETERS, OccupancyGrid(0.05, Pose2(), np.zeros((10, 10), np.int8)))
    assert costmap.cost_at(-0.1, 0.2) == 255
    assert costmap.cost_at(0.2, 0.2) == 0


def test_costs_at_points_are_those_of_their_cells_and_unknown_outside() -> None:
    costmap = Costmap(CostmapParameters(), OccupancyGrid(0.5, Pose2(-1.0, 2.0), np.zeros((3, 4), np.int8)))
    other = np.arange(12, dtype=np.uint8).reshape(3, 4)
    points = np.array([[-1.0, 2.0], [0.99, 3.49], [1.0, 2.0], [-1.01, 2.0], [0.0, 3.5], [math.nan, 2.0]])
    assert costmap.costs_at(points, other).tolist() == [0, 11, 255, 255, 255, 255]
    assert costmap.costs_at(points[:0]).shape == (0,)
    for x, y in points[:-1]:
        assert costmap.costs_at(np.array([[x, y]])).tolist() == [costmap.cost_at(x, y)]
