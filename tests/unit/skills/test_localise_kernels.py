"""The compiled loops of the localisation, each against its definition written out in NumPy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.localisation._kernels import (
    best_pose,
    contradicted_part,
    draw_distances,
    match_terms,
    resample_systematic,
    score_blocks,
    scores_around,
)
from florence_bt.skills.navigation.localisation.likelihood_field import build_likelihood_field
from florence_bt.skills.navigation.localisation.pose_search import PoseSearch
from florence_bt.skills.navigation.localisation.scan_match import Match, match_scan

FRAME = (-1.0, 2.0, 0.05)
SHAPE = (40, 60)


def placed(points: NDArray[np.float64], pose: tuple[float, float, float]) -> NDArray[np.float64]:
    """Points of the base's frame in that of the grid."""
    at = Pose2(*pose)
    return np.array([at.apply(x, y) for x, y in points]).reshape(-1, 2)


def cells_of(points: NDArray[np.float64]) -> list[tuple[int, int] | None]:
    """Row and column of each point, None outside of the grid."""
    found = []
    for x, y in points:
        row, column = math.floor((y - FRAME[1]) / FRAME[2]), math.floor((x - FRAME[0]) / FRAME[2])
        inside = 0 <= row < SHAPE[0] and 0 <= column < SHAPE[1]
        found.append((row, column) if inside else None)
    return found


def scattered(seed: int, count: int = 40) -> NDArray[np.float64]:
    """Points around the robot, some of them off the grid."""
    return np.random.default_rng(seed).uniform(-2.0, 2.5, (count, 2))


# ---- scores of poses in whole cells --------------------------------------------------------------------


def test_blocks_are_scored_by_the_mean_over_the_beams() -> None:
    random = np.random.default_rng(1)
    table = random.integers(0, 256, (12, 15)).astype(np.uint8)
    beams = random.integers(-6, 7, (3, 9, 2)).astype(np.int32)
    blocks = np.array(list(itertools.product(range(12), range(15), range(3))), np.int32)
    wanted = []
    for row, column, heading in blocks.tolist():
        ends = beams[heading] + (row, column)
        inside = [(v, u) for v, u in ends.tolist() if 0 <= v < 12 and 0 <= u < 15]
        wanted.append(sum(int(table[cell]) for cell in inside) / (255.0 * 9))
    exact = np.array(wanted, np.float32)
    assert score_blocks(blocks, beams, table, 0.0) == pytest.approx(exact)
    for least in (0.2, 0.35, 0.5):
        scores = score_blocks(blocks, beams, table, least)
        assert scores == pytest.approx(np.where(exact >= np.float32(least), exact, 0.0))
        assert 0 < np.count_nonzero(scores) < len(blocks)


def test_a_score_of_exactly_the_least_counts() -> None:
    beams, blocks = np.zeros((1, 4, 2), np.int32), np.zeros((1, 3), np.int32)
    table = np.full((1, 1), 51, np.uint8)
    assert score_blocks(blocks, beams, table, 0.2)[0] == pytest.approx(0.2)
    assert score_blocks(blocks, beams, table, 0.2001)[0] == 0.0


# ---- beams that went through walls ---------------------------------------------------------------------


def wall_field() -> NDArray[np.float32]:
    """Distances around a wall from column 20 to 21 in the lower half of the grid."""
    cells = np.zeros(SHAPE, np.int8)
    cells[:20, 20:22] = 100
    return build_likelihood_field(OccupancyGrid(FRAME[2], Pose2(*FRAME[:2]), cells), 2.0).signed


@pytest.mark.parametrize(
    ("end", "through"),
    [
        ((0.90, 0.0), True),
        ((0.80, 0.0), False),
        ((0.58, 0.0), False),
        ((0.50, 0.0), False),
        ((0.30, 0.0), False),
        ((0.90, 0.9), False),
        ((2.9, 0.0), True),
        ((-0.4, 0.0), False),
        ((-9.0, 0.0), False),
        ((9.0, 0.0), True),
    ],
)
def test_a_beam_that_ends_far_behind_a_wall_went_through_it(end: tuple[float, float], through: bool) -> None:
    """The robot stands 0.5 m before a wall of 0.1 m; a beam is through from 0.3 m behind its face on."""
    field = wall_field()
    for yaw in (0.0, 1.0, -2.5):
        points = np.array([Pose2(0.0, 0.0, -yaw).apply(*end)])
        part = contradicted_part((-0.5, 2.5, yaw), points, field, FRAME, 0.15, 0.3)
        assert part == (1.0 if through else 0.0)


def test_the_part_of_a_scan_is_told_and_without_beams_it_is_none() -> None:
    points = np.array([[0.9, 0.0], [0.3, 0.0], [0.5, 0.0], [2.0, 0.1]])
    assert contradicted_part((-0.5, 2.5, 0.0), points, wall_field(), FRAME, 0.15, 0.3) == 0.5
    assert contradicted_part((-0.5, 2.5, 0.0), np.empty((0, 2)), wall_field(), FRAME, 0.15, 0.3) == 0.0


# ---- the fit -------------------------------------------------------------------------------------------


def smooth_field() -> NDArray[np.float32]:
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return (0.3 * np.sin(u / 7.0) + 0.2 * np.cos(v / 5.0) + 0.01 * u).astype(np.float32)


def distances_at(pose: tuple[float, float, float], points: NDArray[np.float64]) -> list[float]:
    """The distances of the beam ends that lie in the grid, interpolated between the cells' centres."""
    field, found = smooth_field().astype(float), []
    for x, y in placed(points, pose):
        u, v = (x - FRAME[0]) / FRAME[2] - 0.5, (y - FRAME[1]) / FRAME[2] - 0.5
        column, row = math.floor(u), math.floor(v)
        if not (0 <= row < SHAPE[0] - 1 and 0 <= column < SHAPE[1] - 1):
            continue
        fu, fv = u - column, v - row
        corners = field[row : row + 2, column : column + 2]
        found.append(float(np.array([1.0 - fv, fv]) @ corners @ np.array([1.0 - fu, fu])))
    return found


def cost(pose: tuple[float, float, float], points: NDArray[np.float64], scale: float) -> float:
    """Geman-McClure's cost, but for a constant."""
    return -sum(scale**2 / (1.0 + (away / scale) ** 2) for away in distances_at(pose, points))


@pytest.mark.parametrize("seed", range(4))
def test_the_vector_of_a_fit_is_the_slope_of_its_cost(seed: int) -> None:
    points, pose, scale, step = scattered(seed), (0.2, 2.9, 0.4), 0.2, 1e-6
    normals = np.zeros((*SHAPE, 2), np.float32)
    matrix, vector, fit, near = match_terms(pose, points, smooth_field(), normals, FRAME, scale)
    for axis in range(3):
        ahead, behind = list(pose), list(pose)
        ahead[axis] += step
        behind[axis] -= step
        slope = (cost(tuple(ahead), points, scale) - cost(tuple(behind), points, scale)) / (2.0 * step)  # type: ignore[arg-type]
        assert 2.0 * vector[axis] == pytest.approx(slope, abs=2e-3)
    assert -(scale**2) * fit == pytest.approx(cost(pose, points, scale), abs=1e-6)
    assert np.allclose(matrix, matrix.T)
    assert (np.linalg.eigvalsh(matrix) >= -1e-9).all()
    away = distances_at(pose, points)
    assert near == sum(abs(distance) < scale for distance in away) < len(away) < len(points)


def test_how_many_beams_lie_near_a_surface() -> None:
    field = np.full(SHAPE, 0.5, np.float32)
    field[:, :30] = -0.1
    normals = np.zeros((*SHAPE, 2), np.float32)
    points = np.array([[-0.6, 0.0], [0.1, 0.2], [1.5, 0.0], [30.0, 0.0]])
    for scale, near in ((0.11, 2), (0.1, 0), (0.6, 3)):
        assert match_terms((-0.0, 3.0, 0.0), points, field, normals, FRAME, scale)[3] == near


# ---- the search around a pose --------------------------------------------------------------------------


def fit_of(points: NDArray[np.float64], pose: tuple[float, float, float], near: float) -> float:
    field = smooth_field()
    parts = [
        max(0.0, 1.0 - abs(float(field[cell])) / near) if cell is not None else 0.0
        for cell in cells_of(placed(points, pose))
    ]
    return sum(parts) / len(parts)


def test_places_around_a_pose_are_scored_by_how_many_beams_end_near_a_surface() -> None:
    points, centre = scattered(5), (0.3, 3.0, -0.7)
    scores = scores_around(smooth_field(), points, centre, FRAME, 0.1, 3, 0.3)
    assert scores.shape == (7, 7)
    for i, j in itertools.product(range(7), range(7)):
        there = centre[0] + (j - 3) * 0.1, centre[1] + (i - 3) * 0.1, centre[2]
        # A beam that ends on the border of two cells may be counted in either.
        assert scores[i, j] == pytest.approx(fit_of(points, there, 0.3), abs=0.03)
    assert scores.std() > 0.01


@pytest.mark.parametrize(("cost_d", "cost_a"), [(0.0, 0.0), (0.8, 0.0), (0.0, 5.0), (0.5, 0.5)])
def test_the_best_pose_around_another_one_is_found(cost_d: float, cost_a: float) -> None:
    points, centre = scattered(6), (0.3, 3.0, -0.7)
    found = best_pose(smooth_field(), points, centre, FRAME, 0.1, 4, 0.1, 3, 0.3, cost_d, cost_a)

    def score(i: int, j: int, h: int) -> float:
        away = cost_d * 0.01 * (i * i + j * j) + cost_a * (0.1 * h) ** 2
        return fit_of(points, (0.3 + 0.1 * j, 3.0 + 0.1 * i, -0.7 + 0.1 * h), 0.3) - away

    steps = [place for place in itertools.product(range(-4, 5), repeat=2) if math.hypot(*place) <= 4]
    best = max(score(i, j, h) for i, j in steps for h in range(-3, 4))
    j, i, h = round((found[0] - 0.3) / 0.1), round((found[1] - 3.0) / 0.1), round((found[2] + 0.7) / 0.1)
    assert (i, j) in steps and abs(h) <= 3
    assert score(i, j, h) >= best - 0.03
    assert found == pytest.approx((0.3 + 0.1 * j, 3.0 + 0.1 * i, -0.7 + 0.1 * h))


# ---- drawing -------------------------------------------------------------------------------------------


def drawn(points: NDArray[np.float64], pose: tuple[float, float, float], gap: float) -> NDArray[np.float32]:
    distances = np.full(SHAPE, 0.4, np.float32)
    draw_distances(distances, points, pose, FRAME, 0.2, gap)
    return distances


def test_around_a_beams_end_the_distances_to_it_are_drawn() -> None:
    distances = drawn(np.array([[0.31, 0.14]]), (0.2, 2.8, 0.5), 0.0)
    ((x, y),) = placed(np.array([[0.31, 0.14]]), (0.2, 2.8, 0.5))
    touched = np.argwhere(distances < 0.4)
    row, column = (
        round((y - FRAME[1]) / FRAME[2] - 0.5),
        round((x - FRAME[0]) / FRAME[2] - 0.5),
    )
    assert touched.min(axis=0).tolist() == [row - 4, column - 4]
    assert touched.max(axis=0).tolist() == [row + 4, column + 4]
    assert len(touched) == 81
    for v, u in touched:
        away = math.hypot(FRAME[0] + (u + 0.5) * 0.05 - x, FRAME[1] + (v + 0.5) * 0.05 - y)
        assert distances[v, u] == pytest.approx(away, abs=1e-5)


def test_beams_that_end_near_each_other_have_met_one_surface() -> None:
    ends = np.array([[0.0, 0.3], [0.4, 0.3]])
    middle = 1 + round((2.3 - FRAME[1]) / FRAME[2] - 0.5), round((0.2 - FRAME[0]) / FRAME[2] - 0.5)
    apart, joined = drawn(ends, (0.0, 2.05, 0.0), 0.39), drawn(ends, (0.0, 2.05, 0.0), 0.41)
    assert apart[middle] > 0.15
    assert joined[middle] < 0.04
    assert drawn(ends[:1], (0.0, 2.05, 0.0), 0.41)[middle] > 0.15


def test_what_was_nearer_stays_and_the_border_is_left_alone() -> None:
    distances = np.full(SHAPE, 0.01, np.float32)
    draw_distances(distances, np.array([[0.3, 0.1]]), (0.2, 2.8, 0.0), FRAME, 0.2, 0.0)
    assert distances.min() == pytest.approx(0.01, abs=0.01)
    assert (distances <= np.float32(0.01)).all()
    for x, y, touches in ((-0.79, 3.0, True), (-0.84, 3.0, False), (1.79, 3.0, True), (1.84, 3.0, False)):
        assert bool((drawn(np.zeros((1, 2)), (x, y, 0.0), 0.0) < 0.4).any()) is touches
    for x, y, touches in ((0.0, 2.21, True), (0.0, 2.16, False), (0.0, 3.79, True), (0.0, 3.84, False)):
        assert bool((drawn(np.zeros((1, 2)), (x, y, 0.0), 0.0) < 0.4).any()) is touches


@pytest.mark.parametrize("offset", [0.01, 0.3, 0.99])
def test_particles_are_drawn_at_even_steps_through_their_weights(offset: float) -> None:
    weights = np.array([0.1, 0.0, 0.35, 0.05, 0.5])
    found = resample_systematic(weights, offset, 20)
    reached = np.cumsum(weights)
    assert found.tolist() == [int(np.argmax(reached >= (k + offset) / 20 - 1e-12)) for k in range(20)]


# ---- the search everywhere -----------------------------------------------------------------------------


def two_rooms() -> OccupancyGrid:
    """Two rooms of 2 m by 3 m, which a niche in one of them distinguishes."""
    cells = np.zeros((64, 84), np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = cells[:, 41:43] = 100
    cells[20:30, 2:10] = 100
    cells[50:62, 70:76] = 100
    return OccupancyGrid(0.05, Pose2(-0.1, -0.1), cells)


def seen_from(grid: OccupancyGrid, pose: Pose2) -> NDArray[np.float64]:
    """The ends of 180 beams in the base frame, by steps of a centimetre."""
    points = []
    for angle in np.linspace(-math.pi, math.pi, 180, endpoint=False):
        far = 0.0
        while not grid.is_occupied(*pose.apply(far * math.cos(angle), far * math.sin(angle))):
            far += 0.01
        points.append((far * math.cos(angle), far * math.sin(angle)))
    return np.array(points)


@pytest.mark.parametrize("truth", [Pose2(0.6, 0.5, 0.3), Pose2(3.0, 2.2, -2.2), Pose2(1.2, 2.4, 3.1)])
def test_of_all_places_the_right_one_comes_first(truth: Pose2) -> None:
    grid = two_rooms()
    field = build_likelihood_field(grid, 2.0)

    def fit(points: NDArray[np.float64], pose: Pose2) -> Match:
        return match_scan(field, points, pose, np.eye(3) * 0.01, sigma=0.05, independent_beams=60.0)

    search = PoseSearch(field, grid, fit)
    found = search.everywhere(seen_from(grid, truth))
    assert found[0].pose.distance_to(truth) < 0.05
    assert abs(math.remainder(found[0].pose.yaw - truth.yaw, math.tau)) < 0.05
    fractions = [match.near_fraction for match in found]
    assert fractions == sorted(fractions, reverse=True)
    for one, other in itertools.combinations(found, 2):
        turned = abs(math.remainder(one.pose.yaw - other.pose.yaw, math.tau))
        assert one.pose.distance_to(other.pose) > 0.5 or turned > math.radians(30.0)
    around = search.around(seen_from(grid, truth), truth @ Pose2(0.3, -0.2, 0.2), 0.6, 0.4)
    assert around is not None and around.pose.distance_to(truth) < 0.05
    assert search.around(seen_from(grid, truth), Pose2(9.0, 9.0), 0.3, 0.2) is None, "no robot is off the map"
    assert search.contradicted_part(seen_from(grid, truth), truth) == 0.0
