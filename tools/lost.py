"""Robots that are not where they believe to be and get a goal, in the rig: who finds its place and arrives.

``python tools/lost.py --homes flat 5 6 7 8 9 --seed 41 --write docs/notes/navigation.md``.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import MissionRequest
from florence_bt.simulation.home.flat import Flat, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.rig.rig import Rig
from tools.driving import GOAL_CLEARANCE_M, SAMPLE_S
from tools.tables import RowTable, command_of, table

NAME = "lost robots"
DRIVING, STANDING, STARTED = CASES = ("carried while driving", "carried while standing", "started elsewhere")
CARRIED_M, OFF_M = (1.5, math.inf), (1.2, 3.5)
"""Distances over which the robot is carried, and errors of its start, metres."""
FIRST_DRIVE_S, GOAL_M, LONGEST_S = 4.0, 1.5, 300.0
"""Time of its drive when somebody lifts it, distance of its goal at least, limit of a drive."""
ARRIVED_M = 0.3
_TRIES = 1000


@dataclass(frozen=True, slots=True)
class LostRun:
    """The outcome of one lost robot.

    Attributes:
        home: ``flat``, or the seed of a generated home.
        seed: Of the robot.
        case: One of :data:`CASES`.
        succeeded: Whether the mission did.
        arrived: Whether the robot truly stands at its goal.
        reason: Why it failed.
        seconds: From the carrying, or the start, to the end.
        contacts: What it touched.
    """

    home: str
    seed: int
    case: str
    succeeded: bool
    arrived: bool
    reason: str
    seconds: float
    contacts: tuple[str, ...]


class Places:
    """Random places of a home where the robot has room.

    Args:
        flat: The home.
        seed: Of the choice.
    """

    def __init__(self, flat: Flat, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        space = free_space_of(flat)
        free = space.reachable((flat.start.x, flat.start.y), 0.22) & (space.clearance >= GOAL_CLEARANCE_M)
        x, y = space.frame.centres()
        rows, columns = np.nonzero(free)
        self._places = np.stack([x[columns], y[rows]], axis=1)

    def away(self, here: Pose2, least: float, most: float = math.inf) -> Pose2:
        """Choose a pose so many metres away from another one."""
        for _ in range(_TRIES):
            x, y = self._places[int(self._random.integers(len(self._places)))].tolist()
            pose = Pose2(x, y, float(self._random.uniform(-math.pi, math.pi)))
            if least <= here.distance_to(pose) <= most:
                return pose
        raise FlorenceError(f"no place of this home is {least:g} to {most:g} m away from {here}")


def go(home: str, case: str, seed: int, longest_s: float) -> LostRun:
    """Let one robot drive."""
    flat = load_flat() if home == "flat" else generated_flat(int(home))
    places = Places(flat, seed)
    start = places.away(Pose2(math.inf), 0.0)
    believed = places.away(start, *OFF_M) if case == STARTED else None
    rig = make_rig(flat=flat, person="absent", seed=seed, start=start, believed=believed)
    if case == STANDING:
        rig.world.carry_robot(places.away(start, *CARRIED_M))
    goal = places.away(rig.world.robot_pose, GOAL_M)
    inputs = {"x": goal.x, "y": goal.y, "phi": goal.yaw}
    run = rig.executor.trigger(MissionRequest("goto_pose", inputs, caller="lost"))
    began = rig.clock.now()
    if case == DRIVING:
        _let_go_on(rig, lambda: run.status.final, began + FIRST_DRIVE_S)
        rig.world.carry_robot(places.away(rig.world.robot_pose, *CARRIED_M))
        began = rig.clock.now()
    _let_go_on(rig, lambda: run.status.final, began + longest_s)
    over = run.status.final
    if not over:
        rig.executor.stop("too long")
    seconds = rig.clock.now() - began
    rig.clock.advance(1.0)
    arrived = rig.world.robot_pose.distance_to(goal) < ARRIVED_M
    succeeded = over and run.status.value.lower() == "succeeded"
    reason = run.reason if over else f"not over after {longest_s:g} s"
    contacts = tuple(contact.name for contact in rig.world.contacts)
    return LostRun(home, seed, case, succeeded, arrived, reason, seconds, contacts)


def _let_go_on(rig: Rig, over: Callable[[], bool], until: float) -> None:
    while not over() and rig.clock.now() < until:
        rig.clock.advance(SAMPLE_S)


def rows_of(runs: Sequence[LostRun]) -> list[list[str]]:
    """Write the lines of the table, one for each case."""
    rows = []
    for case in CASES:
        of_case = [run for run in runs if run.case == case]
        good = [run for run in of_case if run.succeeded and run.arrived]
        rows.append(
            [
                case,
                f"{len(good)} of {len(of_case)}",
                str(sum(run.succeeded and not run.arrived for run in of_case)),
                str(sum(len(run.contacts) for run in of_case)),
                f"{statistics.median(run.seconds for run in good):.0f} s" if good else "-",
                f"{max(run.seconds for run in of_case):.0f} s",
            ]
        )
    return rows


HEAD = ["", "arrived", "success elsewhere", "contacts", "seconds, median", "longest"]


def table_of(runs: Sequence[LostRun]) -> str:
    """Write the table."""
    return table(HEAD, rows_of(runs))


TABLE = RowTable(NAME, LostRun, table_of)


def main(arguments: list[str] | None = None) -> int:
    """Let robots drive, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--homes", nargs="+", default=["flat"], help="flat, or seeds of generated homes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--limit", type=float, default=LONGEST_S, metavar="S", help="how long a robot may take"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    runs = []
    for number, home in enumerate(given.homes):
        for case in CASES:
            run = go(home, case, given.seed + number, given.limit)
            runs.append(run)
            how = run.reason if not run.succeeded else "arrived" if run.arrived else "SUCCESS ELSEWHERE"
            print(f"{home}, seed {run.seed}, {case}: {how} after {run.seconds:.0f} s", flush=True)
    TABLE.publish(runs, given.write, command_of("tools/lost.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
