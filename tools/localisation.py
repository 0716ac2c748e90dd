"""Measures how well the robot is localised on a real building's log and on generated ones.

``python tools/localisation.py --log freiburg-079-corrected.log.gz --maps depot.yaml --write PAGE``.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.localisation.localiser import Localiser
from tools.carmen_log import Record, build_map, read_log, thinned
from tools.generated_log import Conditions, corridors, drive, home, mapped
from tools.tables import RowTable, command_of, table

AT_MIDDLE = Transform3.from_pose2(Pose2())
START = Pose2(0.2, -0.15, 0.1)
"""So much is the first pose off."""
START_DEVIATIONS = (0.3, 0.3, 0.15)
STARTS, KIDNAPS, CARRIED_M = 20, 10, 5.0
STARTS_GENERATED, KIDNAPS_GENERATED = 8, 4
"""Of each generated log, of which there are more."""
SCANS_BEFORE, SCANS_AFTER = 100, 400
"""Scans of the log that are driven before somebody carries the robot, and then, or from an unknown start
on."""
FOUND_WITHIN_M, FOUND_M, FOUND_RAD = 20.0, 0.3, 0.2
WRONG_M = 1.0
"""A place is told wrongly that is so far off."""
SCANS, HOMES = 800, (3, 4)
"""Of a generated log, and seeds of the homes."""
SPARSE_SCANS, CORRIDORS = 2500, (101, 102)
"""Of a generated log that is thinned, and seeds of the corridors."""
HARDEST = "noise 0.2, way 0.9, turn 1.15, people, boxes"
CONDITIONS = {
    "noise 0.04": Conditions(0.04),
    "noise 0.2, way 1.1, turn 0.85": Conditions(0.2, 1.1, 0.85),
    HARDEST: Conditions(0.2, 0.9, 1.15, people=3, boxes=3),
}


@dataclass(frozen=True, slots=True)
class Followed:
    """A stretch of a log.

    Attributes:
        metres: Shape (n,), how far off the place was that the localiser told at each scan; NaN while lost.
        radians: Shape (n,), the heading.
    """

    metres: NDArray[np.float64]
    radians: NDArray[np.float64]

    @property
    def lost(self) -> float:
        """The share of the scans at which it told no place."""
        return float(np.isnan(self.metres).mean())


def follow(grid: OccupancyGrid, records: Sequence[Record], seed: int, start: Pose2 | None) -> Followed:
    """Localise the robot of a log.

    Args:
        grid: The map.
        records: Of the log.
        seed: Of the particles.
        start: Where the localiser is told to begin; None when nobody knows.
    """
    localiser = Localiser(grid, seed=seed)
    if start is not None:
        localiser.set_pose(start, START_DEVIATIONS)
    odometry, errors = Pose2(), []
    for record in records:
        odometry = odometry @ record.motion
        localiser.update(record.scan, AT_MIDDLE, odometry)
        if localiser.map_from_odom is None:
            errors.append((math.nan, math.nan))
        else:
            told = localiser.map_from_odom @ odometry
            errors.append(
                (told.distance_to(record.reference), abs(angle_difference(told.yaw, record.reference.yaw)))
            )
    metres, radians = np.array(errors).T
    return Followed(metres, radians)


@dataclass(frozen=True, slots=True)
class Search:
    """A robot that had to be found.

    Attributes:
        found_m: How far it drove until its place was told and stayed right for a metre; infinite if never.
        wrong_m: How far it drove while a wrong place was told, before it knew that it was lost.
        wrong_again_m: The same afterwards.
    """

    found_m: float
    wrong_m: float
    wrong_again_m: float


def searched(records: Sequence[Record], followed: Followed) -> Search:
    """Return how long it took to find a robot of which nobody knew, at the first record, where it was."""
    steps = np.array([0.0, *(math.hypot(each.motion.x, each.motion.y) for each in records[1:])])
    way = np.cumsum(steps)
    right = (followed.metres < FOUND_M) & (followed.radians < FOUND_RAD)
    found = math.inf
    for index in np.flatnonzero(right & (way <= way[-1] - 1.0)):
        if right[(way >= way[index]) & (way <= way[index] + 1.0)].all():
            found = float(way[index])
            break
    wrong = followed.metres > WRONG_M
    lost = np.cumsum(np.isnan(followed.metres)) > 0
    return Search(found, float(steps[wrong & ~lost].sum()), float(steps[wrong & lost].sum()))


def unknown_starts(
    grid: OccupancyGrid, records: Sequence[Record], seed: int, count: int, part: float
) -> list[Search]:
    """Start all over the log at places of which nobody tells; ``part`` shortens what is driven then."""
    after = round(part * SCANS_AFTER)
    random = np.random.default_rng(seed)
    searches = []
    for number in range(count):
        here = int((number + random.random()) / count * (len(records) - after))
        stretch = records[here : here + after]
        searches.append(searched(stretch, follow(grid, stretch, seed, None)))
    return searches


def kidnapped(
    grid: OccupancyGrid, records: Sequence[Record], seed: int, count: int, part: float
) -> list[Search]:
    """Have somebody carry the robot elsewhere: two stretches of the log are joined."""
    scans_before, after = max(1, round(part * SCANS_BEFORE)), round(part * SCANS_AFTER)
    random = np.random.default_rng(seed)
    places = np.array([(each.reference.x, each.reference.y) for each in records])
    # In a small place not as far.
    carried = min(CARRIED_M, float(np.linalg.norm(np.ptp(places, axis=0))) / 3.0)
    searches: list[Search] = []
    while len(searches) < count:
        here = int(random.integers(len(records) - after))
        before = int(random.integers(scans_before, len(records)))
        if records[before - 1].reference.distance_to(records[here].reference) >= carried:
            stretch = records[before - scans_before : before]
            then = [replace(records[here], motion=Pose2()), *records[here + 1 : here + after]]
            followed = follow(grid, [*stretch, *then], seed, stretch[0].reference @ START)
            found = Followed(followed.metres[scans_before:], followed.radians[scans_before:])
            searches.append(searched(then, found))
    return searches


Figures = tuple[float, ...]
"""Errors of a told place: centimetres, degrees, percent of the scans, as in ``HEAD``."""


def figures(runs: Sequence[Followed]) -> Figures:
    """Compute the figures of some stretches together."""
    metres = np.concatenate([each.metres for each in runs])
    degrees = np.degrees(np.concatenate([each.radians for each in runs]))
    told = ~np.isnan(metres)

    def at(values: NDArray[np.float64], share: float) -> float:
        return float(np.percentile(values[told], share))

    return (
        *(100 * at(metres, share) for share in (50, 95, 99, 100)),
        *(at(degrees, share) for share in (50, 95)),
        float(100 * np.mean([each.lost for each in runs])),
    )


def worst(of_logs: Iterable[Figures]) -> Figures:
    """Return each figure of the log that has it worst."""
    return tuple(map(max, zip(*of_logs, strict=True)))


def row(name: str, of: Figures) -> tuple[str, ...]:
    """Write a row of the table."""
    return (name, *(f"{each:.1f}" for each in of[:4]), *(f"{each:.2f}" for each in of[4:6]), f"{of[6]:.1f} %")


SEARCHES = {"nobody knows where it is": unknown_starts, "carried away": kidnapped}
HEAD = ("", "cm off, median", "95 %", "99 %", "worst", "degrees off, median", "95 %", "reported lost")
FOUND_HEAD = (
    "",
    f"found within {FOUND_WITHIN_M:g} m",
    "median",
    "worst",
    "m before it was noticed",
    "wrong again",
)


def found_row(name: str, of_places: Sequence[Sequence[Search]]) -> tuple[str, ...]:
    """Write a row of the table of robots that had to be found.

    Counts are of all places, the rest of the place that has it worst.
    """
    found = [[each.found_m for each in searches] for searches in of_places]
    ways = list(itertools.chain.from_iterable(found))
    wrong_m = max(float(np.mean([each.wrong_m for each in searches])) for searches in of_places)
    wrong_again = sum(each.wrong_again_m > 0.0 for each in itertools.chain.from_iterable(of_places))
    return (
        name,
        f"{sum(way <= FOUND_WITHIN_M for way in ways)} of {len(ways)}",
        *(f"{way:.1f} m" if way < math.inf else "never" for way in (max(map(np.median, found)), max(ways))),
        f"{wrong_m:.1f}",
        str(wrong_again),
    )


@dataclass(frozen=True, slots=True)
class Located:
    """The result of a log, or of one robot that had to be found in it.

    Attributes:
        row: Of the table.
        place: Where.
        figures: As in ``HEAD``; empty for a robot that had to be found.
        search: What it took to find the robot.
    """

    row: str
    place: str
    figures: Figures = ()
    search: Search | None = None


def table_of(located: Sequence[Located]) -> str:
    """Write the tables, in each row the figures of its worst place."""
    logs = [each for each in located if each.search is None]
    rows = [
        row(name, worst(each.figures for each in logs if each.row == name))
        for name in dict.fromkeys(each.row for each in logs)
    ]
    searches: dict[str, dict[str, list[Search]]] = {}
    for each in located:
        if each.search is not None:
            searches.setdefault(each.row, {}).setdefault(each.place, []).append(each.search)
    found = [found_row(name, list(of_places.values())) for name, of_places in searches.items()]
    return "\n\n".join([table(HEAD, rows), *([table(FOUND_HEAD, found)] if found else [])])


LOG, GENERATED, SPARSE = TABLES = [
    RowTable(name, Located, table_of)
    for name in ("localisation", "generated localisation", "sparse localisation")
]


def of_log(path: Path, seeds: Sequence[int], part: float) -> Iterator[Located]:
    """Yield all results on a recorded log."""
    records = read_log(path)
    half, place = len(records) // 2, path.name
    grid, of_half = build_map(records), build_map(records[:half])
    yield Located(
        "map of the whole log, localised on the whole", place, figures(_known(grid, records, seeds))
    )
    yield Located(
        "map of its first half, localised on the second",
        place,
        figures(_known(of_half, records[half:], seeds)),
    )
    for (name, search), count in zip(SEARCHES.items(), (STARTS, KIDNAPS), strict=True):
        for seed in seeds:
            for each in search(grid, records, seed, max(2, round(part * count)), part):
                yield Located(name, place, search=each)


def of_generated(maps: Sequence[Path], seeds: Sequence[int], part: float) -> Iterator[Located]:
    """Yield the results on generated logs."""
    kinds = {path.stem: [mapped(path)] for path in maps} | {"homes": [home(seed) for seed in HOMES]}
    scans = round(part * SCANS)
    for kind, places in kinds.items():
        for place in places:
            logs = {}
            for name, conditions in CONDITIONS.items():
                logs[name] = [drive(place, conditions, scans, seed) for seed in seeds]
                of_place = figures([run for log in logs[name] for run in _known(place.grid, log, seeds[:1])])
                yield Located(name, place.name, of_place)
            for (name, search), count in zip(
                SEARCHES.items(), (STARTS_GENERATED, KIDNAPS_GENERATED), strict=True
            ):
                for log in logs[HARDEST]:
                    for each in search(place.grid, log, seeds[0], max(2, round(part * count)), part):
                        yield Located(f"{kind}, {name}", place.name, search=each)


def of_sparse(log: Path | None, every: float, seeds: Sequence[int], part: float) -> Iterator[Located]:
    """Yield results with all scans and with few."""
    if log is not None:
        records = read_log(log)
        for scans, of in _all_and_few(build_map(records), records, every, seeds).items():
            yield Located(f"log: {scans}", log.name, of)
    kinds = {"corridors": list(map(corridors, CORRIDORS)), "homes": list(map(home, HOMES))}
    for kind, places in kinds.items():
        for name, conditions in CONDITIONS.items():
            for place in places:
                records = drive(place, conditions, round(part * SPARSE_SCANS), seeds[0])
                for scans, of in _all_and_few(place.grid, records, every, seeds).items():
                    yield Located(f"{kind}, {name}: {scans}", place.name, of)


def _all_and_few(
    grid: OccupancyGrid, records: list[Record], every: float, seeds: Sequence[int]
) -> dict[str, Figures]:
    return {
        "all scans": figures(_known(grid, records, seeds)),
        f"every {every:g} m": figures(_known(grid, thinned(records, every), seeds)),
    }


def _known(grid: OccupancyGrid, records: Sequence[Record], seeds: Sequence[int]) -> list[Followed]:
    return [follow(grid, records, seed, records[0].reference @ START) for seed in seeds]


def main(arguments: Sequence[str] | None = None) -> int:
    """Localise and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, help="a log of CARMEN, perhaps compressed by gzip")
    parser.add_argument(
        "--maps", type=Path, nargs="*", help="generate logs in these maps and in homes (none: homes alone)"
    )
    parser.add_argument(
        "--every",
        type=float,
        metavar="M",
        help="the log, and generated ones in corridors and homes, with all scans and with one after M metres",
    )
    parser.add_argument("--seeds", type=int, default=3, help="how often, each with other particles")
    parser.add_argument(
        "--part", type=float, default=1.0, help="of the generated logs and of the robots that are to be found"
    )
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the tables between the marks of a page"
    )
    given = parser.parse_args(arguments)
    if given.log is None and given.maps is None and given.every is None:
        parser.error("nothing to do; would have worked: --log LOG, --maps, or --every 1")
    if given.every is not None and (given.every <= 0.0 or given.maps is not None):
        parser.error("--every takes metres above 0, and makes logs without --maps")
    missing = [str(path) for path in (given.log, *(given.maps or ())) if path and not path.is_file()]
    if missing:
        parser.error(f"no such file: {', '.join(missing)}; paths count from {Path.cwd()}")
    seeds = range(1, given.seeds + 1)
    made: dict[RowTable[Located], Iterator[Located]] = {}
    if given.every is not None:
        made[SPARSE] = of_sparse(given.log, given.every, seeds, given.part)
    elif given.log is not None:
        made[LOG] = of_log(given.log, seeds, given.part)
    if given.maps is not None:
        made[GENERATED] = of_generated(given.maps, seeds, given.part)
    for kept, results in made.items():
        located = []
        for each in results:
            located.append(each)
            print(each, file=sys.stderr, flush=True)
        kept.publish(located, given.write, command_of("tools/localisation.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
