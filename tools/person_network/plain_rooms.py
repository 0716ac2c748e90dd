"""Depth pictures of plain rooms with people of elliptic parts: other bodies than those of the homes.

They keep the network from learning one model of a body by heart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.person import PersonSpec, Posture
from florence_bt.skills.people.user_tracker.person_network import INPUT_SIZE
from tools.person_network.pictures import Picture

Random = np.random.Generator
Floats = NDArray[np.float64]

_NEAREST_M, _FURTHEST_M = 0.5, 5.0
_RAW = (3.3309495161, 0.0030711016)
"""Depth = 1 / (a - b raw). Source: REFERENCE 5.3, formula A."""


@dataclass(frozen=True, slots=True)
class _Part:
    """An upright elliptic cylinder or box in the robot frame.

    Attributes:
        x: Centre, metres.
        y: Centre, metres.
        half: Semi-axes, or half of the sides, along and across the yaw, metres.
        low: Height of its bottom, metres.
        high: Height of its top, metres.
        yaw: Radians.
        round: Whether it is a cylinder.
        owner: Index of the person, -1 for furniture.
    """

    x: float
    y: float
    half: tuple[float, float]
    low: float
    high: float
    yaw: float
    round: bool
    owner: int = -1


def plain_pictures(seed: int, count: int) -> Iterator[Picture]:
    """Yield pictures of rooms with 0 to 3 people who stand or sit."""
    rng = np.random.default_rng((seed, 78))
    width, height = INPUT_SIZE
    focal = 525.0 * width / 640
    camera = CameraModel(width, height, focal, focal, width / 2 - 0.5, height / 2 - 0.5)
    for _ in range(count):
        people = [
            _person(number, rng) for number in range(int(rng.choice([0, 1, 2, 3], p=[0.3, 0.4, 0.2, 0.1])))
        ]
        parts = [*_room(rng), *(part for _, own in people for part in own)]
        tilt = rng.normal(0.0, (0.01, 0.03, 0.01))
        turn = Transform3.from_xyz_rpy((0, 0, 0), tilt).rotation
        optical = Transform3.from_xyz_rpy((-0.087, 0.0, 0.54), (-math.pi / 2, 0.0, -math.pi / 2))
        place = Transform3(turn @ optical.rotation, optical.translation + rng.normal(0.0, (0.01, 0.01, 0.03)))
        depth, owner = _render(parts, place, camera, rng)
        image = DepthImage(0.0, "optical", camera, depth)
        yield Picture(image, place, Pose2(), owner, [spec for spec, _ in people], [])


def _render(
    parts: list[_Part], place: Transform3, camera: CameraModel, rng: Random
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u, float)], -1)
    directions, origin = rays @ place.rotation.T, place.translation
    with np.errstate(divide="ignore", invalid="ignore"):
        best = np.where(directions[..., 2] < 0, -origin[2] / directions[..., 2], np.inf)
        owner = np.full(best.shape, -1)
        for part in parts:
            depth = _hit(part, origin, directions)
            owner[depth < best] = part.owner
            best = np.minimum(best, depth)
        best[~((best > _NEAREST_M) & (best < _FURTHEST_M))] = np.nan
        raw = (_RAW[0] - 1.0 / best) / _RAW[1] + rng.normal(0.0, rng.uniform(0.2, 1.0), best.shape)
        noisy = 1.0 / (_RAW[0] - _RAW[1] * np.round(raw))
    noisy[rng.random(best.shape) < rng.uniform(0.0, 0.02)] = np.nan
    return noisy.astype(np.float32), owner


def _hit(part: _Part, origin: Floats, directions: Floats) -> Floats:
    """Return the depth of the first hit of each ray, infinite where there is none."""
    c, s = math.cos(part.yaw), math.sin(part.yaw)
    turn = np.array([[c, s], [-s, c]])
    o = turn @ (origin[:2] - np.array([part.x, part.y])) / part.half
    d = directions[..., :2] @ turn.T / part.half
    ends = [(z - origin[2]) / directions[..., 2] for z in (part.low, part.high)]
    low, high = np.minimum(*ends), np.maximum(*ends)
    if part.round:
        qa, qb, qc = (d**2).sum(-1), (d * o).sum(-1), (o**2).sum() - 1.0
        root = np.sqrt(qb**2 - qa * qc)
        enter, leave = (-qb - root) / qa, (-qb + root) / qa
    else:
        t1, t2 = (-1.0 - o) / d, (1.0 - o) / d
        enter, leave = np.minimum(t1, t2).max(-1), np.maximum(t1, t2).min(-1)
    enter, leave = np.maximum(enter, low), np.minimum(leave, high)
    return np.where((enter <= leave) & (enter > 0.0), enter, np.inf)


def _spot(rng: Random) -> Pose2:
    distance, bearing = float(rng.uniform(0.7, 4.3)), float(rng.uniform(-0.6, 0.6))
    return Pose2(distance * math.cos(bearing), distance * math.sin(bearing), float(rng.uniform(-3.15, 3.15)))


def _person(owner: int, rng: Random) -> tuple[PersonSpec, list[_Part]]:
    """Make somebody of 0.95 to 1.95 m, limbs of any thickness, standing or sitting on a stool."""
    at, tall = _spot(rng), float(rng.uniform(0.95, 1.95))
    build = min(1.0, tall / 1.6) * float(rng.uniform(0.8, 1.25))
    posture: Posture = "sitting" if rng.random() < 0.4 else "standing"

    def part(
        forward: float, left: float, half: tuple[float, float], low: float, high: float, *, box: bool = False
    ) -> _Part:
        x, y = at.apply(forward, left)
        return _Part(x, y, half, low, high, at.yaw, not box, owner)

    deep, wide = build * float(rng.uniform(0.09, 0.15)), build * float(rng.uniform(0.14, 0.22))
    leg, head = build * float(rng.uniform(0.05, 0.09)), float(rng.uniform(0.075, 0.11))
    if posture == "standing":
        hip, shoulder = 0.48 * tall, 0.83 * tall
        parts = [part(0.0, side * 0.09 * build, (leg, leg), 0.0, hip) for side in (1, -1)]
    else:
        hip = float(rng.uniform(0.35, 0.5))
        shoulder = hip + 0.33 * tall
        tall = hip + 0.5 * tall
        knee = build * float(rng.uniform(0.35, 0.45))
        parts = [part(knee, side * 0.1 * build, (leg, leg), 0.0, hip + 0.05) for side in (1, -1)]
        parts.append(part(knee / 2, 0.0, (knee / 2, 0.17 * build), hip - 0.05, hip + 0.1, box=True))
    parts.append(part(0.0, 0.0, (deep, wide), hip, shoulder))
    arm = build * float(rng.uniform(0.035, 0.06))
    if rng.random() < 0.8:
        parts += [
            part(0.02, side * (wide + arm / 2), (arm, arm), hip - 0.1 * build, shoulder - 0.04)
            for side in (1, -1)
        ]
    parts.append(part(0.0, 0.0, (1.2 * head, head), shoulder, tall))
    return PersonSpec(f"person_{owner}", at, posture), parts


def _room(rng: Random) -> Iterator[_Part]:
    """Make walls, and boxes, posts, tables and lamps anywhere."""
    far, left, right = rng.uniform(2.0, 6.0), rng.uniform(1.0, 4.0), rng.uniform(-4.0, -1.0)
    turn = float(rng.uniform(-0.5, 0.5))
    yield _Part(float(far), 0.0, (0.05, 6.0), 0.0, 2.5, turn, round=False)
    yield _Part(2.0, float(left), (6.0, 0.05), 0.0, 2.5, turn, round=False)
    yield _Part(2.0, float(right), (6.0, 0.05), 0.0, 2.5, turn, round=False)
    for _ in range(int(rng.integers(0, 6))):
        at, kind = _spot(rng), int(rng.integers(4))
        size = tuple(float(half) for half in rng.uniform(0.03, 0.5, 2))
        half = (size[0], size[1])
        if kind == 0:
            yield _Part(at.x, at.y, half, 0.0, float(rng.uniform(0.3, 2.5)), at.yaw, round=False)
        elif kind == 1:
            radius = float(rng.uniform(0.02, 0.3))
            yield _Part(at.x, at.y, (radius, radius), 0.0, float(rng.uniform(0.3, 2.5)), at.yaw, round=True)
        elif kind == 2:
            top = float(rng.uniform(0.4, 1.0))
            yield _Part(at.x, at.y, (half[0] + 0.2, half[1] + 0.2), top - 0.04, top, at.yaw, round=False)
            for forward, side in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                x, y = at.apply(forward * (half[0] + 0.15), side * (half[1] + 0.15))
                yield _Part(x, y, (0.025, 0.025), 0.0, top, at.yaw, round=False)
        else:
            low = float(rng.uniform(0.8, 1.6))
            radius = float(rng.uniform(0.08, 0.25))
            yield _Part(at.x, at.y, (0.02, 0.02), 0.0, low, at.yaw, round=True)
            yield _Part(
                at.x, at.y, (radius, radius), low, low + float(rng.uniform(0.15, 0.5)), 0.0, round=True
            )
