"""How well the robot is localised on a real building's log, with the default parameters.

``python tools/localisation.py freiburg-079-corrected.log.gz --write docs/navigation.md``
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.localisation.localiser import Localiser
from tools.carmen_log import Record, build_map, read_log
from tools.tables import table, write_between_marks

AT_MIDDLE = Transform3.from_pose2(Pose2())
START = Pose2(0.2, -0.15, 0.1)
"""So much is the first pose off."""
START_DEVIATIONS = (0.3, 0.3, 0.15)
KIDNAPS, CARRIED_M, FOUND_WITHIN_M, FOUND_M, FOUND_RAD = 10, 5.0, 20.0, 0.3, 0.2


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


def follow(grid: OccupancyGrid, records: Sequence[Record], seed: int, start: Pose2 | None = None) -> Followed:
    """Localise the robot of a log.

    Args:
        grid: The map.
        records: Of the log.
        seed: Of the particles.
        start: Where the localiser is told to begin; a bit beside the reference when not given.
    """
    localiser = Localiser(grid, seed=seed)
    localiser.set_pose(start or records[0].reference @ START, START_DEVIATIONS)
    odometry, errors = Pose2(), []
    for record in records:
        odometry = odometry @ record.motion if errors else odometry
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


def metres_until_found(records: Sequence[Record], followed: Followed) -> float:
    """How far the robot drives until its place is told and stays right for a metre; infinite if never."""
    way = np.cumsum([0.0, *(math.hypot(each.motion.x, each.motion.y) for each in records[1:])])
    right = (followed.metres < FOUND_M) & (followed.radians < FOUND_RAD)
    for index in np.flatnonzero(right & (way <= way[-1] - 1.0)):
        if right[(way >= way[index]) & (way <= way[index] + 1.0)].all():
            return float(way[index])
    return math.inf


def kidnapped(grid: OccupancyGrid, records: Sequence[Record], seed: int) -> list[float]:
    """Metres driven until the robot is found again that was carried elsewhere, for some places of the log."""
    random = np.random.default_rng(seed)
    found = []
    while len(found) < KIDNAPS:
        there = int(random.integers(len(records) - 600))
        elsewhere = records[int(random.integers(len(records)))].reference
        if elsewhere.distance_to(records[there].reference) >= CARRIED_M:
            stretch = records[there : there + 600]
            found.append(metres_until_found(stretch, follow(grid, stretch, seed, elsewhere)))
    return found


def row(name: str, runs: Sequence[Followed]) -> tuple[str, ...]:
    """A row of the table."""
    metres = np.concatenate([each.metres for each in runs])
    degrees = np.degrees(np.concatenate([each.radians for each in runs]))
    told = ~np.isnan(metres)

    def at(values: NDArray[np.float64], share: float) -> float:
        return float(np.percentile(values[told], share))

    return (
        name,
        *(f"{100 * at(metres, share):.1f}" for share in (50, 95, 99, 100)),
        *(f"{at(degrees, share):.2f}" for share in (50, 95)),
        f"{100 * np.mean([each.lost for each in runs]):.1f} %",
    )


HEAD = ("", "cm off, median", "95 %", "99 %", "worst", "degrees off, median", "95 %", "told as lost")


def report(path: Path, seeds: Sequence[int]) -> str:
    """All results on a log as Markdown."""
    records = read_log(path)
    half = len(records) // 2
    grid, of_half = build_map(records), build_map(records[:half])
    rows = [
        row("map of the whole log, localised on the whole", [follow(grid, records, seed) for seed in seeds]),
        row(
            "map of its first half, localised on the second",
            [follow(of_half, records[half:], seed) for seed in seeds],
        ),
    ]
    found = [way for seed in seeds for way in kidnapped(grid, records, seed)]
    within = sum(way <= FOUND_WITHIN_M for way in found)
    return (
        f"{table(HEAD, rows)}\n\n"
        f"Carried {CARRIED_M:g} m and more away without being told: found again within {FOUND_WITHIN_M:g} m "
        f"of driving in {within} of {len(found)} cases, after {np.median(found):.1f} m (median)."
    )


def main() -> int:
    """Localise and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path, help="a log of CARMEN, perhaps compressed by gzip")
    parser.add_argument("--seeds", type=int, default=3, help="how often, each with other particles")
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table between the marks of this page"
    )
    given = parser.parse_args()
    text = report(given.log, range(1, given.seeds + 1))
    print(text)
    if given.write:
        write_between_marks(given.write, "localisation", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
