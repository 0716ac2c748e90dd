"""Logs of a robot that drives about in a map, with odometry as bad as wanted, people on its way, and
furniture that the map does not know.

They are a second source beside recorded logs, so that nothing is tuned to one building.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from florence_bt.app.maps.recordings.carmen import FRAME
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, LaserScan, OccupancyGrid
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.planner import Plan, PlannerParameters, plan_path
from tools.carmen_log import Record

SCAN_PERIOD_S = 0.1
STEP_M, STEP_RAD = 0.06, 0.12
"""Between two scans the robot drives or turns by so much at most."""
AHEAD_M, TURN_FIRST_RAD = 0.4, 0.7
"""It heads for the path so far ahead, and turns in place when that is farther to the side."""
LEAST_WAY_M, MOST_REFUSED = 3.0, 100
"""The way to its next goal, and after how many places that it cannot reach it gives up."""
PERSON_RADIUS_M, PERSON_SPEED = 0.2, 0.8
RANGE_NOISE = 0.01
DOOR_M = 0.9


@dataclass(frozen=True, slots=True)
class Scanner:
    """A laser at the robot's middle.

    Attributes:
        half_angle: Radians to each side.
        beams: How many.
        longest: Metres.
    """

    half_angle: float
    beams: int
    longest: float


HOKUYO = Scanner(math.radians(120.0), 240, 5.6)
SICK = Scanner(math.radians(90.0), 361, 20.0)
COARSE_SICK = Scanner(math.radians(90.0), 181, 20.0)


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions that make a drive hard.

    Attributes:
        noise: Standard deviation of way and turn from scan to scan, as a part of them.
        way_scale: The odometry tells so many times the way.
        turn_scale: And so many times the turn.
        people: How many walk about.
        boxes: How many boxes of 0.3 to 0.9 m stand where the map has none.
    """

    noise: float = 0.04
    way_scale: float = 1.0
    turn_scale: float = 1.0
    people: int = 0
    boxes: int = 0


@dataclass(frozen=True, slots=True)
class Place:
    """A place to drive.

    Attributes:
        name: For people.
        grid: The map.
        real: What is really there.
        scanner: What the robot sees it with.
    """

    name: str
    grid: OccupancyGrid
    real: OccupancyGrid
    scanner: Scanner


def home(seed: int) -> Place:
    """Generate a home; some of its furniture was moved after the map was made."""
    flat = generated_flat(seed)
    now = dataclasses.replace(flat, mapped=flat.solids)
    return Place(f"home {seed}", laser_map(flat), laser_map(now), HOKUYO)


def corridors(seed: int) -> Place:
    """Make a ring of four bare corridors, 45 by 22 m, 1.8 to 2.4 m wide, whose only landmarks are doors."""
    random, cells = np.random.default_rng(seed), np.full((620, 1060), -1, np.int8)

    def clear(x0: float, y0: float, x1: float, y1: float) -> None:
        rows, columns = (slice(round(20 * low), round(20 * high)) for low, high in ((y0, y1), (x0, x1)))
        cells[rows, columns] = FREE

    left, low, right, high = 4.0, 4.0, 49.0, 26.0
    south, north, west, east = random.uniform(1.8, 2.4, 4)
    clear(left, low, right, low + south)
    clear(left, high - north, right, high)
    clear(left, low, left + west, high)
    clear(right - east, low, right, high)
    for y, outwards in ((low, -1), (low + south, 1), (high - north, -1), (high, 1)):
        for x, deep in _doors(left, right, random):
            clear(x, min(y, y + outwards * deep), x + DOOR_M, max(y, y + outwards * deep))
    for x, outwards in ((left, -1), (left + west, 1), (right - east, -1), (right, 1)):
        for y, deep in _doors(low, high, random):
            clear(min(x, x + outwards * deep), y, max(x, x + outwards * deep), y + DOOR_M)
    cells[binary_dilation(cells == FREE, iterations=2) & (cells != FREE)] = OCCUPIED
    grid = OccupancyGrid(0.05, Pose2(), cells)
    return Place(f"corridors {seed}", grid, grid, COARSE_SICK)


def _doors(start: float, end: float, random: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Yield where along a wall doors are, 4 to 14 m apart, and how far they are set back, metres."""
    at = start + random.uniform(3.0, 9.0)
    while at < end - 3.0:
        yield at, float(random.uniform(0.1, 0.2))
        at += random.uniform(4.0, 14.0)


def mapped(path: Path) -> Place:
    """Load a building of which there is a map (YAML)."""
    grid = load_map(path)
    return Place(path.stem, grid, grid, SICK)


def drive(place: Place, conditions: Conditions, scans: int, seed: int) -> list[Record]:
    """Make the log of a drive from goal to goal.

    Args:
        place: Where.
        conditions: What makes it hard.
        scans: How many.
        seed: Of everything random.
    """
    random = np.random.default_rng(seed)
    real = _with_boxes(place.real, conditions.boxes, random)
    people = _People(real, conditions.people, random)
    records: list[Record] = []
    for pose in _poses(real, random):
        seen = _scan(real, people.places, pose, place.scanner, SCAN_PERIOD_S * len(records), random)
        motion = records[-1].reference.inverse() @ pose if records else Pose2()
        records.append(Record(seen, pose, _told(motion, conditions, random)))
        people.walk()
        if len(records) == scans:
            break
    return records


def _told(motion: Pose2, conditions: Conditions, random: np.random.Generator) -> Pose2:
    """Return what the odometry says of a motion along an arc."""
    way = math.copysign(math.hypot(motion.x, motion.y), motion.x)
    error = conditions.noise * random.standard_normal(3)
    way_told = conditions.way_scale * way * (1.0 + error[0])
    turn_told = conditions.turn_scale * motion.yaw * (1.0 + error[1]) + error[2] * abs(way)
    return Pose2(way_told * math.cos(turn_told / 2.0), way_told * math.sin(turn_told / 2.0), turn_told)


def _poses(real: OccupancyGrid, random: np.random.Generator) -> Iterator[Pose2]:
    costmap = Costmap(CostmapParameters(inflation_radius=0.6, cost_scaling_factor=5.0), real)
    goals = _centres(real, costmap.master == 0)
    here = Pose2(*goals[random.integers(len(goals))].tolist(), float(random.uniform(-math.pi, math.pi)))
    yield here
    refused = 0
    while refused < MOST_REFUSED:
        goal = Pose2(*goals[random.integers(len(goals))].tolist())
        plan = plan_path(costmap, here, goal, PlannerParameters(allow_unknown=False))
        refused += 1
        if isinstance(plan, Plan) and plan.length >= LEAST_WAY_M:
            refused = 0
            for pose in _along(plan.points, here):
                here = pose
                yield here
    raise ValueError(f"no way leads from {here} to {MOST_REFUSED} places; would have worked: fewer boxes")


def _along(path: NDArray[np.float64], here: Pose2) -> Iterator[Pose2]:
    nearest, target = 0, path[0]
    while (
        math.hypot(*(target - path[-1])) > 0.0 or math.hypot(here.x - target[0], here.y - target[1]) > AHEAD_M
    ):
        near = np.hypot(path[nearest : nearest + 50, 0] - here.x, path[nearest : nearest + 50, 1] - here.y)
        nearest += int(near.argmin())
        beyond = np.hypot(path[nearest:, 0] - here.x, path[nearest:, 1] - here.y) > AHEAD_M
        target = path[nearest + int(beyond.argmax())] if beyond.any() else path[-1]
        side = here.bearing_to(*target.tolist())
        turn = max(-STEP_RAD, min(STEP_RAD, side))
        here = here @ Pose2(0.0 if abs(side) > TURN_FIRST_RAD else STEP_M, 0.0, turn)
        yield here


def _centres(grid: OccupancyGrid, cells: NDArray[np.bool_]) -> NDArray[np.float64]:
    rows, columns = np.nonzero(cells)
    corner = np.array([grid.origin.x, grid.origin.y])
    return corner + (np.stack([columns, rows], axis=1) + 0.5) * grid.resolution


def _with_boxes(grid: OccupancyGrid, count: int, random: np.random.Generator) -> OccupancyGrid:
    cells = grid.cells.copy()
    rows, columns = np.nonzero(grid.cells == FREE)
    for _ in range(count):
        at = int(random.integers(len(rows)))
        height, width = (random.uniform(0.3, 0.9, 2) / grid.resolution).round().astype(int)
        box = cells[rows[at] : rows[at] + height, columns[at] : columns[at] + width]
        box[box == FREE] = OCCUPIED
    return dataclasses.replace(grid, cells=cells)


def _scan(
    grid: OccupancyGrid,
    people: NDArray[np.float64],
    pose: Pose2,
    scanner: Scanner,
    stamp: float,
    random: np.random.Generator,
) -> LaserScan:
    angles = np.linspace(-scanner.half_angle, scanner.half_angle, scanner.beams)
    rays = np.stack([np.cos(pose.yaw + angles), np.sin(pose.yaw + angles)], axis=1)
    along = np.arange(0.0, scanner.longest, grid.resolution / 2.0)
    u = np.floor((pose.x - grid.origin.x + rays[:, :1] * along) / grid.resolution).astype(int)
    v = np.floor((pose.y - grid.origin.y + rays[:, 1:] * along) / grid.resolution).astype(int)
    rows, columns = grid.cells.shape
    inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    hit = inside & (grid.cells[np.where(inside, v, 0), np.where(inside, u, 0)] == OCCUPIED)
    ranges = np.where(hit.any(axis=1), along[hit.argmax(axis=1)], np.inf)
    for x, y in people - np.array([pose.x, pose.y]):
        ahead, beside = rays[:, 0] * x + rays[:, 1] * y, rays[:, 0] * y - rays[:, 1] * x
        half = np.sqrt(np.maximum(PERSON_RADIUS_M**2 - beside**2, 0.0))
        met = (half > 0.0) & (ahead > half)
        ranges = np.where(met, np.minimum(ranges, ahead - half), ranges)
    ranges = ranges * (1.0 + RANGE_NOISE * random.standard_normal(len(ranges)))
    return LaserScan(
        stamp=stamp,
        frame_id=FRAME,
        angle_min=-scanner.half_angle,
        angle_increment=2.0 * scanner.half_angle / (scanner.beams - 1),
        range_min=0.02,
        range_max=scanner.longest,
        ranges=ranges.astype(np.float32),
    )


class _People:
    """Walk straight on until something is in their way, then elsewhere."""

    def __init__(self, grid: OccupancyGrid, count: int, random: np.random.Generator) -> None:
        self._grid, self._random = grid, random
        free = _centres(grid, grid.cells == FREE)
        self.places = free[random.integers(len(free), size=count)]
        self._headings = random.uniform(-math.pi, math.pi, count)

    def walk(self) -> None:
        """Walk for the time of a scan."""
        way = PERSON_SPEED * SCAN_PERIOD_S
        there = self.places + way * np.stack([np.cos(self._headings), np.sin(self._headings)], axis=1)
        corner = np.array([self._grid.origin.x, self._grid.origin.y])
        u, v = np.floor((there - corner) / self._grid.resolution).astype(int).T
        rows, columns = self._grid.cells.shape
        inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
        free = inside & (self._grid.cells[np.where(inside, v, 0), np.where(inside, u, 0)] == FREE)
        self.places = np.where(free[:, None], there, self.places)
        elsewhere = self._random.uniform(-math.pi, math.pi, len(free))
        self._headings = np.where(free, self._headings, elsewhere)
