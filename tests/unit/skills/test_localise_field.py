"""The parts of the localisation: field, filter, fit, queue."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry
from florence_bt.skills.navigation.localisation._kernels import (
    match_terms,
    resample_systematic,
    weigh_particles,
)
from florence_bt.skills.navigation.localisation.likelihood_field import (
    LikelihoodField,
    build_likelihood_field,
)
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.particle_filter import ParticleFilter
from florence_bt.skills.navigation.localisation.scan_match import match_scan
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue


def room() -> OccupancyGrid:
    """A room of 2 x 1 m with walls of two cells."""
    cells = np.zeros((24, 44), np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = 100
    return OccupancyGrid(0.05, Pose2(-0.1, -0.1), cells)


def test_distances_are_zero_at_the_border_of_free_and_occupied() -> None:
    field = build_likelihood_field(room(), 2.0)
    # Cell 2 is the first free one: its centre is half a cell from the wall.
    assert field.signed[12, 2] == pytest.approx(0.025)
    assert field.signed[12, 1] == pytest.approx(-0.025)
    assert field.signed[12, 10] == pytest.approx(0.025 + 8 * 0.05)
    assert build_likelihood_field(room(), 0.3).signed.max() == pytest.approx(0.3)
    centres = build_likelihood_field(room(), 2.0, surface_offset=0.0)
    assert centres.signed[12, 2] == pytest.approx(0.05)


def test_a_map_without_obstacles_is_far_from_everything() -> None:
    field = build_likelihood_field(OccupancyGrid(0.05, Pose2(), np.zeros((4, 4), np.int8)), 2.0)
    assert np.all(field.signed == 2.0)


def test_weights_follow_the_formula() -> None:
    cubes = np.array([[0.0, 0.5], [0.25, 0.125]], np.float32)
    particles = np.array([[0.5, 0.5, 0.0], [0.5, 0.5, math.pi / 2]])
    points = np.array([[1.0, 0.0], [5.0, 0.0]])
    # Facing x: cell [0, 1] and off the map; facing y: cell [1, 0] and off the map.
    normals = np.zeros((2, 2, 2), np.float32)
    weights = weigh_particles(particles, points, cubes, normals, 0.01, 0.0, 0.0, 1.0)
    assert weights == pytest.approx([1.51, 1.26])
    # A cell before its end the first beam is on the back of something, and the second one on its front.
    normals[0, 0] = (1.0, -1.0)
    weights = weigh_particles(particles, points, cubes, normals, 0.01, 0.0, 0.0, 1.0)
    assert weights == pytest.approx([1.02, 1.26])


def test_resampling_draws_in_proportion() -> None:
    drawn = resample_systematic(np.array([0.5, 0.0, 0.25, 0.25]), 0.5, 8)
    assert drawn.tolist() == [0, 0, 0, 0, 2, 2, 3, 3]
    assert resample_systematic(np.array([1.0]), 0.999, 3).tolist() == [0, 0, 0]


def field_of_room() -> LikelihoodField:
    return build_likelihood_field(room(), 2.0)


def points_of(pose: Pose2) -> np.ndarray:
    """Beam ends on the walls of the room, seen from a pose, shape (n, 2)."""
    ends = [(x, y) for x in np.linspace(0.05, 1.95, 40) for y in (0.0, 1.0)]
    ends += [(x, y) for y in np.linspace(0.05, 0.95, 20) for x in (0.0, 2.0)]
    return np.array([pose.inverse().apply(*end) for end in ends])


def test_the_fit_finds_the_pose() -> None:
    field = build_likelihood_field(room(), 2.0)
    truth = Pose2(0.8, 0.45, 0.3)
    match = match_scan(
        field,
        points_of(truth),
        Pose2(0.9, 0.38, 0.2),
        np.diag([0.01, 0.01, 0.01]),
        sigma=0.05,
        independent_beams=60.0,
    )
    assert match.pose.distance_to(truth) < 0.005
    assert abs(normalize_angle(match.pose.yaw - truth.yaw)) < 0.005
    assert match.near_fraction > 0.95
    assert np.all(np.linalg.eigvalsh(match.covariance) > 0.0)


def test_a_wall_seen_from_one_side_is_not_taken_for_its_back() -> None:
    """Of two poses the right one weighs more than the one that puts the wall ahead on its other side."""
    truth = Pose2(1.0, 0.5, 0.0)
    points = points_of(truth)
    ahead = points[np.abs(points[:, 0] - 1.0) < 1e-9]
    particles = cloud(particles=10)
    particles.particles = np.array([[1.0, 0.5, 0.0], [1.1, 0.5, 0.0]])
    particles.weights = np.full(2, 0.5)
    particles.weigh(ahead, 5.6)
    assert particles.weights[0] > 0.9
    # Nor does the fit draw the wrong one further to the back.
    match = match_scan(
        field_of_room(), ahead, Pose2(1.09, 0.5, 0.0), np.eye(3) * 0.01, sigma=0.05, independent_beams=60.0
    )
    assert match.pose.x <= 1.09


def test_a_fit_never_ends_worse_than_it_began() -> None:
    """Things that the map does not know pull it to and fro."""
    field, rng, sigma = field_of_room(), np.random.default_rng(3), 0.05

    def fit_at(pose: Pose2, points: np.ndarray) -> float:
        at = (pose.x, pose.y, pose.yaw)
        return float(match_terms(at, points, field.signed, field.normals, field.frame, 2.0 * sigma)[2])

    for _ in range(200):
        belief = Pose2(1.0 + 0.1 * rng.standard_normal(), 0.5 + 0.1 * rng.standard_normal(), 0.0)
        things = rng.uniform((-0.9, -0.4), (0.9, 0.4), (60, 2))
        points = np.vstack([points_of(Pose2(1.0, 0.5, 0.0))[::3], things])
        match = match_scan(field, points, belief, np.eye(3) * 0.01, sigma=sigma, independent_beams=60.0)
        assert fit_at(match.pose, points) >= fit_at(belief, points)


def test_without_anything_to_fit_the_belief_stays() -> None:
    field = build_likelihood_field(room(), 2.0)
    belief = Pose2(0.8, 0.45, 0.3)
    far = np.full((20, 2), 30.0)
    match = match_scan(field, far, belief, np.eye(3) * 0.01, sigma=0.05, independent_beams=60.0)
    assert match.pose.distance_to(belief) < 1e-6
    assert match.near_fraction == 0.0


def cloud(**changes: float) -> ParticleFilter:
    parameters = LocaliserParameters(**{"particles": 2000, **changes})  # type: ignore[arg-type]
    field = build_likelihood_field(room(), 2.0)
    return ParticleFilter(field, parameters, np.random.default_rng(1))


def test_motion_without_noise_is_exact() -> None:
    particles = cloud(alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
    particles.set_pose(Pose2(1.0, 0.5, math.pi / 2), (0.0, 0.0, 0.0))
    particles.move(Pose2(0.2, 0.1, 0.3), np.zeros((3, 3)))
    mean, covariance = particles.estimate()
    assert (mean.x, mean.y, mean.yaw) == pytest.approx((0.9, 0.7, math.pi / 2 + 0.3))
    assert np.allclose(covariance, 0.0)


@pytest.mark.parametrize("motion", [Pose2(0.5, 0.0, 0.0), Pose2(-0.5, 0.0, 0.0)])
def test_driving_backwards_is_as_noisy_as_forwards(motion: Pose2) -> None:
    particles = cloud(alpha1=0.04, alpha2=0.0, alpha3=0.01, alpha4=0.04)
    particles.set_pose(Pose2(), (0.0, 0.0, 0.0))
    particles.move(motion, np.zeros((3, 3)))
    assert particles.particles[:, 0].std() == pytest.approx(0.05, rel=0.15)
    assert particles.particles[:, 2].std() == pytest.approx(0.0, abs=1e-9)


def test_the_mean_of_headings_goes_around_the_circle() -> None:
    particles = cloud()
    particles.set_pose(Pose2(0.0, 0.0, math.pi), (0.01, 0.01, 0.05))
    mean, _ = particles.estimate()
    assert abs(normalize_angle(mean.yaw - math.pi)) < 0.02


@pytest.mark.parametrize("name", ["particles", "sigma_hit", "alpha1", "match_sigma"])
def test_bad_parameters(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        LocaliserParameters(**{name: -1})  # type: ignore[arg-type]


def scan_at(stamp: float) -> LaserScan:
    return LaserScan(stamp, "laser", 0.0, 0.1, 0.1, 4.0, np.ones(3, np.float32))


def test_a_scan_waits_for_the_odometry() -> None:
    queue = ScanQueue()
    queue.add_scan("scan", scan_at(1.05))
    assert queue.take_ready() == []
    queue.add_odometry(Odometry(1.0, Pose2(0.0, 0.0, 0.0)))
    assert queue.take_ready() == []
    queue.add_odometry(Odometry(1.1, Pose2(1.0, 0.0, 0.0)))
    [(source, scan, pose)] = queue.take_ready()
    assert (source, scan.stamp) == ("scan", 1.05)
    assert pose.x == pytest.approx(0.5)
    assert queue.take_ready() == []


def test_a_scan_is_placed_where_its_middle_beam_was_measured() -> None:
    queue = ScanQueue()
    turning = replace(scan_at(1.0), ranges=np.ones(101, np.float32), time_increment=0.001)
    queue.add_scan("scan", turning)
    queue.add_odometry(Odometry(1.0, Pose2()))
    assert queue.take_ready() == []
    queue.add_odometry(Odometry(1.1, Pose2(0.0, 0.0, 0.1)))
    [(_, _, pose)] = queue.take_ready()
    assert pose.yaw == pytest.approx(0.05)


def test_scans_are_used_with_an_odometry_that_is_always_late() -> None:
    queue = ScanQueue()
    used = []
    for tenths in range(40):
        queue.add_scan("scan", scan_at(tenths / 10.0))
        queue.add_odometry(Odometry(tenths / 10.0 - 0.35, Pose2()))
        used += [round(scan.stamp, 3) for _, scan, _ in queue.take_ready()]
    assert used == [tenths / 10.0 for tenths in range(36)]


def test_the_newest_scan_of_each_source_counts_and_old_ones_are_dropped() -> None:
    queue = ScanQueue()
    queue.add_odometry(Odometry(5.0, Pose2()))
    queue.add_scan("depth", scan_at(1.0))
    queue.add_scan("scan", scan_at(5.1))
    queue.add_scan("scan", scan_at(5.2))
    queue.add_odometry(Odometry(6.0, Pose2(math.nan, 0.0, 0.0)))
    queue.add_odometry(Odometry(5.3, Pose2()))
    assert [(source, scan.stamp) for source, scan, _ in queue.take_ready()] == [("scan", 5.2)]
