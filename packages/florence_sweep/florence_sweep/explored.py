"""Judges a map that the robot has made by itself: what it shows of each room, and whether it is of use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from florence_bt.app.bringup.options import ABSENT
from florence_bt.app.demo.rigs import make_rig
from florence_bt.app.maps.proposal import proposed_hotspots
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OccupancyGrid
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.flat import Flat, Room
from florence_bt.simulation.home.free_space import FreeSpace, free_space_of
from florence_bt.simulation.rig.rig import Rig
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_sweep.outcome import ALL_SEEN, Measures

DRIVE_S = 300.0
"""Simulated seconds for a drive to a room."""
ROBOT_M = 0.22
"""Where a disc of this radius gets to, metres, the robot is expected to get to."""
SEEN_SHARE = 0.8
"""A room is seen when the map knows so much of the floor on which the robot can stand there."""
OVERLAP = 0.6
"""A room is proposed right when its polygon has so much of the true room's floor, and of no other as much."""
THERE_M = 0.3
"""So near to the place of a room the robot must end, metres."""


def judge_map(flat: Flat, grid: OccupancyGrid, seed: int) -> tuple[Measures, tuple[str, ...]]:
    """Judge a map by the home, and by drives to the rooms that are proposed on it.

    Args:
        flat: The home.
        grid: The map; its frame is where the robot began.
        seed: Of the noise in the drives.

    Returns:
        How many rooms there are that the robot gets to, how many of them were seen, and the least part of one
        (%); how many rooms are proposed, whether these are the true ones, and how many of them ``goto_room``
        has truly reached. And what was touched in these drives.
    """
    space, rooms = free_space_of(flat), proposed_hotspots(grid)
    shares = [share for room in flat.rooms if (share := _seen(flat, space, room, grid)) >= 0.0]
    rig = make_rig(flat=flat, person=ABSENT, seed=seed, grid=grid, hotspots=Hotspots(rooms), believed=Pose2())
    return {
        "rooms": len(shares),
        "rooms seen": sum(share >= SEEN_SHARE for share in shares),
        ALL_SEEN: min(shares) >= SEEN_SHARE,
        "least of a room (%)": 100.0 * min(shares),
        "rooms proposed": len(rooms),
        "proposed right": are_right(flat, space, rooms),
        "reached by goto_room": sum(_reaches(rig, flat, room) for room in rooms),
    }, tuple(contact.name for contact in rig.world.contacts)


def _reaches(rig: Rig, flat: Flat, room: Hotspot) -> bool:
    """Drive to a room on the map, and tell whether the robot stands there in truth."""
    run = rig.run("goto_room", {"room": room.label}, limit_s=DRIVE_S)
    there = rig.world.robot_pose.distance_to(flat.start @ room.pose) <= THERE_M
    return run.status is RunStatus.SUCCEEDED and there


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
        known += grid.contains(row, column) and bool(grid.cells[row, column] == FREE)
    return known / len(floor)


def are_right(flat: Flat, space: FreeSpace, rooms: Sequence[Hotspot]) -> bool:
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
