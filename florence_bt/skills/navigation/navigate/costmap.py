"""Costmaps: what is in the robot's way, and how near. Scans in, a grid of costs out."""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.navigate import _cell_kernels as _cells
from florence_bt.skills.navigation.navigate._cell_kernels import (
    CLEARABLE,
    INSCRIBED,
    LETHAL,
    UNKNOWN_COST,
    Cells,
)
from florence_bt.skills.navigation.navigate._ray_kernels import beam_ends, move_points, to_cells
from florence_bt.skills.navigation.navigate.proxemics import add_proxemics
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, Footprint, corners_from_flat
from florence_bt.skills.robot_description.room import FOOTPRINT_PADDING_M

FREE_COST = 0
"""As in costmap_2d."""


@dataclass(frozen=True, slots=True)
class SourceParameters(CheckedParameters):
    """The weight of one sensor in the costmaps; names as in costmap_2d.

    Attributes:
        marking: Whether its beams mark.
        clearing: Whether its beams clear.
        obstacle_range: Metres; 0 takes that of the costmap.
        raytrace_range: Metres; 0 takes that of the costmap.

    Source:
        REFERENCE 7.4.
    """

    marking: bool = True
    clearing: bool = True
    obstacle_range: NotNegative = 0.0
    raytrace_range: NotNegative = 0.0


@dataclass(frozen=True, slots=True)
class CostmapParameters(CheckedParameters):
    """The parameters of the costmaps; names as in costmap_2d.

    Attributes:
        footprint: x, y, x, y, ... of the corners in metres.
        footprint_padding: Metres added all around.
        obstacle_range: Nearer beam ends mark, in metres.
        raytrace_range: Rays clear up to here, in metres.
        inflation_radius: How far costs spread from obstacles in metres.
        cost_scaling_factor: How fast they decay, per metre.
        lethal_cost_threshold: Map values from here on are obstacles (0..100).
        track_unknown_space: Whether unknown cells of the map stay unknown; otherwise they count as free.
        fill_tables: Whether the places between the legs of tables and chairs in the map are obstacles; a
            noisy map may look as if there were legs.
        local_size: Side of the local costmap in metres.
        local_resolution: Metres per cell of the local costmap.
        proxemic_amplitude: The cost at a person in the global costmap; 0 switches the layer of people off.
        proxemic_covariance: Of the Gaussian in which it falls beside and behind them, in m^2.
        proxemic_factor: How much greater that is before them, for each m/s.
        scan: Laser and depth camera at the laser's height, combined.
        depth: The depth camera at the robot's height.
        low: What the depth camera sees below.
        overhangs: What it sees hang over.

    Source:
        REFERENCE 7.4; document, section 3.3.2. Names and values of the last three are those of
        social_navigation_layers::ProxemicLayer.
    """

    footprint: tuple[float, ...] = FLORENCE_FOOTPRINT
    footprint_padding: NotNegative = FOOTPRINT_PADDING_M
    obstacle_range: Positive = 2.5
    raytrace_range: Positive = 3.0
    inflation_radius: Positive = 0.40
    cost_scaling_factor: NotNegative = 10.0
    lethal_cost_threshold: Annotated[int, Limits(1, 100)] = 65
    track_unknown_space: bool = True
    fill_tables: bool = True
    local_size: Positive = 5.0
    local_resolution: Positive = 0.05
    proxemic_amplitude: Annotated[float, Limits(0.0, INSCRIBED - 1)] = 77.0
    proxemic_covariance: Positive = 0.25
    proxemic_factor: NotNegative = 5.0
    scan: SourceParameters = field(default_factory=SourceParameters)
    depth: SourceParameters = field(default_factory=SourceParameters)
    low: SourceParameters = field(default_factory=SourceParameters)
    overhangs: SourceParameters = field(default_factory=SourceParameters)

    def _check(self) -> None:
        self.make_footprint()

    def make_footprint(self) -> Footprint:
        """Return the padded footprint."""
        return Footprint.from_corners(corners_from_flat(self.footprint), self.footprint_padding)

    def of_source(self, source: str) -> SourceParameters:
        """Return the parameters of a sensor, with the costmap's own ranges where it has none."""
        every = {"scan": self.scan, "depth": self.depth, "low": self.low, "overhangs": self.overhangs}
        params = every.get(source, SourceParameters())
        return replace(
            params,
            obstacle_range=params.obstacle_range or self.obstacle_range,
            raytrace_range=params.raytrace_range or self.raytrace_range,
        )

    def make_true_footprint(self) -> Footprint:
        """Return the footprint without padding."""
        return Footprint.from_corners(corners_from_flat(self.footprint))


def cost_at_distance(distance: float, inscribed_radius: float, parameters: CostmapParameters) -> int:
    """Return the cost of a cell at a distance (metres) from the nearest obstacle.

    Source:
        REFERENCE 7.4.
    """
    if distance == 0.0:
        return LETHAL
    if distance <= inscribed_radius:
        return INSCRIBED
    if distance > parameters.inflation_radius:
        return FREE_COST
    return int(252.0 * math.exp(-parameters.cost_scaling_factor * (distance - inscribed_radius)))


@dataclass(frozen=True, slots=True)
class Rays:
    """The usable beams of one scan in the plane of a costmap's frame.

    Attributes:
        x: The sensor.
        y: The sensor.
        ends: Shape (n, 2), x and y of the beams' ends.
        ranges: Shape (n,), length of each beam in metres.
        nearest: The sensor sees nothing nearer than this, in metres.
        farthest: Nor anything from here on: the end of such a beam is free.
    """

    x: float
    y: float
    ends: NDArray[np.float64]
    ranges: NDArray[np.float64]
    nearest: float
    farthest: float


_FAR_M = 1e-3
"""The laser filter lets a far beam end so little before the range of its sensor."""
_FEET_M = 0.35
"""Distance from what the laser sees, and the map does not know, within which marks stand on it: body and arms
of a person."""
BODY_REACH_M = {"depth": 0.2, "overhangs": _FEET_M}
"""Source of such marks -> how near feet must be for one to stay where the laser looks through, metres: what
is carried hangs over further."""
CLEARED_FROM = {"low": 1.3}
"""Source -> nearer than this its rays clear nothing, metres: the camera looks over what lies there."""
_NO_POINTS = np.empty((0, 2))
LASER = "scan"
"""The source of scans at the height of the laser, which looks nearly all around and sees what is near: it
marks again what was forgotten. The camera, which looks ahead from half a metre on, does not."""
CONTACTS = "contacts"
"""Name of the layer of what was touched."""
TIGHT = "tight"
"""Name of the layer of ways that the controller could not drive."""
BODIES = "people"
"""The source of scans of people who sit or lie, as the user tracker sees them; they only mark."""
_FELT = CONTACTS, TIGHT
"""Layers of what no sensor sees."""
_BUMPER_ARC = 0.21 * np.array([(math.cos(turn), math.sin(turn)) for turn in np.radians(range(-45, 46, 9))])
"""Shape (n, 2), metres in base_footprint: what the bumper may touch, just before the round base of 0.17 m."""


def rays_of(scan: LaserScan, sensor_in_frame: Transform3) -> Rays:
    """Take a scan into a frame; beams that measured nothing valid are left out.

    Source:
        REFERENCE 6.2 (laser_geometry).
    """
    ends, ranges = beam_ends(
        np.ascontiguousarray(scan.ranges, np.float32),
        scan.directions(),
        np.float32(scan.range_min),
        np.float32(scan.range_max),
        np.ascontiguousarray(sensor_in_frame.rotation),
        sensor_in_frame.translation,
    )
    x, y, _ = sensor_in_frame.translation.tolist()
    return Rays(x, y, ends, ranges, float(scan.range_min), float(scan.range_max) - _FAR_M)


def moved_rays(rays: Rays, motion: Pose2) -> Rays:
    """Return the same rays in another frame.

    Args:
        rays: In a frame.
        motion: That frame in the new one.
    """
    x, y = motion.apply(rays.x, rays.y)
    return Rays(x, y, moved_points(rays.ends, motion), rays.ranges, rays.nearest, rays.farthest)


def moved_points(points: NDArray[np.float64], motion: Pose2) -> NDArray[np.float64]:
    """Move points of a frame, shape (n, 2), into another one in which that frame has the pose ``motion``."""
    moved: NDArray[np.float64] = move_points(
        np.ascontiguousarray(points, np.float64), motion.x, motion.y, motion.yaw
    )
    return moved


class Costmap:
    """A static layer, one obstacle layer per sensor, the inflated sum of them, and a layer of people.

    What one sensor has marked is cleared only by the same sensor: the laser passes under a table top that
    the camera sees. A rolling costmap keeps the robot near its middle.

    Attributes:
        resolution: Metres per cell.
        origin_x: Outer corner of cell [0, 0].
        origin_y: Outer corner of cell [0, 0].
        footprint: The padded footprint.
    """

    def __init__(self, parameters: CostmapParameters, static: OccupancyGrid | None = None) -> None:
        self._parameters = parameters
        self._of_source = functools.cache(parameters.of_source)
        self.footprint = parameters.make_footprint()
        self._true_footprint = parameters.make_true_footprint().corner_array()
        self._layers: dict[str, Cells] = {}
        self._closed: Cells | None = None
        self._master: Cells | None = None
        self._newest: dict[str, float] = {}
        self._people = np.empty((0, 4))
        self._feet: NDArray[np.float64] | None = None
        if static is None:
            self.resolution = parameters.local_resolution
            side = math.ceil(parameters.local_size / self.resolution)
            self._static: Cells = np.zeros((side, side), np.uint8)
            self._rolling = True
            self._set_origin(0.0, 0.0)
        else:
            self.resolution = static.resolution
            self._static = _static_costs(static, parameters)
            self._rolling = False
            self.origin_x, self.origin_y = static.origin.x, static.origin.y
        self._reach = math.ceil(parameters.inflation_radius / self.resolution)
        self._table = np.array(
            [
                cost_at_distance(
                    math.sqrt(squared) * self.resolution, self.footprint.inscribed_radius, parameters
                )
                for squared in range(self._reach**2 + 1)
            ],
            np.uint8,
        )

    def _set_origin(self, x: float, y: float) -> None:
        rows, columns = self._static.shape
        self.origin_x = (math.floor(x / self.resolution) - columns // 2) * self.resolution
        self.origin_y = (math.floor(y / self.resolution) - rows // 2) * self.resolution

    @property
    def _frame(self) -> tuple[float, float, float]:
        """The outer corner of cell [0, 0], x and y, and the side of a cell, metres."""
        return self.origin_x, self.origin_y, self.resolution

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self._static.shape[0], self._static.shape[1]

    @property
    def master(self) -> Cells:
        """The costs of all layers together, shape (rows, columns)."""
        if self._master is None:
            self._master = self.costs_without("")
        return self._master

    def costs_without(self, source: str) -> Cells:
        """Return the costs of all layers but one together, shape (rows, columns)."""
        costs = self._walls()
        for name, marks in self._layers.items():
            if name != source:
                _cells.add_marks(costs, marks)
        _cells.inflate(costs, self._reach, self._table)
        params = self._parameters
        add_proxemics(
            costs,
            self._frame,
            self._people,
            params.proxemic_amplitude,
            params.proxemic_covariance,
            params.proxemic_factor,
        )
        return costs

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Find the cells that the map says nothing about, shape (rows, columns)."""
        return self._static == UNKNOWN_COST

    @property
    def harmless_below(self) -> int:
        """The cost at the robot's centre below which its outline cannot touch anything."""
        distance = self.footprint.circumscribed_radius + 1.5 * self.resolution
        if distance > self._parameters.inflation_radius:
            return 0
        return cost_at_distance(distance, self.footprint.inscribed_radius, self._parameters)

    def replace_static(self, static: OccupancyGrid, forget: str, stood: Iterable[Pose2] = ()) -> None:
        """Take a newer map of the same place; what the sensors have marked stays where it is.

        Args:
            static: The map, with cells of the same size; it may be larger or smaller, and begin elsewhere.
            forget: A source whose marks go: the map knows better by now.
            stood: base_footprint where the robot was a moment ago: the floor there is free, whatever the map
                shows.

        Raises:
            ValueError: Its cells have another size.
        """
        if static.resolution != self.resolution:
            raise ValueError(f"cells of {static.resolution} m in place of cells of {self.resolution} m")
        du = round((static.origin.x - self.origin_x) / self.resolution)
        dv = round((static.origin.y - self.origin_y) / self.resolution)
        self._static = _static_costs(static, self._parameters)
        self.origin_x, self.origin_y = static.origin.x, static.origin.y
        # Its outline passes through cells whose middles lie outside of it.
        body = Footprint.from_corners(self._true_footprint.tolist(), self.resolution).corner_array()
        for robot in stood:
            _cells.clear_outline(self._static, self._frame, body, robot.x, robot.y, robot.yaw)
        self._layers.pop(forget, None)
        self._layers = {
            name: _shifted(marks, dv, du, self._static.shape) for name, marks in self._layers.items()
        }
        self._closed = self._master = None

    def set_people(self, people: NDArray[np.float64]) -> None:
        """Set where people are now: a way past them costs more, but none is closed.

        Args:
            people: Shape (n, 4): x, y in metres, vx, vy in m/s, in the frame of this costmap.
        """
        if len(people) or len(self._people):
            self._people, self._master = people, None

    def _walls(self) -> Cells:
        """Return the static layer with what zones close, a copy."""
        walls = self._static.copy()
        if self._closed is not None:
            walls[self._closed > 0] = LETHAL
        return walls

    def set_closed(self, closed: NDArray[np.bool_] | None) -> None:
        """Set which cells are closed, though nothing stands there: keep-out zones. No sensor clears them.

        Args:
            closed: Shape (rows, columns); None: no cell.
        """
        if closed is not None or self._closed is not None:
            self._closed, self._master = None if closed is None else closed.astype(np.uint8), None

    def static_master(self) -> Cells:
        """Return the costs of the static layer alone, with what zones close, inflated."""
        master = self._walls()
        _cells.inflate(master, self._reach, self._table)
        return master

    def add_rays(self, source: str, rays: Rays, robot: Pose2, *, only_marks_at: float | None = None) -> None:
        """Take one scan of one sensor: clear along its rays, then mark their ends.

        Args:
            source: Name of the sensor; it has a layer of its own.
            rays: The scan, in the frame of this costmap.
            robot: base_footprint in the frame of this costmap; what lies under it is free.
            only_marks_at: When the scan was made, in seconds, if its rays clear nothing: its marks go by
                :meth:`forget`.

        Source:
            REFERENCE 7.4, update order.
        """
        if self._rolling:
            self.roll_to(robot)
        marks = self._layers.get(source)
        if marks is None:
            marks = self._layers[source] = np.zeros(self._static.shape, np.uint8)
        params = self._of_source(source)
        clears = only_marks_at is None and params.clearing
        if only_marks_at is not None:
            self._newest[source] = only_marks_at
        feet = self._feet if source in BODY_REACH_M else None
        _cells.take_rays(
            marks,
            self._frame,
            (rays.x, rays.y),
            rays.ends,
            rays.ranges,
            (
                max(rays.nearest, CLEARED_FROM.get(source, 0.0)),
                float(params.raytrace_range) if clears else 0.0,
            ),
            float(min(params.obstacle_range, rays.farthest)) if params.marking else 0.0,
            _NO_POINTS if feet is None else feet,
            0.0 if feet is None else _FEET_M,
        )
        self.clear_footprint(robot)

    def update_feet(self, laser: Rays, known: NDArray[np.bool_] | None = None) -> None:
        """Take a scan of the laser alone: what the camera saw above feet that have gone has gone, too.

        So the marks of people who walked by do not stay where the camera does not look any more. A table top
        stays over its legs, and what hangs on a wall of the map stays, too.

        Args:
            laser: The scan, in the frame of this costmap; what is out of range reads as a far hit.
            known: Which beams end at something of the map, shape (n,); nobody stands on that. None: no beam.
        """
        are_feet = np.ones(len(laser.ends), bool) if known is None else ~known
        self._feet = laser.ends[are_feet]
        ends = to_cells(laser.ends, self._frame)
        origin_u = (laser.x - self.origin_x) / self.resolution
        origin_v = (laser.y - self.origin_y) / self.resolution
        reach = self._parameters.raytrace_range / self.resolution
        for source, near_m in BODY_REACH_M.items():
            if source in self._layers:
                near = near_m / self.resolution
                _cells.forget_what_left(self._layers[source], origin_u, origin_v, ends, are_feet, near, reach)
                self._master = None

    def clear_footprint(self, robot: Pose2) -> None:
        """Set what the sensors marked under the robot to free, but for what it touches: it stands there."""
        for source, marks in self._layers.items():
            if source not in _FELT:
                _cells.clear_outline(marks, self._frame, self._true_footprint, robot.x, robot.y, robot.yaw)
        self._master = None

    def clear_disc(
        self, sources: Iterable[str], place: tuple[float, float], radius: float, *, above_feet: bool = False
    ) -> None:
        """Set what some sensors marked round a place to free.

        Args:
            sources: Names of the sensors.
            place: x, y in the frame of this costmap, metres.
            radius: Cells whose centres are so near are cleared, metres.
            above_feet: Whether only what stands on feet is cleared.
        """
        reach = math.ceil(radius / self.resolution)
        row, column = self._row(place[1]), self._column(place[0])
        first_row, first_column = max(0, row - reach), max(0, column - reach)
        rows = np.arange(first_row, min(self._static.shape[0], row + reach + 1))
        columns = np.arange(first_column, min(self._static.shape[1], column + reach + 1))
        dx = self.origin_x + (columns + 0.5) * self.resolution - place[0]
        dy = self.origin_y + (rows + 0.5) * self.resolution - place[1]
        near = np.hypot(dx[None, :], dy[:, None]) <= radius
        for marks in (self._layers[source] for source in sources if source in self._layers):
            window = marks[first_row : first_row + len(rows), first_column : first_column + len(columns)]
            window[near & (window <= CLEARABLE if above_feet else True)] = 0
        self._master = None

    def add_contact(self, robot: Pose2, now: float) -> None:
        """Mark what the robot touched with its front; no ray clears that.

        Args:
            robot: base_footprint when it touched, in the frame of this costmap.
            now: Seconds.
        """
        self.mark(CONTACTS, moved_points(_BUMPER_ARC, robot), now)

    def mark(self, source: str, points: NDArray[np.float64], now: float) -> None:
        """Mark points, shape (n, 2), metres in the frame of this costmap, in a layer that no ray clears.

        Args:
            source: Name of the layer.
            points: Where.
            now: Seconds.
        """
        self._newest[source] = now
        marks = self._layers.setdefault(source, np.zeros(self._static.shape, np.uint8))
        _cells.mark_points(marks, to_cells(points, self._frame), np.ones(len(points), bool))
        self._master = None

    def marked_at(self, source: str, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell at which points, shape (n, 2), metres, a layer has marks; shape (n,)."""
        marks = self._layers.get(source)
        if marks is None:
            return np.zeros(len(points), np.bool_)
        costs = self.costs_at(points, marks)
        marked: NDArray[np.bool_] = (costs > 0) & (costs < UNKNOWN_COST)
        return marked

    def stands_at(self, points: NDArray[np.float64], *, of_map: bool) -> NDArray[np.bool_]:
        """Tell at which points, shape (n, 2), metres, something stands: of the map, seen or touched.

        Args:
            points: Where.
            of_map: Whether only the map counts, with its keep-out zones.

        Returns:
            Shape (n,).
        """
        stands: NDArray[np.bool_] = self.costs_at(points, self._walls()) == LETHAL
        if not of_map:
            for source in self._layers.keys() - {TIGHT}:
                stands |= self.marked_at(source, points)
        return stands

    def forget(self, sources: Iterable[str], before: float) -> None:
        """Forget what no ray clears, when its newest mark was made before a moment: it may be gone.

        Args:
            sources: Names of layers that no ray clears.
            before: Seconds.
        """
        for source in sources:
            if self._newest.get(source, -math.inf) < before and self._layers.pop(source, None) is not None:
                self._master = None

    def roll_to(self, robot: Pose2) -> None:
        """Shift a rolling costmap so that the robot is in its middle; what leaves it is forgotten."""
        before_x, before_y = self.origin_x, self.origin_y
        self._set_origin(robot.x, robot.y)
        du = round((self.origin_x - before_x) / self.resolution)
        dv = round((self.origin_y - before_y) / self.resolution)
        if du or dv:
            self._layers = {name: _shifted(marks, dv, du) for name, marks in self._layers.items()}
            if self._closed is not None:
                self._closed = _shifted(self._closed, dv, du)
            self._master = None

    def reset_outside(self, x: float, y: float, side: float, sources: Collection[str] | None = None) -> None:
        """Forget what the sensors marked outside of a square window around a point.

        What was touched or could not be driven stays: no sensor would mark it again. A side of zero forgets
        everything, that too.

        Args:
            x: Metres.
            y: Metres.
            side: Of the window, metres.
            sources: Names of the sensors; None: all.

        Source:
            REFERENCE 7.3, ClearCostmap.
        """
        wanted = self._layers if sources is None else sources
        rows, columns = self._static.shape
        half = side / 2.0
        first_u, last_u = self._column(x - half), self._column(x + half)
        first_v, last_v = self._row(y - half), self._row(y + half)
        for source, marks in self._layers.items():
            if source not in wanted or (source in _FELT and side > 0.0):
                continue
            kept = marks[
                max(0, first_v) : max(0, min(rows, last_v)), max(0, first_u) : max(0, min(columns, last_u))
            ]
            kept = kept.copy()
            marks[:] = 0
            if side > 0.0 and kept.size:
                v, u = max(0, first_v), max(0, first_u)
                marks[v : v + kept.shape[0], u : u + kept.shape[1]] = kept
        self._master = None

    def reset_inside(self, x: float, y: float, side: float) -> None:
        """Forget what the sensors marked, and what was touched, inside of a square window (metres)."""
        half = side / 2.0
        rows = slice(max(0, self._row(y - half)), max(0, self._row(y + half)))
        columns = slice(max(0, self._column(x - half)), max(0, self._column(x + half)))
        for marks in self._layers.values():
            marks[rows, columns] = 0
        self._master = None

    def clear_unknown(self, x: float, y: float, side: float) -> None:
        """Take what the map does not know for free inside of a square window (metres) around a point."""
        half = side / 2.0
        rows = slice(max(0, self._row(y - half)), max(0, self._row(y + half) + 1))
        columns = slice(max(0, self._column(x - half)), max(0, self._column(x + half) + 1))
        window = self._static[rows, columns]
        window[window == UNKNOWN_COST] = FREE_COST
        self._master = None

    def _column(self, x: float) -> int:
        return math.floor((x - self.origin_x) / self.resolution)

    def _row(self, y: float) -> int:
        return math.floor((y - self.origin_y) / self.resolution)

    def cell_of(self, x: float, y: float) -> tuple[int, int] | None:
        """Return the (row, column) of a point, None outside."""
        row, column = self._row(y), self._column(x)
        inside = 0 <= row < self._static.shape[0] and 0 <= column < self._static.shape[1]
        return (row, column) if inside else None

    def distances_to(self, x: float, y: float) -> NDArray[np.float64]:
        """Return how far the middle of each cell is from a point, metres; shape (rows, columns)."""
        rows, columns = self._static.shape
        dx = self.origin_x + (np.arange(columns) + 0.5) * self.resolution - x
        dy = self.origin_y + (np.arange(rows) + 0.5) * self.resolution - y
        return np.hypot(dx[None, :], dy[:, None])

    def cost_at(self, x: float, y: float) -> int:
        """Return the cost at a point; 255 (unknown) outside."""
        cell = self.cell_of(x, y)
        return UNKNOWN_COST if cell is None else int(self.master[cell])

    def costs_at(self, points: NDArray[np.float64], of: Cells | None = None) -> NDArray[np.uint8]:
        """Return the costs at points; 255 (unknown) outside. Shape (n,).

        Args:
            points: Shape (n, 2), metres.
            of: Other costs on the same cells, such as those of the map alone.
        """
        costs: NDArray[np.uint8] = _cells.costs_at(
            self.master if of is None else of,
            self.origin_x,
            self.origin_y,
            self.resolution,
            np.ascontiguousarray(points),
        )
        return costs

    def footprint_cost(self, pose: Pose2, *, unknown_blocks: bool = False) -> int:
        """Return the greatest cost under the padded footprint at a pose, -1 when it collides."""
        cost: int = _cells.footprint_cost(
            self.master,
            self.origin_x,
            self.origin_y,
            self.resolution,
            pose.x,
            pose.y,
            pose.yaw,
            self.footprint.outline(self.resolution / 2.0),
            unknown_blocks,
        )
        return cost

    def to_grid(self) -> OccupancyGrid:
        """Return the costs as an occupancy grid: 100 lethal, 99 inscribed, 1..98 decaying, -1 unknown."""
        costs = np.arange(256)
        scale = np.where(costs > 0, 1 + 97 * (costs - 1) // 251, 0)
        scale[INSCRIBED], scale[LETHAL], scale[UNKNOWN_COST] = 99, 100, -1
        cells = scale.astype(np.int8)[self.master]
        return OccupancyGrid(self.resolution, Pose2(self.origin_x, self.origin_y), cells)


def _static_costs(grid: OccupancyGrid, parameters: CostmapParameters) -> Cells:
    costs = np.zeros(grid.cells.shape, np.uint8)
    costs[grid.cells >= parameters.lethal_cost_threshold] = LETHAL
    if parameters.track_unknown_space:
        costs[grid.cells < 0] = UNKNOWN_COST
    return costs


def _shifted(marks: Cells, dv: int, du: int, shape: tuple[int, ...] | None = None) -> Cells:
    """Return the array whose cell [v, u] is the old [v + dv, u + du], of the old shape when none is given."""
    result = np.zeros(marks.shape if shape is None else shape, marks.dtype)
    rows, columns = marks.shape
    source = marks[max(0, dv) : max(0, rows, dv), max(0, du) : max(0, columns, du)]
    v, u = max(0, -dv), max(0, -du)
    target = result[v : v + source.shape[0], u : u + source.shape[1]]
    target[:] = source[: target.shape[0], : target.shape[1]]
    return result
