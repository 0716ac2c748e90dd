"""Maps as a person wants them: cleaned, cut, turned, and drawn on. A grid in, a grid and what was done out.

Source: document, annex 7.3, step 6.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import Point, cells_inside, edges
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.mapping.wall_direction import turned

BoolGrid = NDArray[np.bool_]

BORDER_M = 0.25
"""Unknown ground that is left around what is known."""
SPECK_M = 0.1
"""Size up to which something that stands alone on the floor is a speck."""
ISLAND_M2 = 0.5
"""Free floor that is cut off from the rest and is smaller was seen through a gap, or by mistake."""
WALL_M = 0.1
"""The thickness of a wall that is drawn."""
_HOLE_M, _WALL_PIECE_M = 0.1, 0.3
"""So large holes are closed in walls that run straight for so long on both sides."""
_PARTS = {"wall": OCCUPIED, "occupied": OCCUPIED, "free": FREE, "unknown": UNKNOWN}
KINDS_OF_EDIT = tuple(_PARTS)


STAYS = Pose2()
"""The motion of an edit that moves nothing."""


@dataclass(frozen=True, slots=True)
class Edited:
    """A changed map.

    Attributes:
        grid: The map.
        done: What was done, for people, a line for each thing.
        move: Pose of the old frame in the new one: what is at a place then is at ``move.apply(x, y)``.
    """

    grid: OccupancyGrid
    done: tuple[str, ...]
    move: Pose2 = STAYS


def clean(grid: OccupancyGrid, speck: float = SPECK_M) -> Edited:
    """Remove what is not there: specks, holes in the floor, islands behind walls; and close holes in walls.

    Every cell becomes free, occupied or unknown. The four legs of a table stay: by them the robot keeps off.

    Args:
        grid: The map.
        speck: The size of the largest speck, metres; 0 leaves all.
    """
    from scipy import ndimage

    cells = _three_values(grid.cells)
    done = [_told(np.count_nonzero(cells != grid.cells), "between free and occupied made one of the two")]
    legs = _table_legs(grid)
    largest = int(speck / grid.resolution + 1e-6)
    for value, what in ((OCCUPIED, "removed as specks"), (UNKNOWN, "unknown in the floor made free")):
        pieces, _ = ndimage.label(cells == value, np.ones((3, 3)))
        count = 0
        for number, place in enumerate(ndimage.find_objects(pieces), 1):
            if max(side.stop - side.start for side in place) > largest:
                continue
            place = tuple(slice(max(0, side.start - 1), side.stop + 1) for side in place)
            piece = pieces[place] == number
            around = cells[place][ndimage.binary_dilation(piece, np.ones((3, 3))) & ~piece]
            if np.ptp(around) == 0 and not (value == OCCUPIED and legs[place][piece].any()):
                cells[place][piece] = around[0]
                count += int(piece.sum())
        done.append(_told(count, what))
    pieces, _ = ndimage.label(cells == FREE)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    island = (sizes * grid.resolution**2 < ISLAND_M2) & (sizes < sizes.max())
    island[0] = False
    done.append(_told(np.count_nonzero(island[pieces]), "free behind walls made unknown"))
    cells[island[pieces]] = UNKNOWN
    holes = _holes(cells == OCCUPIED, grid.resolution)
    done.append(_told(np.count_nonzero(holes), "of holes in walls made occupied"))
    cells[holes] = OCCUPIED
    told = tuple(filter(None, done))
    return Edited(replace(grid, cells=cells), told or ("nothing to clean",))


def _three_values(cells: NDArray[np.int8]) -> NDArray[np.int8]:
    known = np.where(cells > OCCUPIED // 2, OCCUPIED, FREE)
    return np.where(cells == UNKNOWN, UNKNOWN, known).astype(np.int8)


def _told(count: int | np.intp, what: str) -> str:
    return f"{count} {'cell' if count == 1 else 'cells'} {what}" if count else ""


def _table_legs(grid: OccupancyGrid) -> BoolGrid:
    """Mark where the legs of tables are."""
    from florence_bt.core.table_legs import table_legs

    legs = np.zeros(grid.cells.shape, bool)
    for x, y in table_legs(grid):
        row, column = grid.cell_of(x, y)
        legs[max(0, row - 2) : row + 3, max(0, column - 2) : column + 3] = True
    return legs


def _holes(walls: BoolGrid, resolution: float) -> BoolGrid:
    """Find the holes in walls that run straight along an axis."""
    from scipy import ndimage

    hole, piece = (max(1, round(length / resolution)) for length in (_HOLE_M, _WALL_PIECE_M))
    holes = np.zeros_like(walls)
    for along in (0, 1):
        line, gap = np.ones((piece, 1), bool), np.ones((hole + 1, 1), bool)
        straight = ndimage.binary_opening(np.moveaxis(walls, along, 0), line)
        margin = ((hole + 1, hole + 1), (0, 0))
        closed = ndimage.binary_closing(np.pad(straight, margin), gap)[hole + 1 : -hole - 1]
        holes |= np.moveaxis(closed, 0, along)
    return holes & ~walls


def crop(grid: OccupancyGrid, box: tuple[Point, Point] | None = None, margin: float = BORDER_M) -> Edited:
    """Cut a map down; places keep their coordinates.

    Args:
        grid: The map.
        box: Two opposite corners of what is kept, metres; None keeps what is known and a margin around it.
        margin: How much unknown ground is left, metres.

    Raises:
        ConfigError: Nothing of the map is in the box, or nothing is known.
    """
    rows, columns = grid.cells.shape
    if box is None:
        known = grid.cells != UNKNOWN
        if not known.any():
            raise ConfigError("the map knows nothing: nothing would be left of it")
        extra = round(margin / grid.resolution)
        (low, high), (left, right) = (
            (int(at[0]) - extra, int(at[-1]) + 1 + extra)
            for at in (np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0)))
        )
    else:
        (x0, y0), (x1, y1) = box
        low, left = grid.cell_of(min(x0, x1) + 1e-6, min(y0, y1) + 1e-6)
        high, right = (at + 1 for at in grid.cell_of(max(x0, x1) - 1e-6, max(y0, y1) - 1e-6))
    low, left, high, right = max(low, 0), max(left, 0), min(high, rows), min(right, columns)
    if low >= high or left >= right:
        raise ConfigError("nothing of the map is in this rectangle", valid=[_span(grid)])
    lost = np.count_nonzero(grid.cells != UNKNOWN)
    cells = grid.cells[low:high, left:right].copy()
    lost -= np.count_nonzero(cells != UNKNOWN)
    origin = Pose2(grid.origin.x + left * grid.resolution, grid.origin.y + low * grid.resolution)
    # To a micrometre: the sums of binary fractions have long tails.
    cut = replace(grid, origin=Pose2(round(origin.x, 6), round(origin.y, 6)), cells=cells)
    done = f"{_size(grid)} cut to {_size(cut)}, {_span(cut)}"
    return Edited(cut, tuple(filter(None, (done, _told(lost, "that were known cut off")))))


def rotate(grid: OccupancyGrid, angle: float) -> Edited:
    """Turn a map about the origin of its frame, and cut it to what is known; no wall gets a hole.

    Args:
        grid: The map.
        angle: Radians, counter-clockwise.
    """
    around = turned(grid, angle)
    before, after = (np.count_nonzero(each.cells == OCCUPIED) for each in (grid, around))
    cut = crop(around)
    done = f"turned by {np.degrees(angle):.2f} deg about (0, 0): {before} occupied cells became {after}"
    return Edited(cut.grid, (done, f"now {_size(cut.grid)}, {_span(cut.grid)}"), Pose2(0.0, 0.0, angle))


def draw(
    grid: OccupancyGrid, edits: Iterable[tuple[str, Sequence[Point]]], thickness: float = WALL_M
) -> Edited:
    """Draw on a map.

    Args:
        grid: The map.
        edits: In their order: one of :data:`KINDS_OF_EDIT`, and points in metres: a wall goes from one to
            the next; two points of the others are opposite corners of a rectangle, more those of a polygon.
        thickness: Of a wall, metres.

    Raises:
        ConfigError: There is no such edit, it has too few points, or it changes nothing on the map.
    """
    cells, done = grid.cells.copy(), []
    for kind, points in edits:
        if kind not in _PARTS:
            raise ConfigError(f"nothing can be drawn as {kind!r}", valid=closest_first(kind, KINDS_OF_EDIT))
        if len(points) < 2:
            raise ConfigError(f"{kind}: one point is nothing", valid=[f"{kind}='[[1, 2], [3, 2]]'"])
        shape = _line(grid, points, thickness) if kind == "wall" else _area(grid, points)
        if not shape.any():
            raise ConfigError(f"{kind}: no cell of the map is there", valid=[_span(grid)])
        changed = shape & (cells != _PARTS[kind])
        cells[shape] = _PARTS[kind]
        meant = "occupied" if kind == "wall" else kind
        where = f"{kind} {' '.join(f'({x:g}, {y:g})' for x, y in points)}"
        done.append(f"{where}: {_told(np.count_nonzero(changed), f'made {meant}') or f'all was {meant}'}")
    return Edited(replace(grid, cells=cells), tuple(done))


def _area(grid: OccupancyGrid, points: Sequence[Point]) -> BoolGrid:
    if len(points) == 2:
        (x0, y0), (x1, y1) = points
        points = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return cells_inside(tuple(points), (grid.origin.x, grid.origin.y), grid.resolution, grid.cells.shape)


def _line(grid: OccupancyGrid, points: Sequence[Point], thickness: float) -> BoolGrid:
    """Mark the cells whose middles are within half a thickness of a line; however thin, it has no gap."""
    rows, columns = grid.cells.shape
    x = grid.origin.x + (np.arange(columns) + 0.5) * grid.resolution
    y = (grid.origin.y + (np.arange(rows) + 0.5) * grid.resolution)[:, None]
    reach = max(thickness / 2, grid.resolution * 0.71)
    marked = np.zeros((rows, columns), bool)
    for (ax, ay), (bx, by) in list(edges(tuple(points)))[:-1]:
        squared = max((bx - ax) ** 2 + (by - ay) ** 2, 1e-12)
        share = np.clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / squared, 0.0, 1.0)
        marked |= np.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y) < reach
    return marked


def _size(grid: OccupancyGrid) -> str:
    rows, columns = grid.cells.shape
    return f"{columns} x {rows} cells"


def _span(grid: OccupancyGrid) -> str:
    rows, columns = grid.cells.shape
    x, y = grid.origin.x, grid.origin.y
    return (
        f"x {x:.2f} to {x + columns * grid.resolution:.2f} m, y {y:.2f} to {y + rows * grid.resolution:.2f} m"
    )
