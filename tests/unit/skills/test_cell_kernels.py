"""The compiled loops over costmap cells, each against its definition written out in NumPy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.skills.navigation.navigate import _cell_kernels as kernels
from florence_bt.skills.navigation.navigate._cell_kernels import CLEARABLE, INSCRIBED, LETHAL, UNKNOWN_COST

SIDE = 30


def marked() -> NDArray[np.uint8]:
    return np.full((SIDE, SIDE), LETHAL, np.uint8)


def crossed(
    origin: tuple[float, float], end: tuple[float, float], far: float
) -> dict[tuple[int, int], float]:
    """The cells (row, column) that a ray crosses up to a length, with how far along their middles are."""
    (ou, ov), (eu, ev) = origin, end
    length = math.hypot(eu - ou, ev - ov)
    found: dict[tuple[int, int], list[float]] = {}
    for way in np.linspace(0.0, min(length, far), 20_000):
        u, v = ou + way / length * (eu - ou), ov + way / length * (ev - ov)
        found.setdefault((math.floor(v), math.floor(u)), []).append(float(way))
    return {cell: (ways[0] + ways[-1]) / 2.0 for cell, ways in found.items()}


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("hit", [True, False])
def test_a_ray_clears_what_it_crosses_but_the_cell_of_its_hit(seed: int, hit: bool) -> None:
    random = np.random.default_rng(seed)
    origin, end = random.uniform(2.0, 28.0, 2), random.uniform(-5.0, 35.0, 2)
    marks = marked()
    kernels.clear_rays(marks, *origin, np.array([end]), np.array([hit]), 0.0, 100.0)
    cells = crossed(tuple(origin), tuple(end), 100.0)
    if hit:
        cells.pop((math.floor(end[1]), math.floor(end[0])), None)
    wanted = marked()
    for row, column in cells:
        if 0 <= row < SIDE and 0 <= column < SIDE:
            wanted[row, column] = 0
    # Where a ray just touches a corner, the samples may miss the cell.
    assert np.count_nonzero(marks != wanted) <= 1


@pytest.mark.parametrize("end", [(25.5, 10.5), (0.5, 10.5), (10.5, 25.5), (10.5, 0.5)])
def test_a_ray_along_an_axis_clears_one_row(end: tuple[float, float]) -> None:
    marks = marked()
    kernels.clear_rays(marks, 10.5, 10.5, np.array([end]), np.array([True]), 0.0, 100.0)
    steps = int(max(abs(end[0] - 10.5), abs(end[1] - 10.5)))
    assert np.count_nonzero(marks == 0) == steps
    assert marks[int(end[1]), int(end[0])] == LETHAL
    assert marks[10, 10] == 0


def test_a_ray_clears_from_where_its_sensor_sees_to_where_it_is_cut() -> None:
    for start, longest, cleared in (
        (0.0, 6.4, range(10, 17)),
        (0.0, 6.6, range(10, 18)),
        (3.0, 6.4, range(13, 17)),
        (3.1, 6.4, range(14, 17)),
        (2.9, 6.4, range(13, 17)),
    ):
        marks = marked()
        kernels.clear_rays(marks, 10.5, 5.5, np.array([[25.5, 5.5]]), np.array([False]), start, longest)
        assert np.flatnonzero(marks[5] == 0).tolist() == list(cleared), (start, longest)
    marks = marked()
    kernels.clear_rays(marks, 10.5, 5.5, np.array([[10.5, 5.5]]), np.array([False]), 0.0, 9.0)
    assert (marks == LETHAL).all(), "a ray without a length has no direction"


@pytest.mark.parametrize("seed", range(6))
def test_a_polygon_frees_the_cells_whose_middles_it_holds(seed: int) -> None:
    random = np.random.default_rng(seed)
    turn, middle = random.uniform(0.0, math.tau), random.uniform(0.0, 30.0, 2)
    square = np.array([(4.0, -3.0), (5.0, 1.0), (-2.0, 4.0), (-4.0, -3.0)])
    c, s = math.cos(turn), math.sin(turn)
    corners = square @ np.array([[c, s], [-s, c]]) + middle
    for given in (corners, corners[::-1].copy()):
        marks = marked()
        kernels.clear_polygon(marks, given)
        for v, u in itertools.product(range(SIDE), repeat=2):
            point = np.array([u + 0.5, v + 0.5])
            edges = np.roll(corners, -1, axis=0) - corners
            sides = edges[:, 0] * (point[1] - corners[:, 1]) - edges[:, 1] * (point[0] - corners[:, 0])
            if np.abs(sides).min() > 1e-9:
                assert bool(marks[v, u] == 0) is bool((sides > 0).all() or (sides < 0).all())


def test_points_are_marked_in_the_cells_that_hold_them_if_they_are_wanted() -> None:
    marks = np.zeros((4, 5), np.uint8)
    ends = np.array([[0.0, 0.0], [4.99, 3.99], [5.0, 1.0], [1.0, 4.0], [-0.01, 1.0], [2.5, 1.5], [3.5, 1.5]])
    kernels.mark_points(marks, ends, np.array([True] * 6 + [False]))
    assert {tuple(cell) for cell in np.argwhere(marks == LETHAL).tolist()} == {(0, 0), (3, 4), (1, 2)}


def test_what_stands_above_feet_is_marked_as_such_unless_it_stood_there_before() -> None:
    ends = np.array([[2.5, 2.5], [8.5, 2.5], [5.5, 5.5]])
    feet = np.array([[2.5, 4.4], [8.5, 4.6]])
    marks = np.zeros((10, 10), np.uint8)
    marks[5, 5] = LETHAL
    kernels.mark_above(marks, ends, np.ones(3, bool), np.vstack([feet, [[5.5, 5.5]]]), 2.0)
    assert [int(marks[2, 2]), int(marks[2, 8]), int(marks[5, 5])] == [CLEARABLE, LETHAL, LETHAL]
    kernels.mark_above(marks, ends[:1], np.ones(1, bool), feet[1:], 2.0)
    assert marks[2, 2] == LETHAL, "it is there without feet now"
    kernels.mark_above(marks, ends[:1], np.ones(1, bool), feet[:1], 2.0)
    assert marks[2, 2] == LETHAL
    fresh = np.zeros((10, 10), np.uint8)
    kernels.mark_above(fresh, ends, np.array([False, True, False]), feet[:0], 2.0)
    assert np.argwhere(fresh).tolist() == [[2, 8]] and fresh[2, 8] == LETHAL


def looks(marks: NDArray[np.uint8], ends: list[tuple[float, float]], are_feet: bool, times: int = 1) -> int:
    """The mark in the cell [10, 20] after some scans of a laser at the cell [10, 5]."""
    for _ in range(times):
        kernels.forget_what_left(marks, 5.5, 10.5, np.array(ends), np.full(len(ends), are_feet), 3.0, 25.0)
    return int(marks[10, 20])


def above_feet(value: int = CLEARABLE) -> NDArray[np.uint8]:
    marks = np.zeros((SIDE, SIDE), np.uint8)
    marks[10, 20] = value
    return marks


def test_what_stood_above_feet_goes_when_the_laser_looks_through_five_times() -> None:
    through = [(29.5, 10.5)]
    marks = above_feet()
    assert [looks(marks, through, False) for _ in range(6)] == [249, 248, 247, 246, 0, 0]
    assert looks(above_feet(LETHAL), through, False, 9) == LETHAL, "what has no feet is the camera's alone"


@pytest.mark.parametrize(
    ("ends", "are_feet", "left"),
    [
        ([(20.5, 12.5)], True, CLEARABLE),  # feet near by
        ([(20.5, 13.6)], True, 246),  # those are too far aside, and no beam passes
        ([(20.5, 12.5)], False, 246),  # something of the map near by
        ([(15.5, 10.5)], False, 246),  # something hides the place
        ([(29.5, 10.5), (15.5, 10.5)], False, 246),  # of two beams one is hidden
        ([(29.5, 16.0)], False, 246),  # a beam that passes beside it
        ([(-9.5, 10.5)], False, 246),  # and one that looks away
        ([(29.5, 11.0)], False, 0),
    ],
)
def test_what_the_laser_sees_of_a_place(ends: list[tuple[float, float]], are_feet: bool, left: int) -> None:
    assert looks(above_feet(246), ends, are_feet) == left


def test_what_is_too_far_from_the_laser_is_left_as_it_is() -> None:
    for reach, left in ((14.4, 250), (16.0, 249)):
        marks = above_feet()
        kernels.forget_what_left(marks, 5.5, 10.5, np.array([[29.5, 10.5]]), np.zeros(1, bool), 3.0, reach)
        assert marks[10, 20] == left


def test_scans_are_taken_by_what_clears_and_what_marks() -> None:
    frame, sensor = (0.0, 0.0, 0.1), (0.55, 1.05)
    ends, lengths = np.array([[2.05, 1.05], [0.55, 2.05]]), np.array([1.5, 1.0])
    feet, none = np.array([[2.05, 1.15]]), np.empty((0, 2))

    def taken(cleared: tuple[float, float], below: float, near: float = 0.0) -> NDArray[np.uint8]:
        marks = np.zeros((SIDE, SIDE), np.uint8)
        marks[10, 8:12] = LETHAL
        kernels.take_rays(marks, frame, sensor, ends, lengths, cleared, below, feet if near else none, near)
        return marks

    everything = taken((0.0, 3.0), 2.0)
    assert (everything[10, 8:12] == 0).all() and everything[10, 20] == everything[20, 5] == LETHAL
    assert np.flatnonzero(taken((0.5, 3.0), 2.0)[10]).tolist() == [8, 9, 20]
    assert np.flatnonzero(taken((0.0, 0.0), 2.0)[10]).tolist() == [8, 9, 10, 11, 20]
    shorter = taken((0.0, 3.0), 1.5)
    assert (int(shorter[10, 20]), int(shorter[20, 5])) == (0, LETHAL), "marks are shorter than the limit"
    cut = taken((0.0, 1.2), 2.0)
    assert cut[10, 11] == 0 and cut[10, 20] == LETHAL
    standing = taken((0.0, 3.0), 2.0, near=0.2)
    assert (int(standing[10, 20]), int(standing[20, 5])) == (CLEARABLE, LETHAL)


@pytest.mark.parametrize("seed", range(4))
def test_costs_spread_by_the_exact_distance_to_the_nearest_obstacle(seed: int) -> None:
    random = np.random.default_rng(seed)
    radius = 5
    table = np.array([max(0, 254 - 9 * squared) for squared in range(radius**2 + 1)], np.uint8)
    master = random.choice(np.array([0, 100, UNKNOWN_COST], np.uint8), (SIDE, SIDE + 7))
    obstacles = random.integers(0, (SIDE, SIDE + 7), (6, 2))
    master[obstacles[:, 0], obstacles[:, 1]] = LETHAL
    wanted = master.copy()
    v, u = np.mgrid[: master.shape[0], : master.shape[1]]
    squared = np.min([(v - row) ** 2 + (u - column) ** 2 for row, column in obstacles], axis=0)
    near = squared <= radius**2
    spread = np.where(near, table[np.minimum(squared, radius**2)], 0)
    known = master != UNKNOWN_COST
    wanted[known] = np.maximum(master, spread)[known]
    wanted[~known & (spread >= INSCRIBED)] = spread[~known & (spread >= INSCRIBED)]
    kernels.inflate(master, radius, table)
    np.testing.assert_array_equal(master, wanted)


def test_what_a_sensor_marked_is_lethal_in_the_sum() -> None:
    master = np.array([[0, 7, UNKNOWN_COST, LETHAL]], np.uint8)
    kernels.add_marks(master, np.array([[1, 0, CLEARABLE, 0]], np.uint8))
    assert master.tolist() == [[LETHAL, 7, LETHAL, LETHAL]]


def test_the_cost_of_an_outline_is_the_greatest_below_it() -> None:
    cells = np.zeros((10, 10), np.uint8)
    cells[2, 5], cells[2, 6], cells[2, 7], cells[2, 8] = 40, INSCRIBED, LETHAL, UNKNOWN_COST
    outline = np.array([[0.1, 0.0], [-0.1, 0.0]])

    def cost(x: float, y: float, yaw: float = 0.0, unknown_blocks: bool = False) -> int:
        return int(kernels.footprint_cost(cells, 1.0, 2.0, 0.1, x, y, yaw, outline, unknown_blocks))

    assert cost(1.45, 2.25) == 40, "one end of it lies on the cost"
    assert cost(1.55, 2.25) == INSCRIBED
    assert cost(1.65, 2.25) == -1
    assert cost(1.55, 2.25, math.pi / 2) == 0, "turned, it lies beside it"
    assert cost(1.55, 2.35, math.pi / 2) == 40
    assert cost(1.95, 2.25) == cost(1.05, 2.25) == cost(1.55, 2.05, math.pi / 2) == -1, "off the map"
    cells[2, 7] = 0
    assert cost(1.75, 2.25) == INSCRIBED, "what is not known costs nothing"
    assert cost(1.75, 2.25, unknown_blocks=True) == -1, "but where it blocks"
