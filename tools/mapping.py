"""Measures how right the maps are that are built from laser and odometry alone.

``python tools/mapping.py --log freiburg-079-corrected.log.gz --picture docs/img/freiburg-079.png``
measures on a real building's log, also with scans left out; ``--generated`` on generated homes and
corridors; ``--flat`` in the simulated flat, where goto_user runs on the map afterwards. ``--write PAGE``
writes the tables.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.app.demo.rigs import make_rig
from florence_bt.app.maps.picture import draw_drive
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import FREE, OCCUPIED, LaserScan, OccupancyGrid
from florence_bt.core.topics import SCAN
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.rig.robot import BASE_FRAME, LASER_FRAME
from florence_bt.skills.navigation.localisation.likelihood_field import build_likelihood_field
from florence_bt.skills.navigation.localisation.scan_match import match_scan
from florence_bt.skills.navigation.mapping.slam import Slam
from florence_bt.skills.navigation.navigate.drive_actions import NAVIGATE_TO_POSE
from tools.carmen_log import Record, read_log, thinned
from tools.generated_log import Conditions, Place, corridors, drive, home
from tools.tables import command_of, table, write_table

NEAR_M, APART = 2.0, 0.02
"""Two scans see the same place when they are so near, and at least this part of the log lies between them."""
WITHIN_M = (0.05, 0.1)
SPARSE_M = (0.7, 1.0)
HOMES, CORRIDORS, SCANS, CORRIDOR_SCANS = (1, 4), (1,), 1200, 2500
LONGEST_S = 600.0
"""Simulated seconds that goto_user may take on the map of the flat."""
HARD = "noise 0.2, way 0.9, turn 1.15, people, boxes"
CONDITIONS = {"noise 0.04": Conditions(0.04), HARD: Conditions(0.2, 0.9, 1.15, people=3, boxes=3)}


@dataclass(frozen=True, slots=True)
class Errors:
    """Of the poses of some scans to each other: mean and median, in metres and degrees.

    Attributes:
        metres: Mean, median.
        degrees: Mean, median.
    """

    metres: tuple[float, float]
    degrees: tuple[float, float]

    def __str__(self) -> str:
        """Write mean and median."""
        (mean, median), (mean_turn, median_turn) = self.metres, self.degrees
        return f"{mean:.3f} / {median:.3f} m, {mean_turn:.2f} / {median_turn:.2f} deg"


@dataclass(frozen=True, slots=True)
class Measured:
    """A log that was mapped.

    Attributes:
        slam: What it has become.
        neighbours: Errors from scan to scan.
        loops: Errors between scans of one place, None where the robot never came back.
        absolute_m: Mean distance of the whole way from the true one, laid over it.
        seconds: Of computing.
        driven_s: How long the robot drove.
    """

    slam: Slam
    neighbours: Errors
    loops: Errors | None
    absolute_m: float
    seconds: float
    driven_s: float

    def row(self, name: str) -> list[str]:
        """Return the row of a table."""
        return [
            name,
            str(self.neighbours),
            str(self.loops or "no loop"),
            f"{self.absolute_m:.3f} m",
            str(self.slam.loops),
            f"{self.seconds:.1f} s ({self.driven_s / self.seconds:.0f} x)",
        ]


HEAD = (
    "log",
    "from scan to scan",
    "at loops",
    "whole way",
    "loops closed",
    "computing (faster than the drive)",
)


def measure(records: Sequence[Record]) -> Measured:
    """Map a log from laser and odometry, and compare the poses with its reference."""
    slam, odom = Slam(), Pose2()
    places: list[tuple[int, Pose2]] = []
    began = time.process_time()
    for record in records:
        odom = odom @ record.motion
        slam.update(record.scan, Transform3.identity(), odom)
        places.append((len(slam.scans) - 1, slam.since_kept))
    slam.settle()
    seconds = time.process_time() - began
    poses = slam.poses
    found = [poses[kept] @ since for kept, since in places]
    true = [record.reference for record in records]
    pairs = [(i, i + 1) for i in range(len(records) - 1)]
    again = list(_same_places(true))
    driven = records[-1].scan.stamp - records[0].scan.stamp
    loops = _errors(found, true, again) if again else None
    return Measured(slam, _errors(found, true, pairs), loops, _laid_over(found, true), seconds, driven)


def _same_places(true: Sequence[Pose2]) -> Iterable[tuple[int, int]]:
    """Yield pairs of scans that were taken near each other, at different times."""
    places = np.array([(pose.x, pose.y) for pose in true])
    apart = max(5, round(APART * len(true)))
    for i in range(0, len(true) - apart, 3):
        near = np.hypot(*(places[i + apart :] - places[i]).T) < NEAR_M
        for j in np.flatnonzero(near)[::5]:
            yield i, int(j) + i + apart


def _errors(found: Sequence[Pose2], true: Sequence[Pose2], pairs: Iterable[tuple[int, int]]) -> Errors:
    wrong = [(true[i].inverse() @ true[j]).inverse() @ (found[i].inverse() @ found[j]) for i, j in pairs]
    metres = [math.hypot(each.x, each.y) for each in wrong]
    degrees = [math.degrees(abs(each.yaw)) for each in wrong]
    return Errors(
        (float(np.mean(metres)), float(np.median(metres))),
        (float(np.mean(degrees)), float(np.median(degrees))),
    )


def _laid_over(found: Sequence[Pose2], true: Sequence[Pose2]) -> float:
    """Return the mean distance of two ways, the one laid over the other (Umeyama, 1991, without scale)."""
    a, b = (np.array([(pose.x, pose.y) for pose in way]) for way in (found, true))
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    yaw = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    c, s = math.cos(yaw), math.sin(yaw)
    return float(np.hypot(*(a @ np.array([[c, s], [-s, c]]) - b).T).mean())


# ---- the simulated flat --------------------------------------------------------------------------------


def record_flat(part: float) -> tuple[list[tuple[LaserScan, Transform3, Pose2]], Pose2]:
    """Drive to a part of the flat's hotspots in the rig; return what laser and odometry have said."""
    flat = load_flat()
    start = Pose2(flat.start.x, flat.start.y)
    rig = make_rig(start=start)
    recorded: list[tuple[LaserScan, Transform3, Pose2]] = []
    mount = robot_frames().lookup(BASE_FRAME, LASER_FRAME)
    drives = rig.wires.actions[NAVIGATE_TO_POSE.port.name]
    rig.topics[SCAN.name].subscribe(lambda scan: recorded.append((scan, mount, rig.robot.odometry.pose)))
    rooms = (*flat.rooms, flat.rooms[0])
    for room in rooms[: max(1, round(part * len(rooms)))]:
        run = drives.start({"pose": room.hotspot.pose}, lambda _, outcome: Result(outcome), str)
        while run.poll() is None:
            rig.clock.run_next()
    return recorded, start


def map_flat(
    recorded: Sequence[tuple[LaserScan, Transform3, Pose2]], start: Pose2
) -> tuple[OccupancyGrid, OccupancyGrid]:
    """Map the flat from what was said on a drive that began at a pose with the heading zero.

    Returns:
        The true map, and the one that was built, in the frame of the flat.
    """
    slam = Slam()
    for scan, mount, odom in recorded:
        slam.update(scan, mount, odom)
    slam.settle()
    grid = slam.grid()
    origin = Pose2(start.x + grid.origin.x, start.y + grid.origin.y)
    return laser_map(load_flat()), OccupancyGrid(grid.resolution, origin, grid.cells)


def parts_within(true: OccupancyGrid, built: OccupancyGrid, metres: float) -> tuple[float, float]:
    """Return which part of the built walls is so near to true ones, and of the true ones to built ones.

    The built map is laid over the true one first: its frame comes from the first scan alone. The middle of a
    cell counts, to the wall in the other map. Of the true walls those count that face what is known to be
    free in the built map.
    """
    walls, facing = _middles(true, true.cells == OCCUPIED), true.cells == OCCUPIED
    field = build_likelihood_field(true, 0.5)
    belief = np.diag(np.square([0.1, 0.1, 0.02]))
    made = _middles(built, built.cells == OCCUPIED)
    laid = match_scan(field, made, Pose2(), belief, sigma=0.05, independent_beams=400.0).pose
    free = laid_over(_middles(built, built.cells == FREE), laid)
    made = laid_over(made, laid)
    known = np.zeros(true.cells.shape, bool)
    u, v = np.floor((free - (true.origin.x, true.origin.y)) / true.resolution).astype(int).T
    inside = (u >= 0) & (u < known.shape[1]) & (v >= 0) & (v < known.shape[0])
    known[v[inside], u[inside]] = True
    facing &= binary_dilation(known & (true.cells == FREE))
    half = metres + true.resolution / 2.0
    there, _ = cKDTree(walls).query(made)
    back, _ = cKDTree(made).query(_middles(true, facing))
    return float((there <= half).mean()), float((back <= half).mean())


def _middles(grid: OccupancyGrid, cells: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the middles of some cells, shape (n, 2), metres in the map frame."""
    rows, columns = np.nonzero(cells)
    return (grid.origin.x, grid.origin.y) + (np.stack([columns, rows], axis=1) + 0.5) * grid.resolution


def laid_over(points: NDArray[np.float64], pose: Pose2) -> NDArray[np.float64]:
    """Return points, shape (n, 2), in the frame in which theirs has a pose."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return points @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)


def flat_text(part: float) -> str:
    """Map the flat, run goto_user on the map, and tell both."""
    true, built = map_flat(*record_flat(part))
    status = make_rig(seed=3, person="study", grid=built).run("goto_user", limit_s=part * LONGEST_S).status
    return f"{walls_text(true, built)}\n\n`goto_user` on that map ended with: {status.name.lower()}."


def walls_text(true: OccupancyGrid, built: OccupancyGrid) -> str:
    """Return the table of how near the walls of two maps are to each other."""
    head = ("within", "built wall cells near true ones", "true wall cells that were seen, near built ones")
    rows = []
    for metres in WITHIN_M:
        parts = parts_within(true, built, metres)
        rows.append([f"{100 * metres:.0f} cm", *(f"{100 * part:.1f} %" for part in parts)])
    return table(head, rows)


def _places(part: float) -> Iterable[tuple[Place, int, int]]:
    for seed in HOMES:
        yield home(seed), round(part * SCANS), seed
    for seed in CORRIDORS:
        yield corridors(seed), round(part * CORRIDOR_SCANS), seed


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, help="a log that GMapping has corrected")
    parser.add_argument("--generated", action="store_true", help="generated homes and corridors")
    parser.add_argument("--flat", action="store_true", help="the simulated flat, and goto_user on its map")
    parser.add_argument("--part", type=float, default=1.0, help="of the generated logs and of the flat")
    parser.add_argument("--picture", type=Path, help="of the whole log, PNG")
    parser.add_argument("--write", type=Path, help="a page with marks for the tables")
    wanted = parser.parse_args(arguments)
    texts: dict[str, str] = {}
    if wanted.log:
        records = read_log(wanted.log)
        rows = []
        for name, some in (("whole", records), *((f"{d:g} m", thinned(records, d)) for d in SPARSE_M)):
            measured = measure(some)
            rows.append(measured.row(name))
            print(rows[-1], flush=True)
            if wanted.picture and name == "whole":
                slam = measured.slam
                wanted.picture.write_bytes(draw_drive(slam.grid(), slam.poses, slam.drive.ties))
        texts["log"] = table(HEAD, rows)
    if wanted.generated:
        rows = []
        for place, scans, seed in _places(wanted.part):
            for name, conditions in CONDITIONS.items():
                rows.append(measure(drive(place, conditions, scans, seed)).row(f"{place.name}, {name}"))
                print(rows[-1], flush=True)
        texts["generated"] = table(HEAD, rows)
    if wanted.flat:
        texts["flat"] = flat_text(wanted.part)
    for name, text in texts.items():
        print(text)
        if wanted.write:
            write_table(wanted.write, name, text, command_of("tools/mapping.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
