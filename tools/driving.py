"""Drives to random goals among walking people, in the rig: how many are reached, and how.

``python tools/driving.py flat ../shared/data/maps/depot.yaml --goals 40 --write docs/notes/navigation.md``.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import sys
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import MissionRequest
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.free_space import FreeSpace, Point, free_space_of
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.map_world import is_map
from florence_bt.simulation.home.mjcf import WHEEL_SEPARATION_M
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.rig.rig import Rig
from florence_bt.skills.navigation.map_server.map_file import load_map
from tools.tables import RowTable, command_of, table

NAME = "driving"
GOAL_CLEARANCE_M, WAY_RADIUS_M, WALKER_RADIUS_M = 0.30, 0.17, 0.35
"""Free metres round a goal; the robot on the shortest way (its inscribed circle); somebody who walks."""
LEAST_M, LONGEST_S = 1.0, 300.0
SAMPLE_S, OVER_SAMPLES = 0.02, 5
"""Period of looking at the truth; the samples over which a change of the wheels' speed is measured. The
samples lie between the steps of the velocity filter: at the same moments, two steps may fall between two of
them, and 1.2 m/s^2 would be seen where there is 1.0."""
MOVING_MPS = 0.03
_TRIES = 300


@dataclass(frozen=True, slots=True)
class DrivenGoal:
    """One drive and what really came of it.

    Attributes:
        home: Where.
        number: Which drive of the round there, from 0 on.
        people: How many walked about.
        reached: Whether the mission succeeded.
        reason: Why not.
        driven: Metres.
        shortest: Metres, without people.
        seconds: How long it took.
        error: How far from the goal it ended, metres.
        contacts: What the robot ran into.
        run_into: How often people ran into the robot that stood or drove away.
        acceleration: The greatest change of the wheels' commanded speed along the way, m/s^2.
        braking: The same of the slowing down.
    """

    home: str
    number: int
    people: int
    reached: bool
    reason: str
    driven: float
    shortest: float
    seconds: float
    error: float
    contacts: tuple[str, ...]
    run_into: int
    acceleration: float
    braking: float


class Round:
    """One home, its people, and drive after drive.

    Args:
        flat: The home.
        grid_file: Its map, when the home was made of one.
        people: How many walk about.
        seed: Start of every random generator.
    """

    def __init__(self, flat: Flat, grid_file: Path | None, people: int, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._home, self._people, self._number = flat.name, people, itertools.count()
        self._space: FreeSpace = free_space_of(flat)
        start = flat.start.x, flat.start.y
        self._goals = self._space.reachable(start, 0.22) & (self._space.clearance >= GOAL_CLEARANCE_M)
        self._ways = self._space.reachable(start, WALKER_RADIUS_M)
        walkers = [self._walker(number, start) for number in range(1, people + 1)]
        grid = load_map(grid_file) if grid_file is not None else None
        self._rig: Rig = make_rig(flat=flat, person="absent", others=walkers, seed=seed, grid=grid)

    def _place(self, cells: np.ndarray) -> Point:
        found = np.argwhere(cells)
        row, column = found[int(self._rng.integers(len(found)))]
        x, y = self._space.frame.centres()
        return float(x[column]), float(y[row])

    def _walker(self, number: int, start: Point) -> PersonSpec:
        for _ in range(_TRIES):
            begin, end = self._place(self._ways), self._place(self._ways)
            way = self._space.shortest_way(begin, end, WALKER_RADIUS_M)
            if way is None or math.dist(begin, end) < 2.0 or math.dist(begin, start) < 1.5:
                continue
            heading = math.atan2(way[1][1] - way[0][1], way[1][0] - way[0][0])
            speed = float(self._rng.uniform(0.3, 0.8))
            pose = Pose2(*way[0], heading)
            name = f"walker_{number}"
            return PersonSpec(name, pose, "walking", route=tuple(way[1:]), speed=speed, wait=3.0)
        raise FlorenceError("nobody can walk here; fewer --people")

    def drive(self) -> DrivenGoal:
        """Drive to the next random goal."""
        rig, world = self._rig, self._rig.world
        here = world.robot_pose
        for _ in range(_TRIES):
            goal = Pose2(*self._place(self._goals), float(self._rng.uniform(-math.pi, math.pi)))
            begin = self._space.nearest((here.x, here.y), WAY_RADIUS_M)
            way = begin and self._space.shortest_way(begin, (goal.x, goal.y), WAY_RADIUS_M)
            if way and (shortest := sum(map(math.dist, way, way[1:]))) >= LEAST_M:
                break
        else:
            raise FlorenceError("no goal is far enough away")
        inputs = {"x": goal.x, "y": goal.y, "phi": goal.yaw}
        began, known = rig.clock.now(), len(world.contacts)
        run = rig.executor.trigger(MissionRequest("goto_pose", inputs, caller="driving"))
        driven, fastest, slowing, run_into = 0.0, 0.0, 0.0, 0
        before, speeds, contacts = world.robot_pose, deque[float](maxlen=OVER_SAMPLES + 1), []
        rig.clock.advance(SAMPLE_S / 2)
        while not run.status.final and rig.clock.now() - began < LONGEST_S:
            rig.clock.advance(SAMPLE_S)
            pose = world.robot_pose
            driven, before = driven + before.distance_to(pose), pose
            now = sum(world.wheels) / 2
            speeds.append(abs(now))
            change = (speeds[-1] - speeds[0]) / (OVER_SAMPLES * SAMPLE_S)
            fastest, slowing = max(fastest, change), max(slowing, -change)
            for contact in world.contacts[known:]:
                towards = math.cos(pose.bearing_to(*contact.position[:2])) * now
                turning = abs(world.wheels[1] - world.wheels[0]) / WHEEL_SEPARATION_M > 0.1
                if contact.name.startswith("walker_") and towards < MOVING_MPS and not turning:
                    run_into += 1
                else:
                    contacts.append(contact.name)
            known = len(world.contacts)
        reached = run.status.final and run.status.value.lower() == "succeeded"
        reason = run.reason if run.status.final else f"not over after {LONGEST_S:g} s"
        if not run.status.final:
            rig.executor.stop("too long")
        seconds = rig.clock.now() - began
        rig.clock.advance(1.0 - SAMPLE_S / 2)
        error = world.robot_pose.distance_to(goal)
        return DrivenGoal(
            home=self._home,
            number=next(self._number),
            people=self._people,
            reached=reached,
            reason=reason,
            driven=driven,
            shortest=shortest,
            seconds=seconds,
            error=error,
            contacts=tuple(contacts),
            run_into=run_into,
            acceleration=fastest,
            braking=slowing,
        )


def row_of(drives: Sequence[DrivenGoal]) -> list[str]:
    """Write the drives in one home as a line of the table."""
    good = [drive for drive in drives if drive.reached]
    ratios = sorted(drive.driven / drive.shortest for drive in good)
    return [
        drives[0].home,
        f"{len(good)} of {len(drives)}",
        str(drives[0].people),
        str(sum(len(drive.contacts) for drive in drives)),
        str(sum(drive.run_into for drive in drives)),
        f"{sum(d.driven for d in good) / sum(d.shortest for d in good):.2f}" if good else "-",
        f"{statistics.median(ratios):.2f}" if good else "-",
        f"{100 * max(drive.error for drive in good):.0f} cm" if good else "-",
        f"{max(drive.acceleration for drive in drives):.2f}",
        f"{max(drive.braking for drive in drives):.2f}",
    ]


HEAD = [
    "home",
    "reached",
    "people",
    "contacts of the robot",
    "people into it",
    "driven / shortest, all",
    "median",
    "end error at most",
    "acceleration at most, m/s^2",
    "braking",
]


def table_of(drives: Sequence[DrivenGoal]) -> str:
    """Write the table, with a line for each home."""
    homes = dict.fromkeys(drive.home for drive in drives)
    return table(HEAD, [row_of([drive for drive in drives if drive.home == home]) for home in homes])


TABLE = RowTable(NAME, DrivenGoal, table_of)


def told(drive: DrivenGoal) -> str:
    """Write one drive for people."""
    outcome = "reached" if drive.reached else drive.reason
    contacts = f", touched {', '.join(drive.contacts)}" if drive.contacts else ""
    return (
        f"{drive.home}, {drive.number}: {outcome} after {drive.driven:.2f} m, {drive.seconds:.0f} s{contacts}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Drive, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("homes", nargs="+", help="flat, a home's source file, or a map of map_server")
    parser.add_argument(
        "--goals", type=int, nargs="+", default=[20], help="in each home, or one number for each of them"
    )
    parser.add_argument("--people", type=int, default=2, help="who walk about in each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    if len(given.goals) not in (1, len(given.homes)):
        parser.error(f"--goals takes one number, or one for each of the {len(given.homes)} homes")
    drives: list[DrivenGoal] = []
    for home, goals in zip(given.homes, itertools.cycle(given.goals), strict=False):
        file = None if home == "flat" else Path(home)
        try:
            map_file = file if file is not None and is_map(file) else None
            trip = Round(choose_flat(file), map_file, given.people, given.seed)
            for _ in range(goals):
                drives.append(trip.drive())
                print(told(drives[-1]), flush=True)
        except FlorenceError as error:
            print(f"{home}: {error}", file=sys.stderr)
            return 1
    TABLE.publish(drives, given.write, command_of("tools/driving.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
