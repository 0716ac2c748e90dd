"""Proposes rooms on a map: where they are, and where the robot is to stand in each.

A door is a gap in a thin wall. Furniture leaves gaps of the same width, but stands against a wall, or is
deep: only what has free floor close on both sides is a wall that can have a door. Gaps of doors are closed,
and so are narrower ones: the laser sees through a wall where a mirror hangs. What is still connected then is
a room.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import Point, Polygon
from florence_bt.core.sensing import OCCUPIED, OccupancyGrid
from florence_bt.skills.navigation.mapping.wall_direction import turned, wall_direction
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, Footprint, corners_from_flat
from florence_bt.skills.robot_description.room import FOOTPRINT_PADDING_M

BoolGrid = NDArray[np.bool_]
Cell = tuple[int, int]

ROBOT_RADIUS_M = Footprint.from_corners(
    corners_from_flat(FLORENCE_FOOTPRINT), FOOTPRINT_PADDING_M
).circumscribed_radius
"""Radius that Florence's robot needs around its middle to turn, metres."""
DOOR_M = 0.5, 0.95, 1.2
"""Width of a door at least, ordinarily, and at most: 0.6, 0.85 and 1.1 m, and two cells of a map."""
_THICKEST_M = 0.3
"""A wall inside of a home is at most so thick on the map."""
_THIN_M, _STRAIGHT_M = 0.3, 0.5
"""So long is a wall with a door in it thin beside the door, and straight whatever stands there,"""
_CORNER_M = 0.2
"""or so long, where what is beyond a door of ordinary width goes straight on in its line,"""
_STUB_M = 0.1
"""or else thin for so long on both sides."""
_SLENDER = 1.5
"""It is so many times as long as it is thick."""
_HINGE_M = 0.15
"""So broad is what an open leaf hides of its own wall."""
_LEAF_M = 0.2
"""The length of a leaf differs so much at most from the width of its door, and its hinge is so near to it."""
_LEG_M = 0.45
"""Smaller pieces that stand alone are legs of furniture, columns, or nothing."""
_STOOL_M, _BROAD, _SOLID = 0.8, 2.5, 0.5
"""So are pieces of at most this size, less than so many times as long as broad, that fill more than such a
share of the rectangle round them: walls that meet do not."""
_OUTSIDE_M = 0.4
"""Least breadth of an outside."""
_ROOM_M2 = 1.5
"""Free floor below which a place is no room; chosen: a toilet has as much."""
_PASSES_M = 0.17
"""The robot gets through where so much is free to both sides."""
_FREE_M = 0.6
"""More free floor around a hotspot is no better."""
_CENTRE_WEIGHT = 0.1
"""Metres of free floor that a metre from the middle of the room is worth. Chosen."""
_VIEW_RAD = math.radians(57.0)
"""Of the Kinect. Source: REFERENCE 5.2."""
_MOST_SEEN = 2000
"""So many cells of a room tell where the most of it is."""
_FOREIGN_M2 = 0.05
"""A rectangle is the outline of a room when it has less of the floor of other rooms."""
_SLIT_M, _NOTCH_M, _OFF_M = 0.15, 0.5, 0.15
"""Widths below which nothing sticks out of an outline, or into it, and no corner is made."""


@dataclass(frozen=True, slots=True, eq=False)
class ProposedRoom:
    """A room that a map seems to have.

    Attributes:
        pose: Where the robot fits and can turn, looking at the most of the room; map frame.
        polygon: The corners in order, metres, map frame.
        area: Of its known free floor, m^2.
    """

    pose: Pose2
    polygon: Polygon
    area: float


@dataclass(frozen=True, slots=True)
class _WallPiece:
    """A thin piece of wall: its first and last cell (row, column), its length and thickness in cells."""

    ends: tuple[Cell, Cell]
    length: int
    thickness: float


@dataclass(frozen=True, slots=True)
class _Gap:
    """A gap that may be a door, or a hole in a wall, in cells of the turned map, (row, column) each.

    Attributes:
        along: Axis of the wall: 1 for rows, 0 for columns.
        start: The end of the wall.
        stop: What is on the other side.
        pieces: The thin pieces of wall beside it.
        cells: What the gap covers: rows and columns.
    """

    along: int
    start: Cell
    stop: Cell
    pieces: tuple[_WallPiece, ...]
    cells: tuple[slice, slice]

    @property
    def width(self) -> int:
        return abs(self.stop[self.along] - self.start[self.along]) - 1

    @property
    def wall(self) -> int:
        """Measure the wall beside it, cells."""
        return sum(piece.length for piece in self.pieces)

    @property
    def thickness(self) -> float:
        """Measure the thinnest piece of that wall, cells."""
        return min(piece.thickness for piece in self.pieces)

    def transposed(self) -> _Gap:
        pieces = tuple(
            replace(piece, ends=(piece.ends[0][::-1], piece.ends[1][::-1])) for piece in self.pieces
        )
        return _Gap(1 - self.along, self.start[::-1], self.stop[::-1], pieces, self.cells[::-1])


def propose_rooms(grid: OccupancyGrid, robot_radius: float = ROBOT_RADIUS_M) -> list[ProposedRoom]:
    """Propose the rooms of a map, the largest first.

    Args:
        grid: The map.
        robot_radius: What the robot needs around its middle to turn, metres.

    Returns:
        The rooms in which the robot can stand; their polygons do not overlap by more than a cell.
    """
    from florence_bt.core.table_legs import with_tables

    angle = wall_direction(grid)
    straight = turned(grid, -angle)
    free = _floor(straight)
    # A drive finds tables by their legs on the map as it is: in the turned one they may stand otherwise.
    clearance, standing = _standing(turned(with_tables(grid), -angle), free, robot_radius)
    labels = _regions(straight, free, standing)
    back = Pose2(0.0, 0.0, angle)
    rooms = []
    for label in np.unique(labels[labels > 0]):
        room = labels == label
        pose = _hotspot(straight, room, np.where(room & standing, clearance, -np.inf))
        polygon = tuple(back.apply(*corner) for corner in _outline(straight, room, labels))
        rooms.append(ProposedRoom(back @ pose, polygon, float(room.sum()) * grid.resolution**2))
    return sorted(rooms, key=lambda room: -room.area)


def _standing(
    grid: OccupancyGrid, free: BoolGrid, robot_radius: float
) -> tuple[NDArray[np.float64], BoolGrid]:
    """Return how far the next thing is from each cell, metres, and where the robot can stand and get to.

    Args:
        grid: The map with its tables.
        free: Its floor, shape (rows, columns).
        robot_radius: Metres.
    """
    from scipy import ndimage

    blocked = (grid.cells > OCCUPIED // 2) | (grid.cells < 0) | ~free
    clearance = ndimage.distance_transform_edt(~blocked) * grid.resolution
    passable, count = ndimage.label(clearance >= _PASSES_M)
    stands = clearance >= robot_radius
    sizes = np.bincount(passable[stands], minlength=count + 1)
    sizes[0] = 0
    return clearance, stands & (passable == int(np.argmax(sizes))) & bool(sizes.any())


def _floor(grid: OccupancyGrid) -> BoolGrid:
    """Return the free cells, and what stands alone on them and is small."""
    from scipy import ndimage

    free = (grid.cells >= 0) & (grid.cells <= OCCUPIED // 2)
    pieces, _ = ndimage.label(~free, np.ones((3, 3)))
    for number, place in enumerate(ndimage.find_objects(pieces), 1):
        piece = pieces[place] == number
        short, long = sorted(side * grid.resolution for side in piece.shape)
        is_stool = long < _BROAD * short and piece.mean() > _SOLID
        if long <= (_STOOL_M if is_stool else _LEG_M) + 1e-9:
            free[place] |= piece
    return free & ~_outside(grid, free)


def _outside(grid: OccupancyGrid, free: BoolGrid) -> BoolGrid:
    """Tell which free cells lie outside: seen through a window, with walls to less than three sides."""
    from scipy import ndimage

    wall = ndimage.binary_dilation(grid.cells > OCCUPIED // 2, np.ones((3, 3)))
    sides = np.zeros(free.shape, int)
    for axis, view in ((0, np.s_[:, :]), (0, np.s_[::-1, :]), (1, np.s_[:, :]), (1, np.s_[:, ::-1])):
        sides[view] += _meets(free[view], wall[view], axis)
    side = max(1, round(_OUTSIDE_M / grid.resolution))
    pieces, _ = ndimage.label(ndimage.binary_opening(free & (sides < 3), np.ones((side, side))))
    large = np.bincount(pieces.ravel()) * grid.resolution**2 >= _ROOM_M2
    large[0] = False
    outside: BoolGrid = large[pieces]
    return outside


def _meets(free: BoolGrid, wall: BoolGrid, axis: int) -> BoolGrid:
    """Tell which cells have a wall as the next thing along an axis."""
    length = free.shape[axis]
    place = np.arange(length).reshape((-1, 1) if axis == 0 else (1, -1))
    following = np.flip(np.minimum.accumulate(np.flip(np.where(free, length - 1, place), axis), axis), axis)
    met: BoolGrid = np.take_along_axis(wall, following, axis)
    return met


def _regions(grid: OccupancyGrid, free: BoolGrid, standing: BoolGrid) -> NDArray[np.int32]:
    """Label the free cells by rooms, from 1 on; 0 where no room is."""
    from scipy import ndimage

    walls, resolution = grid.cells > OCCUPIED // 2, grid.resolution
    along_y = _Rows(free.T, walls.T, resolution).gaps()
    gaps = [*_Rows(free, walls, resolution).gaps(), *(gap.transposed() for gap in along_y)]
    gaps = _doors(gaps, resolution)
    open_floor = free.copy()
    for gap in gaps:
        open_floor[gap.cells] = False
    labels, count = ndimage.label(open_floor)
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * resolution**2
    room = np.bincount(labels[standing], minlength=count + 1) > 0
    # What is no room of its own belongs to the one beyond the least certain of its doors.
    target = np.arange(count + 1)
    for gap in sorted(gaps, key=lambda gap: gap.wall):
        roots = {int(target[label]) for label in _beside(labels, gap)}
        largest, *rest = sorted(roots, key=lambda root: -sizes[root]) or [0]
        for root in rest:
            if sizes[root] < _ROOM_M2 or not room[root]:
                sizes[largest] += sizes[root]
                room[largest] |= room[root]
                target[target == root] = largest
    kept = np.where(room[target] & (sizes[target] >= _ROOM_M2), target, 0)
    kept[0] = 0
    merged: NDArray[np.int32] = kept[labels].astype(np.int32)
    return merged


def _beside(labels: NDArray[np.int32], gap: _Gap) -> set[int]:
    """Return the regions that a gap touches."""
    rows, columns = (slice(max(0, side.start - 1), side.stop + 1) for side in gap.cells)
    return set(np.unique(labels[rows, columns]).tolist()) - {0}


class _Rows:
    """The map as if all its walls ran along rows, in which gaps beside them are found.

    Args:
        floor: Free cells, shape (rows, columns).
        walls: Occupied cells, the same shape.
        resolution: Metres per cell.
    """

    def __init__(self, floor: BoolGrid, walls: BoolGrid, resolution: float) -> None:
        from scipy import ndimage

        self._floor, self._walls = floor, walls
        self._per_metre = 1.0 / resolution
        thin, self._wide = _thin(floor, self._cells(_THICKEST_M))
        # Cells above each other are no piece of wall: they may be bumps in one that runs across.
        self._labels, _ = ndimage.label(thin, [[1, 0, 1], [1, 1, 1], [1, 0, 1]])
        places = enumerate(ndimage.find_objects(self._labels), 1)
        self._pieces = [_piece(self._labels, number, place) for number, place in places]

    def _cells(self, length: float) -> int:
        return round(length * self._per_metre)

    def gaps(self) -> Iterator[_Gap]:
        """Find the gaps that may be doors, and those too narrow for one."""
        for piece in self._pieces:
            for (row, end), step in zip(piece.ends, (-1, 1), strict=True):
                gap = self._gap(piece, row, end, step)
                if gap is not None:
                    yield gap

    def _gap(self, piece: _WallPiece, row: int, end: int, step: int) -> _Gap | None:
        """Return the gap at an end of a piece, to the right for a step of 1; None when there is none."""
        rows, last = slice(max(0, row - 1), row + 2), self._floor.shape[1] - 1
        _, ordinary, most = map(self._cells, DOOR_M)
        begin = self._behind_leaf(row, rows, end + step, step)
        ahead = np.arange(begin, begin + step * (most + 2), step)
        open_floor = self._floor[rows, ahead[(ahead >= 0) & (ahead <= last)]].all(axis=0)
        width = int(np.argmin(open_floor)) if not open_floor.all() else 0
        if not 0 < width <= most:
            return None
        stop = begin + step * width
        beyond = np.arange(stop, stop + step * (self._cells(_HINGE_M) + 1), step).clip(0, last)
        beyond = beyond[np.cumsum(self._wide[row, beyond]) == 0]
        others = [self._pieces[label - 1] for label in np.unique(self._labels[rows, beyond]) if label]
        longest = max((other.length for other in others), default=0)
        straight = self._cells(_STRAIGHT_M)
        before, after = (
            _goes_on(self._walls[rows], at, way * straight) for at, way in ((end, -step), (stop, step))
        )
        is_wall = before and piece.length >= max(self._cells(_THIN_M), _SLENDER * piece.thickness)
        in_line = after and piece.length >= self._cells(_CORNER_M) and width <= ordinary
        if not (is_wall or in_line or min(piece.length, longest) >= self._cells(_STUB_M)):
            return None
        if width > ordinary and piece.length + longest < width:
            return None  # Two pieces of furniture leave such a gap: a wide door has as much wall beside it.
        where = (rows, slice(min(begin, stop + 1), max(begin + 1, stop)))
        return _Gap(1, (row, begin - step), (row, stop), (piece, *others), where)

    def _behind_leaf(self, row: int, rows: slice, begin: int, step: int) -> int:
        """Return the first column of open floor behind an open leaf, which is on one side of the wall."""
        for column in range(begin, begin + step * self._cells(_HINGE_M), step):
            inside = 0 < column < self._floor.shape[1] - 1
            # What is on both sides is another wall.
            if not inside or self._wide[row, column] or self._floor[rows, column].all():
                return column
        return begin + step * self._cells(_HINGE_M)


def _goes_on(walls: BoolGrid, start: int, length: int) -> bool:
    """Tell whether something goes on along some rows from a column, to the left for a length below zero."""
    columns = np.arange(start, start + length, 1 if length > 0 else -1).clip(0, walls.shape[1] - 1)
    return int(np.count_nonzero(walls[:, columns].any(axis=0))) >= abs(length) - 1


def _piece(labels: NDArray[np.int32], number: int, place: tuple[slice, slice]) -> _WallPiece:
    """Describe a piece of wall that runs along its row."""
    rows, columns = place
    cells = labels[place] == number
    first, last = (rows.start + int(np.mean(np.flatnonzero(cells[:, at]))) for at in (0, -1))
    length = columns.stop - columns.start
    return _WallPiece(((first, columns.start), (last, columns.stop - 1)), length, int(cells.sum()) / length)


def _thin(floor: BoolGrid, thickest: int) -> tuple[BoolGrid, BoolGrid]:
    """Tell which cells have floor close on both sides, above and below, and which on neither side."""
    rows = floor.shape[0]
    number = np.arange(rows)[:, None]
    below = number - np.maximum.accumulate(np.where(floor, number, -rows), axis=0)
    above = np.minimum.accumulate(np.where(floor, number, 2 * rows)[::-1], axis=0)[::-1] - number
    return ~floor & (above + below - 1 <= thickest), (above > thickest) & (below > thickest)


def _doors(gaps: list[_Gap], resolution: float) -> list[_Gap]:
    """Leave out the gaps beside open leaves: what has the length of the door at its foot.

    More wall is beside the door than beside the gap, not counting a leaf that is thinner than that wall.
    """
    near, narrowest, longest = _LEAF_M / resolution, DOOR_M[0] / resolution, DOOR_M[-1] / resolution

    def is_leaf(piece: _WallPiece, gap: _Gap) -> bool:
        return piece.length <= longest and any(
            other.along != gap.along
            and other.width >= narrowest
            and other.wall > gap.wall - piece.length * (piece.thickness < other.thickness)
            and abs(other.width - piece.length) <= near
            and min(math.dist(a, b) for a in piece.ends for b in (other.start, other.stop)) <= near
            for other in gaps
        )

    return [gap for gap in gaps if not any(is_leaf(piece, gap) for piece in gap.pieces)]


def _hotspot(grid: OccupancyGrid, room: BoolGrid, clearance: NDArray[np.float64]) -> Pose2:
    """Choose where the robot stands: with floor around it, near the middle, looking at most of the room."""
    rows, columns = np.nonzero(room)
    every = max(1, len(rows) // _MOST_SEEN)
    rows, columns = rows[::every], columns[::every]
    middle = rows.mean(), columns.mean()
    y, x = np.ogrid[: room.shape[0], : room.shape[1]]
    away = np.hypot(y - middle[0], x - middle[1]) * grid.resolution
    best = np.argmax(np.minimum(clearance, _FREE_M) - _CENTRE_WEIGHT * away)
    row, column = np.unravel_index(int(best), room.shape)
    bearings = np.arctan2(rows - row, columns - column)
    around = np.arange(-math.pi, math.pi, math.radians(10.0))
    off = np.abs((bearings[None, :] - around[:, None] + math.pi) % math.tau - math.pi)
    yaw = float(around[int(np.argmax((off <= _VIEW_RAD / 2).sum(axis=1)))])
    return Pose2(*_place(grid, row + 0.5, column + 0.5), yaw)


def _place(grid: OccupancyGrid, row: float, column: float) -> Point:
    return grid.origin.x + float(column) * grid.resolution, grid.origin.y + float(row) * grid.resolution


def _outline(grid: OccupancyGrid, room: BoolGrid, labels: NDArray[np.int32]) -> Polygon:
    """Return the outline of a room: a rectangle along the walls, unless that would cut into another room."""
    import cv2

    def kernel(length: float) -> NDArray[np.uint8]:
        side = max(1, round(length / grid.resolution))
        return np.ones((side, side), np.uint8)

    opened = cv2.morphologyEx(room.astype(np.uint8), cv2.MORPH_OPEN, kernel(_SLIT_M))
    body = opened if opened.any() else room.astype(np.uint8)
    rows, columns = np.flatnonzero(body.any(axis=1)), np.flatnonzero(body.any(axis=0))
    low, high, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    others = (labels > 0) & ~room
    if others[low:high, left:right].sum() * grid.resolution**2 <= _FOREIGN_M2:
        corners = [(low, left), (low, right), (high, right), (high, left)]
        return tuple(_place(grid, *corner) for corner in corners)
    margin = max(1, round(_NOTCH_M / grid.resolution))
    closed = cv2.morphologyEx(np.pad(body, margin), cv2.MORPH_CLOSE, kernel(_NOTCH_M))
    closed = closed[margin:-margin, margin:-margin] * ~others
    # Twice as fine, so that the outline runs along the edges of cells and not through their middles.
    fine = np.pad(closed.repeat(2, axis=0).repeat(2, axis=1), 1)
    contours, _ = cv2.findContours(fine, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    outer = max(contours, key=cv2.contourArea)
    simple = cv2.approxPolyDP(outer, 2 * _OFF_M / grid.resolution, True)[:, 0, :]
    return tuple(_place(grid, (v - 0.5) / 2, (u - 0.5) / 2) for u, v in simple)
