"""Homes that the robot maps by itself in the rig: what it saw and touched, and whether the map is of use.

``python tools/exploration.py --seeds 31 32 33 --write docs/notes/exploration.md``.
The maps and rooms of the homes are in ``build/exploration``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.app.demo.rigs import make_rig
from florence_bt.app.maps.proposal import proposed_hotspots, write_proposal
from florence_bt.core.diagnosis import Diagnosis
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OccupancyGrid
from florence_bt.core.topic_names import PLACE_STATUS
from florence_bt.core.topics import DIAGNOSES
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.flat import Flat, Room
from florence_bt.simulation.home.free_space import FreeSpace, free_space_of
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.navigation.map_server.map_writer import save_map
from tools.processes import processes
from tools.tables import BUILD, RowTable, command_of, table

NAME = "exploration"
LIMIT_S, DRIVE_S = 1800.0, 300.0
"""Simulated seconds for a home, and for a drive to a room."""
ROBOT_M = 0.22
"""Radius of a disc, metres: the robot is expected to get to wherever the disc gets to."""
SEEN_SHARE = 0.8
"""A room is seen when the map knows so much of the floor on which the robot can stand there."""
OVERLAP = 0.6
"""A room is proposed right when its polygon has so much of the true room's floor, and of no other as much."""


@dataclass(frozen=True, slots=True)
class Explored:
    """One home, and what really came of it.

    Attributes:
        seed: Of the home and of all noise.
        ended: How the mission ended: empty for a success, else why not.
        seconds: How long it took, simulated.
        driven: Metres.
        seen: The part of the floor that is known, for each room that the robot can get to.
        contacts: What the robot touched, in the exploration and in the drives afterwards.
        proposed: How many rooms were proposed.
        right: Whether these are the true ones.
        reached: In how many proposed rooms ``goto_room`` ended, and truly in the room that was meant.
        misses: Why not in the others.
    """

    seed: int
    ended: str
    seconds: float
    driven: float
    seen: dict[str, float]
    contacts: tuple[str, ...]
    proposed: int
    right: bool
    reached: int
    misses: tuple[str, ...]

    @property
    def all_seen(self) -> bool:
        """Tell whether every room was seen."""
        return min(self.seen.values()) >= SEEN_SHARE


def explore(seed: int, limit_s: float = LIMIT_S) -> Explored:
    """Let the robot map a home for so many seconds at most, propose its rooms, and drive to each."""
    flat = choose_flat(None, seed)
    rig = make_rig(flat=flat, person="absent", seed=seed, mapping=True)
    told: dict[str, Diagnosis] = {}
    rig.topics[DIAGNOSES.name].subscribe(lambda diagnoses: told.update(diagnoses.found))
    run = rig.run("explore", limit_s=limit_s)
    grid = rig.grid
    assert run.started is not None and run.ended is not None
    folder = BUILD / NAME
    folder.mkdir(parents=True, exist_ok=True)
    save_map(grid, folder / f"home_{seed}.yaml")
    write_proposal(grid, folder / f"home_{seed}.hotspots.yaml")
    rooms = proposed_hotspots(grid)
    space = free_space_of(flat)
    reached, misses, contacts = _visit(flat, grid, rooms, seed)
    return Explored(
        seed=seed,
        ended="" if run.status is RunStatus.SUCCEEDED else run.reason,
        seconds=run.ended - run.started,
        driven=float(told[PLACE_STATUS].values["m"]),
        seen={room.name: share for room in flat.rooms if (share := _seen(flat, space, room, grid)) >= 0.0},
        contacts=(*(contact.name for contact in rig.world.contacts), *contacts),
        proposed=len(rooms),
        right=_are_right(flat, space, rooms),
        reached=reached,
        misses=misses,
    )


def _floor(flat: Flat, space: FreeSpace, room: Room) -> np.ndarray:
    """Return the places in a room where the robot can stand, shape (n, 2), frame of the home."""
    can_stand = space.reachable((flat.start.x, flat.start.y), ROBOT_M)
    x, y = space.frame.centres()
    rows, columns = np.nonzero(can_stand)
    inside = [
        room.contains(float(x[column]), float(y[row])) for row, column in zip(rows, columns, strict=True)
    ]
    return np.stack([x[columns], y[rows]], axis=1)[inside]


def _seen(flat: Flat, space: FreeSpace, room: Room, grid: OccupancyGrid) -> float:
    """Return which part of a room's floor a map knows; below zero where the robot cannot get to."""
    floor = _floor(flat, space, room)
    if not len(floor):
        return -1.0
    to_map = flat.start.inverse()
    known = 0
    for x, y in floor.tolist():
        row, column = grid.cell_of(*to_map.apply(x, y))
        known += grid.contains(row, column) and grid.cells[row, column] == FREE
    return known / len(floor)


def _are_right(flat: Flat, space: FreeSpace, rooms: Sequence[Hotspot]) -> bool:
    """Tell whether each room that the robot gets to has one proposed room, and no other is proposed."""
    to_map, left = flat.start.inverse(), list(rooms)
    for room in flat.rooms:
        floor = [to_map.apply(x, y) for x, y in _floor(flat, space, room).tolist()]
        if not floor:
            continue
        found = [each for each in left if sum(each.contains(x, y) for x, y in floor) >= OVERLAP * len(floor)]
        if len(found) != 1:
            return False
        left.remove(found[0])
    return not left


def _visit(
    flat: Flat, grid: OccupancyGrid, rooms: Sequence[Hotspot], seed: int
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Drive to each room on the map: how many were reached, why the others were not, and what was touched."""
    rig = make_rig(
        flat=flat, person="absent", seed=seed, grid=grid, hotspots=Hotspots(rooms), believed=Pose2()
    )
    misses = []
    for room in rooms:
        run = rig.run("goto_room", {"room": room.label}, limit_s=DRIVE_S)
        there = flat.start @ room.pose
        if run.status is not RunStatus.SUCCEEDED:
            misses.append(f"{room.label}: {run.reason}")
        elif (off := rig.world.robot_pose.distance_to(there)) > 0.3:
            misses.append(f"{room.label}: it stands {off:.1f} m away from there")
    contacts = tuple(contact.name for contact in rig.world.contacts)
    return len(rooms) - len(misses), tuple(misses), contacts


HEAD = ["home", "exploration", "minutes", "driven (m)", "rooms seen", "least of a room (%)", "contacts"]
HEAD += ["rooms proposed", "right", "goto_room"]


def row_of(home: Explored) -> list[str]:
    """Write a line of the table."""
    seen = sum(share >= SEEN_SHARE for share in home.seen.values())
    return [
        str(home.seed),
        home.ended or "complete",
        f"{home.seconds / 60:.1f}",
        f"{home.driven:.0f}",
        f"{seen} of {len(home.seen)}",
        f"{100 * min(home.seen.values()):.0f}",
        ", ".join(home.contacts) or "-",
        str(home.proposed),
        "yes" if home.right else "no",
        f"{home.reached} of {home.proposed}",
    ]


def total_of(homes: Sequence[Explored]) -> str:
    """Sum the homes up in a sentence."""
    return (
        f"Of {len(homes)} homes: every room seen in {sum(home.all_seen for home in homes)}, "
        f"nothing touched in {sum(not home.contacts for home in homes)}, "
        f"rooms proposed right in {sum(home.right for home in homes)}; "
        f"goto_room reached {sum(home.reached for home in homes)} of {sum(home.proposed for home in homes)} "
        "proposed rooms."
    )


def table_of(homes: Sequence[Explored]) -> str:
    """Write the table and the sentence below it."""
    return f"{table(HEAD, [row_of(home) for home in homes])}\n\n{total_of(homes)}"


TABLE = RowTable(NAME, Explored, table_of)


def main(arguments: list[str] | None = None) -> int:
    """Explore, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description="Homes that the robot maps by itself in the rig")
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=list(range(31, 41)), help="of generated homes"
    )
    parser.add_argument(
        "--limit", type=float, default=LIMIT_S, metavar="S", help="simulated seconds for a home"
    )
    parser.add_argument("--jobs", type=int, default=2, help="homes at a time, each on a core")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    homes = []
    with processes(given.jobs) as pool:
        for home in pool.map(partial(explore, limit_s=given.limit), given.seeds):
            homes.append(home)
            print(" | ".join(row_of(home)), *home.misses, sep="\n  ", flush=True)
    TABLE.publish(homes, given.write, command_of("tools/exploration.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
