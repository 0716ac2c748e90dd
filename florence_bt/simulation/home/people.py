"""People of the flat: puts them by chance where a robot can find and approach them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.flat import Colour, Flat, Room
from florence_bt.simulation.home.free_space import FreeSpace, free_space_of
from florence_bt.simulation.home.person import BODY_RADIUS_M, PersonSpec, Posture

__all__ = ["PersonSpec", "Posture", "approach_spots", "is_approachable", "place_person"]

_APPROACH_M = 0.5
"""Distance at which the robot stands before a person (document, section 3.10)."""

ROBOT_ROOM_M = 0.3
"""Circumscribed radius of the padded footprint (0.2625, REFERENCE 7.4) and room for errors of the map."""

_LEGS_RADIUS_M = 0.15
"""The robot's base must get past these; with the robot's radius it stays below the approach's distance."""

_SIGHT_M = (1.1, 3.9)
"""Distances of a person from the room's hotspot: the chest and the legs are then in the Kinect's view."""

_DOOR_M = 0.8
"""A person does not stand this close to the middle of a door."""

_START_M = 0.8
"""Nor this close to where the robot starts."""

_TRIES = 2000
"""Poses that are tried for a person. Chosen."""


def place_person(
    flat: Flat,
    room: str | None,
    rng: np.random.Generator,
    *,
    name: str = "user",
    posture: Literal["standing", "sitting"] | None = None,
) -> PersonSpec:
    """Put a person somewhere at random: free, to be seen from the room's hotspot, to be approached from it.

    Args:
        flat: The flat.
        room: In which room; any room when None.
        rng: Where the chance comes from.
        name: The person's name.
        posture: What the person does; by chance when None (in a room without seats: standing).

    Returns:
        A person who blocks no way between rooms, such that the robot can stand 0.5 m away on at least one
        of three sides: the one that faces the room's hotspot and those 45 degrees beside it.

    Raises:
        ConfigError: The room is unknown, or has no such place.
    """
    chosen = flat.room(room) if room is not None else flat.rooms[int(rng.integers(len(flat.rooms)))]
    others = [other for other in flat.rooms if room is None and other != chosen]
    for candidate in (chosen, *others):
        person = _placed_in(flat, candidate, rng, name, posture)
        if person is not None:
            return person
    where = repr(chosen.name) if room is not None else "any room"
    raise ConfigError(
        f"no place for a {posture or 'standing'} person in {where}; give another room or posture"
    )


def _placed_in(
    flat: Flat,
    chosen: Room,
    rng: np.random.Generator,
    name: str,
    posture: Literal["standing", "sitting"] | None,
) -> PersonSpec | None:
    space = free_space_of(flat)
    seats = [seat.pose for seat in flat.seats if seat.room == chosen.name]
    if posture is None:
        posture = "sitting" if seats and rng.random() < 1 / 3 else "standing"
    candidates: Iterator[Pose2]
    if posture == "sitting":
        candidates = (seats[index] for index in rng.permutation(len(seats)))
    else:
        candidates = itertools.islice(_random_poses(chosen, rng), _TRIES)
    for pose in candidates:
        if is_approachable(flat, space, chosen, pose):
            shirt = _SHIRTS[int(rng.integers(len(_SHIRTS)))]
            height = 1.6 + 0.2 * float(rng.random())
            return PersonSpec(name, pose, posture, shirt=shirt, height=round(height, 3))
    return None


_SHIRTS: tuple[Colour, ...] = (
    (178, 34, 52),
    (28, 96, 160),
    (34, 120, 68),
    (196, 140, 28),
    (120, 60, 140),
    (70, 74, 80),
)


def _random_poses(room: Room, rng: np.random.Generator) -> Iterator[Pose2]:
    while True:
        yield Pose2(
            float(rng.uniform(*room.x)), float(rng.uniform(*room.y)), float(rng.uniform(-math.pi, math.pi))
        )


def is_approachable(flat: Flat, space: FreeSpace, room: Room, pose: Pose2) -> bool:
    """Tell whether a person may be here; what that means is said at :func:`place_person`.

    Args:
        flat: The flat.
        space: Its free space.
        room: The room whose hotspot the robot comes from.
        pose: Where the person would be, map frame.
    """
    hotspot = room.hotspot.pose
    if space.clearance_at(pose.x, pose.y) < BODY_RADIUS_M:
        return False
    if not _SIGHT_M[0] <= hotspot.distance_to(pose) <= _SIGHT_M[1]:
        return False
    if flat.start.distance_to(pose) < _START_M:
        return False
    if any(math.dist((door.x, door.y), (pose.x, pose.y)) < _DOOR_M for door in flat.doors):
        return False
    if not space.sees((hotspot.x, hotspot.y), (pose.x, pose.y)):
        return False
    before = space.reachable((hotspot.x, hotspot.y), ROBOT_ROOM_M)
    ways = space.reachable((hotspot.x, hotspot.y), ROBOT_ROOM_M, (pose.x, pose.y, _LEGS_RADIUS_M))
    if not ways[space.frame.cell_of(flat.start.x, flat.start.y)]:
        return False
    # Behind a closed door nobody is in the way.
    stops = [space.frame.cell_of(room.hotspot.pose.x, room.hotspot.pose.y) for room in flat.rooms]
    if not all(ways[stop] for stop in stops if before[stop]):
        return False
    return any(ways[space.frame.cell_of(*spot)] for spot in approach_spots(pose, hotspot))


def approach_spots(person: Pose2, robot: Pose2) -> Sequence[tuple[float, float]]:
    """Return where the robot would stand: 0.5 m from the person towards itself, and 45 degrees beside that.

    Source: REFERENCE 12.8.
    """
    towards = math.atan2(robot.y - person.y, robot.x - person.x)
    angles = (towards, towards + math.pi / 4, towards - math.pi / 4)
    return [(person.x + _APPROACH_M * math.cos(a), person.y + _APPROACH_M * math.sin(a)) for a in angles]
