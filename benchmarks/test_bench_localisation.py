"""What it costs to weigh particles by a scan, and to localise a robot that drives."""

from __future__ import annotations

import statistics
import time

import numpy as np
from numpy.typing import NDArray

from benchmarks.measure import size
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.localisation._kernels import weigh_particles
from florence_bt.skills.navigation.localisation.likelihood_field import (
    LikelihoodField,
    build_likelihood_field,
)
from florence_bt.skills.navigation.localisation.localiser import Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from tools.generated_log import Conditions, drive, home

PARTICLES, BEAMS, ROUNDS = 2000, 60, size(20, 1)
SCANS, DRIVES, RATE_HZ = size(300, 30), size(3, 1), 10
LEAST_RATIO = 5.0


def weigh_by_numpy(
    field: LikelihoodField,
    cubes: NDArray[np.float32],
    outside: float,
    particles: NDArray[np.float64],
    points: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The same table, without the backs of surfaces: 1 + sum of pz^3 (REFERENCE 7.7)."""
    c, s = np.cos(particles[:, 2:]), np.sin(particles[:, 2:])
    x = particles[:, :1] + c * points[:, 0] - s * points[:, 1]
    y = particles[:, 1:2] + s * points[:, 0] + c * points[:, 1]
    columns = np.floor((x - field.origin_x) / field.resolution).astype(int)
    rows = np.floor((y - field.origin_y) / field.resolution).astype(int)
    inside = (rows >= 0) & (rows < cubes.shape[0]) & (columns >= 0) & (columns < cubes.shape[1])
    values = np.full(x.shape, outside)
    values[inside] = cubes[rows[inside], columns[inside]]
    return 1.0 + values.sum(axis=1)


def test_weights(benchmark, figures):
    """2000 particles within half a metre and 60 beams of a laser in a home, one thread."""
    place, p = home(3), LocaliserParameters()
    record = drive(place, Conditions(), 1, seed=1)[0]
    field = build_likelihood_field(place.grid, p.likelihood_max_dist, p.surface_offset)
    outside = (p.z_rand / record.scan.range_max) ** 3
    hit = p.z_hit * np.exp(-(field.signed.astype(float) ** 2) / (2.0 * p.sigma_hit**2))
    cubes = ((hit + p.z_rand / record.scan.range_max) ** 3).astype(np.float32)
    used = np.flatnonzero(np.isfinite(record.scan.ranges))
    used = used[np.linspace(0, len(used) - 1, BEAMS).round().astype(int)]
    angles, ranges = record.scan.angles()[used], record.scan.ranges[used].astype(float)
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)
    here, spread = record.reference, np.random.default_rng(1).standard_normal((PARTICLES, 3))
    particles = np.array([here.x, here.y, here.yaw]) + spread * np.array([0.5, 0.5, 0.2])
    no_backs = np.zeros_like(field.normals)
    grid = (field.origin_x, field.origin_y, field.resolution)

    def compiled() -> NDArray[np.float64]:
        return weigh_particles(particles, points, cubes, field.normals, outside, *grid)

    same = weigh_particles(particles, points, cubes, no_backs, outside, *grid)
    by_numpy = weigh_by_numpy(field, cubes, outside, particles, points)
    # A beam that ends at the very border of two cells may fall into either.
    assert np.mean(np.isclose(same, by_numpy, rtol=1e-4)) > 0.99
    costs = [_seconds(compiled) for _ in range(ROUNDS)]
    costs_by_numpy = [
        _seconds(lambda: weigh_by_numpy(field, cubes, outside, particles, points)) for _ in range(ROUNDS)
    ]
    benchmark.pedantic(compiled, rounds=3)
    ratio = min(costs_by_numpy) / min(costs)
    figures.add(
        f"localisation: weights of {PARTICLES} particles by {BEAMS} beams",
        f"{1e6 * min(costs):.0f} us",
        f"numpy with the same table {1e6 * min(costs_by_numpy):.0f} us: {ratio:.1f} times, aim: 5",
    )
    figures.limit(ratio, least=LEAST_RATIO)


def test_localiser(benchmark, figures):
    """A drive through a generated home at 0.6 m/s, 240 beams: every scan moves the robot."""
    place = home(3)
    records = drive(place, Conditions(people=2), SCANS, seed=2)
    localiser = Localiser(place.grid)

    def follow() -> float:
        localiser.set_pose(records[0].reference, (0.1, 0.1, 0.05))
        odometry, begin = Pose2(), time.process_time()
        for record in records:
            odometry = odometry @ record.motion
            localiser.update(record.scan, Transform3.from_pose2(Pose2()), odometry)
        cost = (time.process_time() - begin) / SCANS
        assert localiser.map_from_odom is not None
        assert (localiser.map_from_odom @ odometry).distance_to(records[-1].reference) < 0.2
        return cost

    follow()
    costs: list[float] = []
    benchmark.pedantic(lambda: costs.append(follow()), rounds=DRIVES)
    cost = statistics.median(costs)
    figures.add(
        f"localisation: at {RATE_HZ} Hz",
        f"{100 * cost * RATE_HZ:.1f} % of a core",
        f"{1000 * cost:.2f} ms a scan; aim: well under 25 %",
    )
    figures.limit(100 * cost * RATE_HZ, most=25.0)


def _seconds(call) -> float:  # type: ignore[no-untyped-def]
    begin = time.process_time()
    call()
    return time.process_time() - begin
