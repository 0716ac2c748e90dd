"""The global planner: potentials, paths and the codes of what cannot be planned."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED
from florence_bt.skills.navigation.navigate._wave_kernels import NEUTRAL, OBSTACLE, UNVISITED, spread_wave
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.planner import Plan, PlannerParameters, plan_path, ways_from
from tests.sweeps import examples
from tests.unit.skills.navigation_world import make_map

PARAMETERS = PlannerParameters()


def costmap() -> Costmap:
    return Costmap(CostmapParameters(), make_map())


def planned(start: Pose2, goal: Pose2, **options: float) -> Plan:
    plan = plan_path(costmap(), start, goal, PARAMETERS, **options)
    assert isinstance(plan, Plan), plan
    return plan


def test_potentials_on_open_ground_are_nearly_round() -> None:
    side = 63
    costs = np.full((side, side), NEUTRAL, np.uint8)
    costs[[0, -1], :] = costs[:, [0, -1]] = OBSTACLE
    middle = side // 2
    start = np.array([middle * side + middle])
    potential = spread_wave(costs.ravel(), side, start, -1, 100.0).reshape(side, side) / NEUTRAL
    assert potential[middle, middle + 20] == pytest.approx(20.0)
    assert potential[middle + 20, middle + 20] == pytest.approx(20 * math.sqrt(2), rel=0.06)
    assert np.all(potential[[0, -1], :] >= UNVISITED / NEUTRAL)
    assert np.allclose(potential, potential[::-1, ::-1])


def test_ways_lead_round_walls_in_metres_and_not_off_the_map_or_behind_a_closed_one() -> None:
    floor = np.ones((20, 40), bool)
    floor[:15, 10] = floor[:, 30] = False
    ways = ways_from((0, 0), floor, 0.05)
    assert ways[0, 8] == pytest.approx(0.4)
    assert 1.5 < ways[0, 20] < 2.0, "round the end of the wall, instead of 1 m through it"
    assert np.isinf(ways[:, 30:]).all()
    assert np.isinf(ways[~floor]).all()


def test_the_path_goes_through_the_middle_of_the_door() -> None:
    plan = planned(Pose2(1.0, 1.0), Pose2(7.0, 1.0, 2.0))
    in_door = plan.points[(plan.points[:, 0] > 3.95) & (plan.points[:, 0] < 4.15)]
    assert len(in_door) > 2
    assert np.all(np.abs(in_door[:, 1] - 2.4) < 0.1)
    assert plan.points[0].tolist() == [1.0, 1.0]
    assert plan.points[-1].tolist() == [7.0, 1.0]
    assert plan.goal == Pose2(7.0, 1.0, 2.0)
    shortest = math.hypot(3.0, 1.4) * 2
    assert shortest < plan.length < 1.1 * shortest


@pytest.mark.parametrize("part", [0.02, 0.15])
def test_a_search_directed_to_the_goal_finds_a_way_as_short(part: float) -> None:
    random = np.random.default_rng(5)
    cells = np.where(random.random((160, 120)) < 0.1 * part, 100, 0).astype(np.int8)
    ground = Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))
    free = np.argwhere(ground.master < INSCRIBED)
    found = 0
    for _ in range(40):
        (v, u), (y, x) = free[random.integers(len(free), size=2)]
        ends = Pose2((u + 0.5) * 0.05, (v + 0.5) * 0.05), Pose2((x + 0.5) * 0.05, (y + 0.5) * 0.05)
        plans = [plan_path(ground, *ends, PlannerParameters(use_astar=params)) for params in (True, False)]
        if isinstance(plans[1], Plan):
            assert isinstance(plans[0], Plan)
            assert plans[0].length < 1.02 * plans[1].length + 0.03
            directed, other = ((ground.costs_at(plan.points) < INSCRIBED).all() for plan in plans)
            assert directed or not other
            found += 1
        else:
            assert plans[0] == plans[1]
    assert found > 20


@pytest.mark.parametrize("seed", range(3))
def test_from_where_the_robot_stands_well_no_path_cuts_a_corner(seed: int) -> None:
    place = costmap()
    rng = np.random.default_rng(seed)
    free = np.argwhere(place.master < 253)
    for _ in range(60):
        ends = free[rng.integers(len(free), size=2)] + 0.5
        start, goal = (Pose2(u * 0.05 - 0.5, v * 0.05 - 0.5) for v, u in ends)
        plan = plan_path(place, start, goal, PARAMETERS)
        assert isinstance(plan, Plan)
        for part in np.linspace(0.0, 1.0, 4):
            points = plan.points[:-1] + part * np.diff(plan.points, axis=0)
            assert max((place.cost_at(x, y) for x, y in points), default=0) < 253


def test_a_robot_in_a_corner_without_another_way_may_cross_what_is_too_near() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[20:40, 30] = 100
    cells[[20, 40], 20:31] = 100
    cells[20:41, 20] = 100
    cells[30, 30] = cells[29, 30] = cells[31, 30] = cells[28, 30] = cells[32, 30] = 0
    narrow = Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))
    ways = [
        plan_path(narrow, Pose2(1.27, 1.52), Pose2(2.7, 1.5), PlannerParameters(start_clearance=clearance))
        for clearance in (0.0, 0.35)
    ]
    assert [type(way) for way in ways] == [Result, Plan]


def test_no_point_of_a_path_is_too_near_to_an_obstacle() -> None:
    place, plan = costmap(), planned(Pose2(0.5, 4.0), Pose2(7.5, 0.5))
    assert max(place.cost_at(x, y) for x, y in plan.points) < 253
    assert np.hypot(*np.diff(plan.points, axis=0).T).max() < 0.1


@pytest.mark.parametrize(
    ("goal", "code"),
    [
        (Pose2(40.0, 1.0), "goal_outside"),
        (Pose2(4.05, 1.0), "goal_occupied"),
        (Pose2(3.9, 1.0), "goal_occupied"),
        (Pose2(8.4, 2.0), "no_path"),
        (Pose2(math.nan, 1.0), "bad_input"),
    ],
)
def test_what_cannot_be_planned(goal: Pose2, code: str) -> None:
    result = plan_path(costmap(), Pose2(1.0, 1.0), goal, PARAMETERS)
    assert isinstance(result, Result)
    assert result.code == code
    assert result.reason


def test_a_robot_outside_of_the_map() -> None:
    result = plan_path(costmap(), Pose2(-9.0, 1.0), Pose2(1.0, 1.0), PARAMETERS)
    assert isinstance(result, Result)
    assert result.code == "start_outside"


def test_a_tolerance_finds_the_nearest_free_place() -> None:
    plan = planned(Pose2(1.0, 1.0), Pose2(4.05, 1.0, 0.7), tolerance=0.5)
    assert plan.goal.x == pytest.approx(3.825)
    assert abs(plan.goal.y - 1.0) < 0.05
    assert plan.goal.yaw == 0.7
    result = plan_path(costmap(), Pose2(1.0, 1.0), Pose2(4.05, 1.0), PARAMETERS, tolerance=0.1)
    assert isinstance(result, Result)
    assert result.code == "goal_occupied"


def test_a_robot_too_near_to_a_wall_can_leave() -> None:
    plan = planned(Pose2(0.12, 2.0), Pose2(2.0, 2.0))
    assert plan.length == pytest.approx(1.9, abs=0.2)


def test_unknown_ground_may_be_forbidden() -> None:
    cells = np.zeros((40, 60), np.int8)
    cells[:, 28:32] = -1
    place = Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))
    start, goal = Pose2(0.5, 1.0), Pose2(2.5, 1.0)
    assert isinstance(plan_path(place, start, goal, PARAMETERS), Plan)
    refused = plan_path(place, start, goal, PlannerParameters(allow_unknown=False))
    assert isinstance(refused, Result)
    assert refused.code == "no_path"


def test_start_and_goal_in_the_same_cell() -> None:
    plan = planned(Pose2(1.01, 1.01), Pose2(1.02, 1.03))
    assert plan.points.tolist() == [[1.01, 1.01], [1.02, 1.03]]


@settings(max_examples=examples(25))
@given(seed=st.integers(0, 10_000))
def test_paths_over_random_costs_arrive_and_never_cross_walls(seed: int) -> None:
    random = np.random.default_rng(seed)
    cells = (random.random((40, 40)) < 0.03).astype(np.int8) * 100
    place = Costmap(CostmapParameters(), OccupancyGrid(0.05, Pose2(), cells))
    free = np.argwhere(place.master < 253)
    (r0, c0), (r1, c1) = free[random.integers(len(free), size=2)]
    start, goal = Pose2((c0 + 0.5) * 0.05, (r0 + 0.5) * 0.05), Pose2((c1 + 0.5) * 0.05, (r1 + 0.5) * 0.05)
    plan = plan_path(place, start, goal, PlannerParameters(start_clearance=0.0))
    rooms, _ = label(place.master < 253)  # the wave spreads to four neighbours
    if rooms[r0, c0] != rooms[r1, c1]:
        assert isinstance(plan, Result) and plan.code == "no_path"
        return
    assert max(place.cost_at(x, y) for x, y in plan.points) < 254
    assert plan.length >= start.distance_to(goal) - 1e-9


def test_as_short_as_the_shortest_path_over_neighbouring_cells() -> None:
    place = costmap()
    costs = np.minimum(50 + 3.0 * place.master, 253)
    cells = np.arange(costs.size).reshape(costs.shape)
    free = place.master < 253
    steps = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        one = np.s_[: costs.shape[0] - down, max(0, -right) : costs.shape[1] - max(0, right)]
        other = np.s_[down:, max(0, right) : costs.shape[1] + min(0, right)]
        # A step costs the mean of its two cells for each metre.
        step = 0.05 * math.hypot(down, right) * (costs[one] + costs[other]) / 2
        open_ = free[one] & free[other]
        steps.append((cells[one][open_], cells[other][open_], step[open_]))
    begins, ends, weights = (np.concatenate(parts) for parts in zip(*steps, strict=True))
    graph = coo_array((weights, (begins, ends)), shape=(costs.size, costs.size)).tocsr()
    start, goal = (int(cells[place.cell_of(x, 1.0)]) for x in (1.0, 7.0))
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    way = [goal]
    while way[-1] != start:
        way.append(before[way[-1]])
    length = np.hypot(*np.diff(np.array(np.unravel_index(way, costs.shape)), axis=1)).sum() * 0.05
    assert planned(Pose2(1.0, 1.0), Pose2(7.0, 1.0)).length < 1.03 * length


@pytest.mark.parametrize("name", ["neutral_cost", "cost_factor", "start_clearance"])
def test_bad_parameters(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        PlannerParameters(**{name: -1})  # type: ignore[arg-type]
