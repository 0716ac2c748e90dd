"""Measures how well rooms are proposed, on maps that a robot could have made of generated homes.

``python -m tools.rooms --seeds 1-10 11-20 --write docs/notes/rooms.md``. A robot stands at places all over a
home and turns once; what its laser meets is drawn into a map whose axes are not those of the walls. The homes
are kept beside the page; ``--pictures FOLDER`` draws them.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from numba import njit
from numpy.typing import NDArray

from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import cells_inside, contains
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.simulation.home.build_map import LASER_PLANE_M
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.free_space import FreeSpace, GridFrame, cells_covered
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.home.picture import draw_places
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.navigation.mapping.editing import crop
from florence_bt.skills.navigation.mapping.rooms import ProposedRoom, propose_rooms
from tools.tables import RowTable, command_of, table

NAME = "rooms"
RESOLUTION_M = 0.05
STOPS_M = 1.0
"""The robot looks round about once in each metre of its way."""
BEAMS, RANGE_M, NOISE = 1024, 5.6, 0.01
"""Of the URG-04LX, once round: REFERENCE 4.1."""
OFF_M, OFF_RAD = 0.015, 0.004
"""Standard deviations of the poses that mapping believes."""
HIT_SHARE = 0.25
"""A cell is occupied when so many of the beams that reached it ended there."""
CLEARANCE_M = 0.17
RIGHT_IOU = 0.7
_FINE_M = 0.01


def driven_map(flat: Flat, seed: int) -> tuple[OccupancyGrid, Pose2]:
    """Make the map of a drive through a home.

    Args:
        flat: The home, as it was when its own map was made.
        seed: Of the noise, and of the turn of the map's frame.

    Returns:
        The map, and the pose of its frame in the frame of the home.
    """
    rng = np.random.default_rng(seed)
    cut = [s for s in flat.mapped if s.bottom <= LASER_PLANE_M < s.top and s.surface != "glass"]
    frame = GridFrame.around(flat, _FINE_M, 0.3)
    solid = cells_covered(frame, cut)
    map_frame = Pose2(flat.start.x, flat.start.y, float(rng.uniform(-math.pi, math.pi)))
    left, low, right, high = flat.bounds
    reach = math.hypot(right - left, high - low) + RANGE_M
    size = math.ceil(2 * reach / RESOLUTION_M)
    hits, passes = np.zeros((2, size, size), np.int32)
    for x, y in _stops(flat):
        angles = np.arange(BEAMS) * (2 * math.pi / BEAMS)
        corner = (frame.x, frame.y, frame.resolution)
        ranges = _measure(solid, corner, x, y, angles, RANGE_M)
        met = ranges < RANGE_M
        ranges = np.where(met, ranges * (1.0 + NOISE * rng.standard_normal(BEAMS)), RANGE_M - 0.3)
        there = map_frame.inverse() @ Pose2(x, y)
        off = rng.standard_normal(3) * (OFF_M, OFF_M, OFF_RAD)
        believed = Pose2(there.x + off[0], there.y + off[1], there.yaw + off[2])
        _draw(hits, passes, (believed.x + reach, believed.y + reach), angles + believed.yaw, ranges, met)
    reached = hits + passes
    cells = np.where(hits > HIT_SHARE * reached, OCCUPIED, np.where(reached > 0, FREE, UNKNOWN))
    return OccupancyGrid(RESOLUTION_M, Pose2(-reach, -reach), cells.astype(np.int8)), map_frame


def _stops(flat: Flat) -> list[tuple[float, float]]:
    """Return places that the robot gets to, about evenly spread."""
    space = FreeSpace(dataclasses.replace(flat, solids=flat.mapped))
    free = space.reachable((flat.start.x, flat.start.y), CLEARANCE_M)
    x, y = space.frame.centres()
    rows, columns = np.nonzero(free)
    points = np.stack([x[columns], y[rows]], axis=1)
    stops, away = [points[0]], np.hypot(*(points - points[0]).T)
    while away.max() > STOPS_M:
        stops.append(points[int(np.argmax(away))])
        away = np.minimum(away, np.hypot(*(points - stops[-1]).T))
    return [(float(x), float(y)) for x, y in stops]


@njit(cache=True)
def _measure(solid, corner, x, y, angles, longest):  # type: ignore[no-untyped-def]
    """Return how far it is to the next solid along each angle, in steps of half a cell."""
    left, low, side = corner
    rows, columns = solid.shape
    ranges = np.full(len(angles), longest)
    for k in range(len(angles)):
        c, s = math.cos(angles[k]), math.sin(angles[k])
        for step in range(int(longest / side * 2)):
            row = math.floor((y + step * side / 2 * s - low) / side)
            column = math.floor((x + step * side / 2 * c - left) / side)
            if row < 0 or column < 0 or row >= rows or column >= columns:
                break
            if solid[row, column]:
                ranges[k] = step * side / 2
                break
    return ranges


@njit(cache=True)
def _draw(hits, passes, start, angles, ranges, met):  # type: ignore[no-untyped-def]
    """Count in which cells of 5 cm beams ended, and through which they went."""
    for k in range(len(angles)):
        c, s = math.cos(angles[k]), math.sin(angles[k])
        end_row = int((start[1] + ranges[k] * s) / 0.05)
        end_column = int((start[0] + ranges[k] * c) / 0.05)
        row, column = -1, -1
        for step in range(int(ranges[k] / 0.025)):
            at_row = int((start[1] + step * 0.025 * s) / 0.05)
            at_column = int((start[0] + step * 0.025 * c) / 0.05)
            if (at_row, at_column) != (row, column) and (at_row, at_column) != (end_row, end_column):
                row, column = at_row, at_column
                passes[row, column] += 1
        if met[k]:
            hits[end_row, end_column] += 1


@dataclass(frozen=True, slots=True)
class Judged:
    """The rooms proposed for one home, and their judgement.

    Attributes:
        seeds: The group of seeds of which it is one.
        seed: Of the home.
        overlaps: Room -> the best overlap (intersection over union) of a proposed room with it.
        proposed: How many rooms were proposed.
        misplaced: Hotspots that are in another room than their polygon, or where the robot does not fit.
        seconds: Processor time.
    """

    seeds: str
    seed: int
    overlaps: dict[str, float]
    proposed: int
    misplaced: int
    seconds: float

    @property
    def right(self) -> bool:
        """Tell whether every room was proposed, and no other."""
        return self.proposed == len(self.overlaps) and min(self.overlaps.values()) >= RIGHT_IOU


def judge(
    flat: Flat, grid: OccupancyGrid, frame: Pose2, seeds: str = "", seed: int = 0
) -> tuple[Judged, list[ProposedRoom]]:
    """Propose rooms on a map, and compare them with the truth on the free cells of the map."""
    start = time.process_time()
    rooms = propose_rooms(grid)
    seconds = time.process_time() - start
    rows, columns = np.nonzero(grid.cells == FREE)
    x, y = frame.apply(
        grid.origin.x + (columns + 0.5) * grid.resolution, grid.origin.y + (rows + 0.5) * grid.resolution
    )
    corner = (grid.origin.x, grid.origin.y)
    inside = np.array([flat.room_at(*point) is not None for point in zip(x, y, strict=True)])
    found = [
        cells_inside(room.polygon, corner, grid.resolution, grid.cells.shape)[rows, columns] & inside
        for room in rooms
    ]
    overlaps = {}
    for room in flat.rooms:
        true = (x >= room.x[0]) & (x < room.x[1]) & (y >= room.y[0]) & (y < room.y[1])
        overlaps[room.name] = max((_overlap(cells, true) for cells in found), default=0.0)
    space = FreeSpace(dataclasses.replace(flat, solids=flat.mapped))
    misplaced = 0
    for room in rooms:
        place = frame @ room.pose
        fits = space.clearance_at(place.x, place.y) >= CLEARANCE_M
        misplaced += not (fits and contains(room.polygon, room.pose.x, room.pose.y))
    return Judged(seeds, seed, overlaps, len(rooms), misplaced, seconds), rooms


def _overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    return float((one & other).sum() / max(1, (one | other).sum()))


def row_of(homes: Sequence[Judged]) -> list[str]:
    """Write the homes of some seeds as a line of the table."""
    overlaps = [overlap for home in homes for overlap in home.overlaps.values()]
    return [
        homes[0].seeds,
        f"{sum(home.right for home in homes)} of {len(homes)}",
        f"{sum(overlap >= RIGHT_IOU for overlap in overlaps)} of {len(overlaps)}",
        str(sum(home.proposed for home in homes)),
        f"{statistics.median(overlaps):.2f}",
        f"{min(overlaps):.2f}",
        str(sum(home.misplaced for home in homes)),
    ]


HEAD = ["seeds", "homes right", "rooms found", "proposed", "overlap, median", "worst", "hotspots misplaced"]


def table_of(homes: Sequence[Judged]) -> str:
    """Write the table, with a line for each group of seeds."""
    groups = dict.fromkeys(home.seeds for home in homes)
    return table(HEAD, [row_of([home for home in homes if home.seeds == group]) for group in groups])


TABLE = RowTable(NAME, Judged, table_of)


def told(home: Judged) -> str:
    """Write one home for people."""
    worst = min(home.overlaps, key=lambda name: home.overlaps[name])
    right = "right" if home.right else "wrong"
    return (
        f"home {home.seed}: {right}, {len(home.overlaps)} rooms, {home.proposed} proposed, "
        f"{worst} {home.overlaps[worst]:.2f}, {home.misplaced} hotspots misplaced, {home.seconds:.2f} s"
    )


def main(arguments: list[str] | None = None) -> int:
    """Propose, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", default=["1-10"], help="of generated homes: 7, or 1-10")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    homes = []
    for seeds in given.seeds:
        first, _, last = seeds.partition("-")
        for seed in range(int(first), int(last or first) + 1):
            flat = generated_flat(seed)
            grid, frame = driven_map(flat, seed)
            grid = crop(grid).grid
            home, rooms = judge(flat, grid, frame, seeds, seed)
            homes.append(home)
            print(told(home), flush=True)
            if given.pictures is not None:
                spots = Hotspots(
                    Hotspot(f"room_{number}", room.pose, polygon=room.polygon)
                    for number, room in enumerate(rooms, 1)
                )
                picture = draw_places(grid, spots, "png", told(home))
                replace_files({given.pictures / f"home_{seed}.png": picture}, make_folders=True)
    TABLE.publish(homes, given.write, command_of("-m tools.rooms", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
