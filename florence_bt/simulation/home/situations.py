"""Puts people where people are, class by class, without asking whether a robot can find them there.

:func:`~florence_bt.simulation.home.people.place_person` is the easy class: free, in view and easy to
approach.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.body import knee_reach
from florence_bt.simulation.home.flat import Colour, Flat
from florence_bt.simulation.home.free_space import (
    BoolGrid,
    FreeSpace,
    Point,
    cells_covered,
    free_space_of,
)
from florence_bt.simulation.home.people import ROBOT_ROOM_M, place_person
from florence_bt.simulation.home.person import Aid, Load, PersonSpec, Posture, half_width

_STANDING_M, _LEANING_M, _AID_M = 0.27, (0.42, 0.6), 0.42
"""Free metres around somebody who stands, who bends forward to something (least and most), and around a
rollator or a wheelchair."""

_SEAT_STEPS = [0.05 * step for step in range(20)]
_SHORTEST_WALK_M = 3.0
_START_M, _BODY_FROM_START_M = 0.7, 0.55
"""The middle of nobody is nearer to where the robot starts; and no part of who lies: it would touch it."""

_LED_SPEEDS, _CROSSING_SPEEDS = (0.25, 0.45), (0.3, 0.6)
"""m/s; the robot drives 0.45 m/s at most."""

_LED_FROM_M, _LED_AFTER_S = 1.2, 5.0
"""Distance of the robot from who leads it, and the time when they set off: 3 s after a rig has settled."""

_LED_TRIES, _LEG_TRIES = 10, 12
"""Beginnings of a walk that are tried, and places to go on to."""

_TURN_M, _BEHIND_M, _PAST_M, _ROUND_M = 0.45, 1.0, 0.7, 2.0
"""Free distance at which who leads turns round, if possible such that they get past a robot that is so far
behind, at this distance, without walking this much further."""

_ERRAND_S = 2.0, 6.0
"""Time that somebody who leads the robot stands in each room that they go to."""

_CROSSING_M, _CLEAR_OF_START_M = (0.5, 1.5), 2.0
"""Distance to each side of the way at which somebody crosses it, and from the place where the walk begins."""

_PAUSE_S = 5.0, 20.0
"""Time that somebody who walks there and back stays at each end."""

_APART_M = 2.0
"""People of a company are as far apart at first: two who lie do not touch."""

_CHILD_CHANCE, _BED_CHANCE = 0.2, 0.65
"""Chances that somebody is a child, and that who lies does so on a bed where there is one. Chosen."""
_TRIES = 300
"""Draws until something fits the home. Chosen."""

DECOYS = (
    "yucca",
    "ficus",
    "coat_stand",
    "bare_coat_stand",
    "umbrella_stand",
    "floor_lamp",
    "curtain",
    "plant",
    "small_plant",
)
"""Models, with or without a number behind, that look somewhat like people: where nobody is, the robot is sent
to a room with one of these."""

Random = np.random.Generator


def easy(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person in view of a room's hotspot, easy to approach, standing or on their own stool."""
    return place_person(flat, None, rng)


def standing(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person standing anywhere free, one in four leaning on something."""
    space = free_space_of(flat)
    if rng.random() >= 0.25:
        x, y = _free_place(flat, space, rng, _STANDING_M)
        return _person(rng, Pose2(x, y, float(rng.uniform(-math.pi, math.pi))), "standing")
    x, y = _free_place(flat, space, rng, *_LEANING_M)
    headings = np.linspace(-math.pi, math.pi, 16, endpoint=False).tolist()
    ahead = [space.clearance_at(*Pose2(x, y, heading).apply(0.4, 0.0)) for heading in headings]
    return _person(rng, Pose2(x, y, headings[int(np.argmin(ahead))]), "leaning")


def sitting(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person sitting on the furniture, the shins before its edge and where nothing else stands."""
    frame = free_space_of(flat).frame
    someone = _person(rng, Pose2(), "seated")
    poses = []
    for place in (place for place in flat.places if place.posture == "seated"):
        own = [solid for solid in flat.solids if solid.name == place.furniture]
        seat = cells_covered(frame, (solid for solid in own if solid.top <= place.height + 0.01), 0.5)
        others = (solid for solid in flat.solids if solid.name != place.furniture and solid.bottom < 0.4)
        taken = cells_covered(frame, others, 0.1)
        own_steps = [step for step in _SEAT_STEPS if _covers(seat, flat, place.pose.apply(step, 0.0))]
        edge = max(own_steps, default=0.0)
        forward = max(0.0, edge + 0.05 - knee_reach(someone.height))
        hips = Pose2(*place.pose.apply(forward, 0.0), place.pose.yaw)
        legs = [hips.apply(step, 0.0) for step in np.arange(edge - forward + 0.05, 0.6, 0.05).tolist()]
        if all(flat.room_at(*point) and not _covers(taken, flat, point) for point in legs):
            poses.append((hips, place.height))
    if not poses:
        raise ConfigError(f"{flat.name!r} has no place to sit", valid=["a home whose file has `places`"])
    pose, height = poses[int(rng.integers(len(poses)))]
    return replace(someone, pose=pose, surface=height)


def lying(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person lying in bed, or on the floor."""
    beds = [place for place in flat.places if place.posture == "lying"]
    if beds and rng.random() < _BED_CHANCE:
        place = beds[int(rng.integers(len(beds)))]
        return _person(rng, place.pose, "lying", surface=place.height)
    space = free_space_of(flat)
    for _ in range(_TRIES):
        x, y = _free_place(flat, space, rng, _STANDING_M)
        pose = Pose2(x, y, float(rng.uniform(-math.pi, math.pi)))
        spec = _person(rng, pose, "lying")
        body = [pose.apply(float(along), 0.0) for along in np.linspace(-0.5, 0.5, 7) * spec.height]
        start = flat.start.x, flat.start.y
        if all(
            space.clearance_at(*each) >= 0.22 and math.dist(each, start) >= _BODY_FROM_START_M
            for each in body
        ):
            return spec
    raise ConfigError(f"nobody can lie on the floor of {flat.name!r}", valid=["another home"])


def walking(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person who walks between two places, in two rooms if there are, with a pause at each."""
    return _walker(flat, rng)


def aided(flat: Flat, rng: Random) -> PersonSpec:
    """Place a person with a bag, box, rollator or wheelchair; every second one on the way."""
    aids: list[tuple[Aid, Load]] = [
        ("rollator", "none"),
        ("wheelchair", "none"),
        ("none", "bag"),
        ("none", "box"),
    ]
    aid, load = aids[int(rng.integers(len(aids)))]
    if rng.random() < 0.5:
        return _walker(flat, rng, aid, load)
    space = free_space_of(flat)
    x, y = _free_place(flat, space, rng, _AID_M)
    headings = rng.uniform(-math.pi, math.pi, 12).tolist()
    ahead = [space.clearance_at(*Pose2(x, y, heading).apply(0.4, 0.0)) for heading in headings]
    return _person(rng, Pose2(x, y, headings[int(np.argmax(ahead))]), "standing", aid=aid, load=load)


SITUATIONS: dict[str, Callable[[Flat, Random], PersonSpec]] = {
    "easy": easy,
    "standing": standing,
    "sitting": sitting,
    "lying": lying,
    "walking": walking,
    "aided": aided,
}


def person_in(situation: str, flat: Flat, rng: Random) -> PersonSpec:
    """Make a person in a situation; clothes and height by chance too.

    Raises:
        ConfigError: The situation is unknown, or the home has no place for it; the message says what would
            have worked.
    """
    if situation not in SITUATIONS:
        raise ConfigError(f"unknown situation {situation!r}", valid=closest_first(situation, SITUATIONS))
    return SITUATIONS[situation](flat, rng)


def company_in(flat: Flat, rng: Random) -> list[PersonSpec]:
    """Place two or three people, each in a situation of their own (none is easy), at first well apart.

    Raises:
        ConfigError: The home has no place for them.
    """
    situations = [name for name in SITUATIONS if name != "easy"]
    wanted = int(rng.integers(2, 4))
    people: list[PersonSpec] = []
    for _ in range(_TRIES):
        name = "user" if not people else f"other person {len(people)}"
        person = replace(person_in(str(rng.choice(situations)), flat, rng), name=name)
        if all(person.pose.distance_to(other.pose) >= _APART_M for other in people):
            people.append(person)
        if len(people) == wanted:
            return people
    raise ConfigError(f"{flat.name!r} has no place for {wanted} people", valid=["another home"])


@dataclass(frozen=True, slots=True)
class LedWalk:
    """A walk on which somebody leads the robot through a home.

    Attributes:
        start: Where the robot stands at first, map frame; it faces the leader.
        leader: Who is to be followed: walks once.
        visitor: Who walks to and fro across the leader's way.
    """

    start: Pose2
    leader: PersonSpec
    visitor: PersonSpec


def led_walk(flat: Flat, rng: Random, length_m: float = 60.0) -> LedWalk:
    """Choose a walk from room to room, through doors, where the robot fits everywhere.

    Args:
        flat: The home.
        rng: Where the chance comes from.
        length_m: The least length of the leader's route, metres.

    Raises:
        ConfigError: The home has no room for such a walk.
    """
    space = free_space_of(flat)
    for _ in range(_LED_TRIES):
        legs = _ways_to_rooms(flat, space, rng, length_m)
        route = list(itertools.chain(*legs))
        start = _start_behind(space, route[:2]) if route else None
        crossing = _crossing(space, rng, route) if start is not None else None
        if start is None or crossing is None:
            continue
        leader = _on_route(rng, route, _LED_SPEEDS)
        visitor = _on_route(rng, crossing, _CROSSING_SPEEDS)
        # Only at the end of a leg; the first point of all is where they stand.
        stops = itertools.chain(*([0.0] * (len(leg) - 1) + [_errand(rng)] for leg in legs[1:]))
        leader = replace(leader, wait=_LED_AFTER_S, once=True, pauses=tuple(stops))
        return LedWalk(start, leader, replace(visitor, name="visitor"))
    raise ConfigError(f"nobody can lead the robot through {flat.name!r}", valid=["another home"])


def room_with_decoy(flat: Flat, rng: Random) -> str:
    """Choose a room with something that looks like a person, if there is one."""
    names = [
        room.name
        for solid in flat.solids
        if solid.name.startswith(DECOYS) and (room := flat.room_at(solid.x, solid.y)) is not None
    ]
    choice = sorted(set(names)) or [room.name for room in flat.rooms]
    return choice[int(rng.integers(len(choice)))]


def _covers(cells: BoolGrid, flat: Flat, point: Point) -> bool:
    """Tell whether a point in a room lies in one of the cells."""
    return flat.room_at(*point) is not None and bool(cells[free_space_of(flat).frame.cell_of(*point)])


def _errand(rng: Random) -> float:
    return round(float(rng.uniform(*_ERRAND_S)), 1)


def _ways_to_rooms(flat: Flat, space: FreeSpace, rng: Random, length: float) -> list[list[Point]]:
    """Return points for the robot to go straight between, to other rooms again and again; empty without.

    Returns:
        Where the walk begins, alone, and then the further points of the way to each next room.
    """
    legs = [[_free_place(flat, space, rng, _TURN_M)]]
    reached = space.reachable(legs[0][0], ROBOT_ROOM_M)
    while _length(route := list(itertools.chain(*legs))) < length:
        leg: list[Point] = []
        for _ in range(_LEG_TRIES):
            goal = _free_place(flat, space, rng, _TURN_M, among=reached)
            if flat.room_at(*goal) == flat.room_at(*route[-1]):
                continue
            way = space.shortest_way(route[-1], goal, ROBOT_ROOM_M)
            if way is None or _length(way) < _SHORTEST_WALK_M:
                continue
            leg = way[1:]
            if _can_turn_round(space, way):
                break
        if not leg:
            return []
        legs.append(leg)
    return legs


def _can_turn_round(space: FreeSpace, way: Sequence[Point]) -> bool:
    """Tell whether somebody can come back along a way past the robot that followed."""
    robot = _point_along(way[::-1], _BEHIND_M)
    back = space.shortest_way(way[-1], way[0], half_width("none"), [(*robot, _PAST_M)])
    return back is not None and _length(back) <= _length(way) + _ROUND_M


def _start_behind(space: FreeSpace, leg: Sequence[Point]) -> Pose2 | None:
    """Return where the robot faces somebody who sets off on a leg: as much behind them as is free."""
    (x, y), (to_x, to_y) = leg
    back = math.atan2(y - to_y, x - to_x)
    for turn in sorted(np.linspace(-math.pi / 2, math.pi / 2, 13).tolist(), key=abs):
        towards = back + turn
        spot = (x + _LED_FROM_M * math.cos(towards), y + _LED_FROM_M * math.sin(towards))
        if space.fits(spot, (x, y), ROBOT_ROOM_M):
            return Pose2(*spot, normalize_angle(towards + math.pi))
    return None


def _crossing(space: FreeSpace, rng: Random, route: Sequence[Point]) -> list[Point] | None:
    """Choose the ends of a straight way across a route, somewhere."""
    total, radius = _length(route), half_width("none")
    for _ in range(_TRIES):
        along = float(rng.uniform(0.0, total - 0.1))
        middle, ahead = _point_along(route, along), _point_along(route, along + 0.1)
        if math.dist(middle, route[0]) < _CLEAR_OF_START_M + _CROSSING_M[1]:
            continue
        across = math.atan2(ahead[1] - middle[1], ahead[0] - middle[0]) + math.pi / 2
        ends = [_furthest(space, middle, across + turn, radius) for turn in (0.0, math.pi)]
        if all(math.dist(end, middle) >= _CROSSING_M[0] for end in ends):
            return ends
    return None


def _furthest(space: FreeSpace, start: Point, heading: float, radius: float) -> Point:
    """Return the furthest point that somebody gets to straight on, up to the longest way across."""
    points = [
        Pose2(*start, heading).apply(distance, 0.0)
        for distance in np.arange(0.1, _CROSSING_M[1], 0.1).tolist()
    ]
    return max(
        itertools.takewhile(lambda point: space.fits(start, point, radius), points),
        key=lambda point: math.dist(start, point),
        default=start,
    )


def _length(points: Sequence[Point]) -> float:
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


def _point_along(points: Sequence[Point], along: float) -> Point:
    """Return the point at so many metres along straight legs; the last one beyond their end."""
    for (ax, ay), (bx, by) in itertools.pairwise(points):
        length = math.dist((ax, ay), (bx, by))
        if along < length:
            return ax + along / length * (bx - ax), ay + along / length * (by - ay)
        along -= length
    return points[-1]


def _on_route(rng: Random, points: Sequence[Point], speeds: tuple[float, float]) -> PersonSpec:
    """Make somebody who walks from the first of some points to the others."""
    (x, y), (to_x, to_y) = points[:2]
    heading = math.atan2(to_y - y, to_x - x)
    speed = round(float(rng.uniform(*speeds)), 2)
    return _person(rng, Pose2(x, y, heading), "walking", route=tuple(points[1:]), speed=speed)


def _free_place(
    flat: Flat,
    space: FreeSpace,
    rng: Random,
    least: float,
    most: float = math.inf,
    among: BoolGrid | None = None,
) -> tuple[float, float]:
    """Choose a point of a room's floor with free metres around, any as likely as any other."""
    inside = np.zeros_like(space.clearance, bool)
    x, y = space.frame.centres()
    for room in flat.rooms:
        columns, rows = (x >= room.x[0]) & (x < room.x[1]), (y >= room.y[0]) & (y < room.y[1])
        inside |= rows[:, None] & columns[None, :]
    away = np.hypot(x[None, :] - flat.start.x, y[:, None] - flat.start.y) >= _START_M
    inside &= away & (space.clearance >= least) & (space.clearance <= most)
    cells = np.argwhere(inside if among is None else inside & among)
    if not len(cells):
        raise ConfigError(f"{flat.name!r} has no free place", valid=["another home"])
    row, column = cells[int(rng.integers(len(cells)))]
    return float(x[column]), float(y[row])


def _walker(flat: Flat, rng: Random, aid: Aid = "none", load: Load = "none") -> PersonSpec:
    space, radius = free_space_of(flat), half_width(aid)
    for attempt in range(_TRIES):
        start, goal = (_free_place(flat, space, rng, radius + 0.05) for _ in range(2))
        elsewhere = flat.room_at(*start) != flat.room_at(*goal) or attempt > _TRIES // 2
        if not elsewhere or math.dist(start, goal) < _SHORTEST_WALK_M:
            continue
        way = space.shortest_way(start, goal, radius)
        if way is not None:
            heading = math.atan2(way[1][1] - start[1], way[1][0] - start[0])
            speed = round(float(rng.uniform(0.3, 0.8)), 2)
            route = tuple(way[1:])
            person = _person(
                rng, Pose2(*start, heading), "walking", route=route, speed=speed, aid=aid, load=load
            )
            return replace(person, wait=round(float(rng.uniform(*_PAUSE_S)), 1))
    raise ConfigError(f"nobody can walk far in {flat.name!r}", valid=["another home"])


def _person(
    rng: Random,
    pose: Pose2,
    posture: Posture,
    *,
    surface: float = 0.0,
    route: tuple[Point, ...] = (),
    speed: float = 0.5,
    aid: Aid = "none",
    load: Load = "none",
) -> PersonSpec:
    """Make somebody of any height, in clothes of any colour; children push and carry nothing."""
    child = aid == load == "none" and rng.random() < _CHILD_CHANCE
    height = round(float(rng.uniform(0.95, 1.5) if child else rng.uniform(1.5, 1.95)), 2)
    shirt, trousers = _colour(rng, 40, 230), _colour(rng, 25, 150)
    return PersonSpec(
        "user", pose, posture, route, speed, shirt, height, trousers, surface=surface, aid=aid, load=load
    )


def _colour(rng: Random, low: int, high: int) -> Colour:
    red, green, blue = (int(channel) for channel in rng.integers(low, high, 3))
    return red, green, blue
