"""Mirrors and panes of glass on a map that is made: the laser looks through, and the map has a room behind.

A *gap* is a stretch along the walls between two surfaces that face the robot: a doorway, or a mirror or a
pane. What was seen through a gap tells which of them it is:

- A mirror shows what is before it: what seems to stand behind it stands, folded over the gap, where the map
  has something; and where it is met squarely it shows the laser itself. A doorway between two rooms that are
  mirror images of each other does not.
- Glass ends the beams that meet it squarely, and none goes through; a doorway lets them through.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, OccupancyGrid
from florence_bt.skills.navigation.mapping._kernels import look_through
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.pane_evidence import MIRROR_BEAMS, Evidence
from florence_bt.skills.navigation.mapping.wall_direction import turned

_WIDTH_M = 0.45, 2.4
"""Of a gap."""
_LEAST_M, _DOORWAY_M = 0.38, 0.5
"""Of the part of a gap that shows what is before it, and of a doorway beside that."""
_END_CELLS, _OPEN = 2, 0.75
"""The surface on one side of a gap is so wide at least, on the other a cell less; and so much of the
gap shows free floor."""
_BEFORE_CELLS = 3
"""So far before a surface that faces the robot the floor is free."""
_OFFSETS_M = (0.0, -0.025, 0.025, -0.05, 0.05)
"""Places of a gap in its cell, or beside it."""
_NOT_IN_IT_M = 0.05
"""A scan from so near says nothing of a pane: the pose is not as exact."""
_BESIDE_M = 0.15
"""So much of what is beside a gap belongs to the pane: poses are not as exact as its ends."""
_SAME_M = 0.3
"""Gaps so near to each other are one."""
_TOUCH_M, _TOUCHED_M, _FRONT_M = 0.12, 0.2, 0.2
"""Distance of a touch from the gap that it belongs to; half of the width of what was touched elsewhere;
distance of the bumper before the middle of the robot."""
_BETWEEN_SCANS_M = 1.0
"""Longer ways between two kept scans are not known to be straight."""
_ACROSS_RAD = math.radians(35.0)
_ACROSS = math.cos(_ACROSS_RAD)
"""Cosine of the angle below which a thing that was met stands along the walls."""


@dataclass(frozen=True, slots=True)
class Pane:
    """A mirror or a pane of glass: nothing was seen behind it.

    Attributes:
        start: Where it begins, map frame, metres.
        end: Where it ends.
    """

    start: Point2
    end: Point2

    @property
    def middle(self) -> Point2:
        """Its middle, metres."""
        return (self.start[0] + self.end[0]) / 2.0, (self.start[1] + self.end[1]) / 2.0

    def is_near(self, other: Pane, metres: float) -> bool:
        """Tell whether both ends are so near to those of another."""
        return math.dist(self.start, other.start) <= metres and math.dist(self.end, other.end) <= metres

    def is_at(self, place: Point2) -> bool:
        """Tell whether what was touched at a place may be this."""
        (x, y), (end_x, end_y) = self.start, self.end
        along = Pose2(x, y, math.atan2(end_y - y, end_x - x))
        u, v = along.inverse().apply(*place)
        return -_TOUCH_M <= u <= math.dist(self.start, self.end) + _TOUCH_M and abs(v) <= _TOUCH_M

    def cut(self, start: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Let beams that go through it end at it, in place.

        Args:
            start: Shape (2,): where they start, map frame, metres.
            ends: Shape (n, 2): where they end.

        Returns:
            Which beams these are, shape (n,).
        """
        low = np.array(self.start)
        along = np.array(self.end) - low
        across = np.array([-along[1], along[0]]) / np.hypot(*along)
        before, behind = float((start - low) @ across), (ends - low) @ across
        through = (before * behind < 0.0) & (abs(before) > _NOT_IN_IT_M)
        share = before / np.where(through, before - behind, 1.0)
        points = start + share[:, None] * (ends - start)
        where = (points - low) @ along / (along @ along)
        through &= (where >= 0.0) & (where <= 1.0)
        ends[through] = points[through]
        return through

    def turned(self, angle: float) -> Pane:
        """Return it turned about the origin, radians."""
        turn = Pose2(0.0, 0.0, angle)
        return Pane(turn.apply(*self.start), turn.apply(*self.end))


@dataclass(frozen=True, slots=True)
class Gap:
    """A gap along the rows of a map whose walls run along its axes, metres.

    Attributes:
        across: Where it lies.
        low: Where it begins along the rows.
        high: Where it ends.
        side: 1 when it is looked at from greater values of ``across``, else -1.
    """

    across: float
    low: float
    high: float
    side: int

    def is_at(self, place: Point2) -> bool:
        """Tell whether what was touched at a place, along and across, may be in this gap."""
        u, v = place
        return self.low - _TOUCH_M <= u <= self.high + _TOUCH_M and abs(v - self.across) <= _TOUCH_M

    def part(self, low: float, high: float) -> Gap:
        """Return the part from somewhere to somewhere; or to the end, where no doorway fits beside it."""
        near_low, near_high = low - self.low < _DOORWAY_M, self.high - high < _DOORWAY_M
        return replace(self, low=self.low if near_low else low, high=self.high if near_high else high)

    def overlaps(self, other: Gap) -> bool:
        """Tell whether another one is the same, or in part."""
        beside = self.high < other.low or other.high < self.low
        return not beside and abs(self.across - other.across) <= _SAME_M


@dataclass(frozen=True, slots=True)
class BeamMap:
    """A map whose walls run along its axes, and the beams of which it consists; perhaps with x and y swapped.

    Attributes:
        cells: Shape (rows, columns), of the map.
        origin: Of cell [0, 0], metres along a row and across.
        resolution: Metres per cell.
        starts: Shape (n, 2): where the beams of each scan start, metres along a row and across.
        ends: Shape (m, 2): where those end that met something.
        first: Shape (n + 1,): the first beam of each scan.
    """

    cells: NDArray[np.int8]
    origin: Point2
    resolution: float
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    first: NDArray[np.int64]

    @staticmethod
    def of(grid: OccupancyGrid, scans: Sequence[KeptScan], poses: Sequence[Pose2]) -> BeamMap:
        """Move scans to the map.

        Args:
            grid: The map.
            scans: The scans.
            poses: base_footprint in the map at each.
        """
        starts, first = np.zeros((len(scans), 2)), np.zeros(len(scans) + 1, np.int64)
        ends = [np.zeros((0, 2))]
        for number, (scan, pose) in enumerate(zip(scans, poses, strict=True)):
            c, s = math.cos(pose.yaw), math.sin(pose.yaw)
            turn, place = np.array([[c, s], [-s, c]]), (pose.x, pose.y)
            starts[number] = scan.start.astype(float) @ turn + place
            ends.append(scan.points.astype(float) @ turn + place)
            first[number + 1] = first[number] + len(ends[-1])
        place = grid.origin.x, grid.origin.y
        return BeamMap(grid.cells, place, grid.resolution, starts, np.concatenate(ends), first)

    def swapped(self) -> BeamMap:
        """Return the same with x and y swapped."""
        cells, x, y = np.ascontiguousarray(self.cells.T), *self.origin
        starts, ends = (np.ascontiguousarray(each[:, ::-1]) for each in (self.starts, self.ends))
        return BeamMap(cells, (y, x), self.resolution, starts, ends, self.first)

    def look(self, gap: Gap) -> Evidence:
        """Tell what was seen through a gap."""
        place = gap.across, gap.low, gap.high
        seen = self.starts, self.ends, self.first
        return look_through(self.cells, self.origin, self.resolution, place, gap.side, *seen)

    def gaps(self) -> Iterator[Gap]:
        """Yield the gaps along the rows."""
        least, most = (round(width / self.resolution) for width in _WIDTH_M)
        something, free = self.cells > OCCUPIED // 2, self.cells == FREE
        near = something | _further(something, 1) | _further(something, -1)
        opened = np.cumsum(np.pad(free & ~near, ((0, 0), (1, 0))), axis=1)
        for side in (-1, 1):
            faces = near & _further(free, side * _BEFORE_CELLS) & _further(free, side * (_BEFORE_CELLS + 1))
            edges = np.diff(np.pad(faces.astype(np.int8), ((0, 0), (1, 1))), axis=1)
            # Row, first column and end of each surface.
            rows, starts = np.nonzero(edges > 0)
            _, ends = np.nonzero(edges < 0)
            low, high, row = ends[:-1], starts[1:], rows[:-1]
            wide = np.minimum(ends - starts, _END_CELLS)
            fits = (rows[1:] == row) & (wide[1:] + wide[:-1] >= 2 * _END_CELLS - 1)
            fits &= (high - low >= least) & (high - low <= most)
            low, high, row = low[fits], high[fits], row[fits]
            is_open = opened[row, high] - opened[row, low] >= _OPEN * (high - low)
            for place in np.flatnonzero(is_open).tolist():
                yield Gap(
                    self.origin[1] + (row[place] + 0.5) * self.resolution,
                    self.origin[0] + low[place] * self.resolution,
                    self.origin[0] + high[place] * self.resolution,
                    side,
                )


def find_panes(
    grid: OccupancyGrid,
    angle: float,
    scans: Sequence[KeptScan],
    poses: Sequence[Pose2],
    touches: Sequence[Pose2] = (),
    known: Sequence[Pane] = (),
) -> list[Pane]:
    """Find the mirrors and panes of a map.

    Args:
        grid: The map as it was seen, with rooms behind mirrors.
        angle: By which its walls are turned to run along its axes, radians.
        scans: Of which it consists.
        poses: base_footprint at each of them, map frame.
        touches: base_footprint where the bumper met something, turned towards that.
        known: Panes that were found before.

    Returns:
        The panes; what was touched is one where the map shows nothing. Where the robot has driven through
        there is none.
    """
    straight, turn = turned(grid, angle), Pose2(0.0, 0.0, angle)
    view = BeamMap.of(straight, scans, [turn @ pose for pose in poses])
    felt = [turn @ touch for touch in touches]
    panes = []
    for swap in (False, True):
        felt_at = [_felt(touch, swap=swap) for touch in felt]
        known_at = [_swapped(pane.turned(angle).middle, swap=swap) for pane in known]
        for gap in _panes_in(view.swapped() if swap else view, felt_at, known_at):
            ends = gap.low - _BESIDE_M, gap.high + _BESIDE_M
            low, high = (_swapped((each, gap.across), swap=swap) for each in ends)
            panes.append(Pane(low, high))
    for touch in felt:
        front = _front(touch)
        if not any(pane.is_at(front) for pane in panes) and not _is_known(straight, front):
            panes.append(_touched(touch))
    found = [pane.turned(-angle) for pane in panes]
    return [pane for pane in found if not _was_driven_through(pane, poses)]


def _was_driven_through(pane: Pane, poses: Sequence[Pose2]) -> bool:
    """Tell whether the robot has been on both sides of where a pane seems to be: then it is none."""
    places = np.array([(pose.x, pose.y) for pose in poses])
    if len(places) < 2:
        return False
    start, end = np.array(pane.start), np.array(pane.end)
    here, then = places[:-1], places[1:]
    across = _side(start, end, here) * _side(start, end, then) < 0.0
    between = _side(here, then, start) * _side(here, then, end) < 0.0
    near = np.hypot(*(then - here).T) <= _BETWEEN_SCANS_M
    return bool(np.any(across & between & near))


def _side(
    start: NDArray[np.float64], end: NDArray[np.float64], point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Tell on which side of a line points are, by sign; each is (2,) or (N, 2)."""
    along, there = end - start, point - start
    side: NDArray[np.float64] = along[..., 0] * there[..., 1] - along[..., 1] * there[..., 0]
    return side


class _Felt(NamedTuple):
    """A touch of a bumper: where, along and across, and how much of the heading is across, -1..1."""

    place: Point2
    across: float


def _felt(touch: Pose2, *, swap: bool) -> _Felt:
    across = math.cos(touch.yaw) if swap else math.sin(touch.yaw)
    return _Felt(_swapped(_front(touch), swap=swap), across)


def _panes_in(view: BeamMap, felt: Sequence[_Felt], known: Sequence[Point2]) -> list[Gap]:
    """Return the gaps along the rows that are mirrors or panes, the surest of those that overlap."""
    found = []
    for gap in view.gaps():
        evidence = view.look(gap)
        mirror = _mirror_in(view, gap, evidence)
        if mirror is not None and mirror[0].is_mirror(known=any(mirror[1].is_at(place) for place in known)):
            found.append(mirror)
            continue
        touched = any(gap.is_at(each.place) and each.across * gap.side <= -_ACROSS for each in felt)
        if touched or evidence.is_glass(known=any(gap.is_at(place) for place in known)):
            found.append((evidence, gap))
    kept: list[Gap] = []
    for _, gap in sorted(found, key=lambda each: -each[0].surplus):
        if not any(gap.overlaps(other) for other in kept):
            kept.append(gap)
    return kept


def _mirror_in(view: BeamMap, gap: Gap, evidence: Evidence) -> tuple[Evidence, Gap] | None:
    """Return the part of a gap that shows what is before it, where it shows that best, and what was seen."""
    if evidence.folded < MIRROR_BEAMS // 2 or evidence.high - evidence.low < _LEAST_M:
        return None
    part = gap.part(evidence.low, evidence.high)
    looks = [
        (view.look(each), each) for each in (replace(part, across=part.across + by) for by in _OFFSETS_M)
    ]
    return max(looks, key=lambda each: each[0].surplus)


def _swapped(place: Point2, *, swap: bool) -> Point2:
    return (place[1], place[0]) if swap else place


def _front(touch: Pose2) -> Point2:
    """Return what the bumper has met of a robot at a pose that is turned towards it."""
    return touch.apply(_FRONT_M, 0.0)


def _is_known(grid: OccupancyGrid, place: Point2) -> bool:
    """Tell whether the map shows something at a place."""
    row, column = grid.cell_of(*place)
    near = round(_TOUCH_M / grid.resolution)
    window = grid.cells[max(0, row - near) : row + near + 1, max(0, column - near) : column + near + 1]
    return bool((window > OCCUPIED // 2).any())


def _touched(touch: Pose2) -> Pane:
    """Return what a robot touched, along the walls when it met it nearly squarely."""
    yaw = touch.yaw
    along_walls = math.pi / 2.0 * round(yaw / (math.pi / 2.0))
    if abs(math.remainder(yaw - along_walls, math.tau)) < _ACROSS_RAD:
        yaw = along_walls
    there = Pose2(*_front(touch), yaw)
    return Pane(there.apply(0.0, -_TOUCHED_M), there.apply(0.0, _TOUCHED_M))


def _further(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Return whether it is so as many rows further on."""
    moved = np.zeros_like(cells)
    if by > 0:
        moved[:-by] = cells[by:]
    else:
        moved[-by:] = cells[:by]
    return moved
