"""The plan of a generated home: rectangular rooms, the walls between them, and doors that connect them all.

A home is a rectangle that is cut in two again and again. Most have a hall right across, with a door to each
room; in the others each cut gets at least one door, so that everybody walks through the rooms.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Span = tuple[float, float]

WALL_THICKNESS_M = 0.1
DOOR_WIDTH_M = (0.70, 0.90)
_GLASS_WIDTH_M = (1.2, 1.8)
_DOOR_MARGIN_M = 0.2
"""Between a door and the end of the wall that it shares with two rooms: the leaf's hinge and a frame."""

_SIDE_M = 2.2
"""No room is narrower; halls are."""

_LARGE_M2, _SMALL_M2 = 22.0, 13.0
"""Larger rooms are cut in two, smaller ones are not, others by chance."""

_HALL_CHANCE, _SECOND_DOOR_CHANCE, _BARE_GAP_CHANCE, _CLOSED_CHANCE = 0.75, 0.2, 0.15, 0.12
"""Chances of a hall, of a second door, of a gap without a door, of a door that is closed. Chosen."""
_NAMES = ("living_room", "bedroom", "kitchen", "guest_room", "study", "bedroom_2", "study_2", "guest_room_2")
"""The largest first; the smallest room is the bathroom."""


@dataclass(frozen=True, slots=True)
class Area:
    """A rectangle of the floor: spans along x and y in metres."""

    x: Span
    y: Span

    @property
    def size(self) -> float:
        """Square metres."""
        return (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point lies in it."""
        return self.x[0] <= x < self.x[1] and self.y[0] <= y < self.y[1]

    def turned(self) -> Area:
        """Return it seen from the other side: x and y exchanged."""
        return Area(self.y, self.x)


@dataclass(frozen=True, slots=True)
class Cut:
    """A wall: at which x it runs along y over a span, or (``along_x``) the other way round."""

    along_x: bool
    at: float
    span: Span


@dataclass(frozen=True, slots=True)
class Layout:
    """The plan.

    Attributes:
        rooms: Name -> its area, to the centre lines of its walls.
        walls: Walls with their doors, as entries of a flat's file.
        entrance: The room with the front door.
    """

    rooms: dict[str, Area]
    walls: list[dict[str, Any]]
    entrance: str


def plan_home(rng: np.random.Generator) -> Layout:
    """Draw a plan: 4 to 8 rooms on 50 to 110 square metres."""
    cuts: list[Cut] = []
    hall: Area | None = None
    width = _metres(rng, 8.4, 11.4)
    if rng.random() < _HALL_CHANCE:
        low = _metres(rng, 2.6, 3.8)
        high = round(low + _metres(rng, 1.4, 1.8), 2)
        top = round(high + _metres(rng, 3.1, 4.3), 2)
        hall = Area((0.0, width), (low, high))
        cuts += [Cut(True, low, hall.x), Cut(True, high, hall.x)]
        areas = _divide(Area(hall.x, (0.0, low)), rng, cuts) + _divide(Area(hall.x, (high, top)), rng, cuts)
    else:
        top = _metres(rng, 6.6, 8.0)
        areas = _divide(Area((0.0, width), (0.0, top)), rng, cuts)
    if rng.random() < 0.5:
        cuts = [replace(cut, along_x=not cut.along_x) for cut in cuts]
        areas, hall = [area.turned() for area in areas], hall.turned() if hall else None
        width, top = top, width
    outer = _outer_cuts(width, top)
    rooms = _named(areas, hall, outer.values())
    entrance = "hall" if hall else "living_room"
    walls = _outer_walls(outer, rooms, entrance, rng)
    for number, cut in enumerate(cuts, 1):
        walls.append(_wall(f"wall_{number}", cut, _doors_between(number, cut, rooms, hall, rng)))
    return Layout(rooms, walls, entrance)


def _metres(rng: np.random.Generator, low: float, high: float) -> float:
    return round(float(rng.uniform(low, high)), 2)


def _divide(area: Area, rng: np.random.Generator, cuts: list[Cut]) -> list[Area]:
    """Cut an area into rooms across its longer side; the walls are appended to ``cuts``."""
    along_x = area.x[1] - area.x[0] >= area.y[1] - area.y[0]
    low, high = area.x if along_x else area.y
    large_enough = area.size > _LARGE_M2 or (area.size > _SMALL_M2 and rng.random() < 0.5)
    if not large_enough or high - low < 2 * _SIDE_M:
        return [area]
    length = high - low
    at = round(low + min(max(length * float(rng.uniform(0.3, 0.7)), _SIDE_M), length - _SIDE_M), 2)
    cuts.append(Cut(not along_x, at, area.y if along_x else area.x))
    parts = [replace(area, x=span) if along_x else replace(area, y=span) for span in ((low, at), (at, high))]
    return [room for part in parts for room in _divide(part, rng, cuts)]


def _named(areas: list[Area], hall: Area | None, outer: Collection[Cut]) -> dict[str, Area]:
    """Name the rooms: the largest with an outer wall is the living room, the smallest the bathroom."""
    ordered = sorted(areas, key=lambda area: (-area.size, area.x, area.y))
    living_room = next(area for area in ordered if any(_shared(cut, area) for cut in outer))
    ordered.sort(key=lambda area: area is not living_room)
    rooms = dict(zip(_NAMES, ordered[:-1], strict=False))
    rooms["bathroom"] = ordered[-1]
    if hall:
        rooms["hall"] = hall
    return rooms


def _wall(name: str, cut: Cut, doors: list[dict[str, Any]]) -> dict[str, Any]:
    ends = [[end, cut.at] if cut.along_x else [cut.at, end] for end in cut.span]
    return {"name": name, "from": ends[0], "to": ends[1], "doors": doors}


def _outer_cuts(width: float, top: float) -> dict[str, Cut]:
    return {
        "south_wall": Cut(True, 0.0, (0.0, width)),
        "north_wall": Cut(True, top, (0.0, width)),
        "west_wall": Cut(False, 0.0, (0.0, top)),
        "east_wall": Cut(False, width, (0.0, top)),
    }


def _outer_walls(
    cuts: dict[str, Cut], rooms: dict[str, Area], entrance: str, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """Make the outer walls: the entrance has the front door, the living room often a glass balcony door."""
    doors: dict[str, list[dict[str, Any]]] = {name: [] for name in cuts}
    wanted = [("front_door", entrance, "wood", (0.9, 0.9))]
    if rng.random() < 0.6 and entrance != "living_room":
        wanted.append(("balcony_door", "living_room", "glass", _GLASS_WIDTH_M))
    for label, room, leaf, widths in wanted:
        sides = [
            (name, span) for name, cut in cuts.items() if (span := _shared(cut, rooms[room])) is not None
        ]
        name, span = sides[int(rng.integers(len(sides)))]
        doors[name].append(_door(label, span, widths, rng) | {"leaf": leaf, "colour": "#7d8f86"})
    return [_wall(name, cut, doors[name]) for name, cut in cuts.items()]


def _shared(cut: Cut, area: Area) -> Span | None:
    """Return the part of a wall along which an area lies, None for less than a door with its margins."""
    across, along = (area.y, area.x) if cut.along_x else (area.x, area.y)
    low, high = max(cut.span[0], along[0]), min(cut.span[1], along[1])
    fits = high - low >= DOOR_WIDTH_M[1] + 2 * _DOOR_MARGIN_M
    return (low, high) if cut.at in across and fits else None


def _doors_between(
    number: int, cut: Cut, rooms: dict[str, Area], hall: Area | None, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """Make the doors of an inner wall: each room to the hall; between other rooms one, and more by chance."""
    pairs = [
        (first, second, span)
        for first, second in itertools.combinations(rooms, 2)
        if (span := _common(cut, rooms[first], rooms[second])) is not None
    ]
    needed = -1 if hall or not pairs else int(rng.integers(len(pairs)))
    doors = []
    for index, (first, second, span) in enumerate(pairs):
        if "hall" in (first, second) or index == needed or rng.random() < _SECOND_DOOR_CHANCE:
            door = _door(f"door_{number}_{index + 1}", span, DOOR_WIDTH_M, rng)
            doors.append(door | _leaf(rng) if rng.random() >= _BARE_GAP_CHANCE else door)
    return doors


def _common(cut: Cut, first: Area, second: Area) -> Span | None:
    """Return where two rooms lie on the two sides of a wall, from the wall's first end."""
    one, other = _shared(cut, first), _shared(cut, second)
    across = [area.y if cut.along_x else area.x for area in (first, second)]
    if one is None or other is None or across[0].index(cut.at) == across[1].index(cut.at):
        return None
    low, high = max(one[0], other[0]) - cut.span[0], min(one[1], other[1]) - cut.span[0]
    return (low, high) if high - low >= DOOR_WIDTH_M[1] + 2 * _DOOR_MARGIN_M else None


def _door(name: str, span: Span, widths: Span, rng: np.random.Generator) -> dict[str, Any]:
    """Place a gap somewhere in a part of a wall, given in metres from the wall's first end."""
    most = min(widths[1], span[1] - span[0] - 2 * _DOOR_MARGIN_M)
    width = _metres(rng, min(widths[0], most), most)
    room = width / 2 + _DOOR_MARGIN_M
    return {"name": name, "centre": _metres(rng, span[0] + room, span[1] - room), "width": width}


def _leaf(rng: np.random.Generator) -> dict[str, Any]:
    """Make a leaf that was open on the map, and is about as open now, or closed."""
    side = 1 if rng.random() < 0.5 else -1
    now = 0.0 if rng.random() < _CLOSED_CHANCE else round(side * float(rng.uniform(85.0, 110.0)))
    return {"leaf": "wood", "mapped_open_deg": side * 90.0, "open_deg": now}


def door_spots(layout: Layout) -> Iterator[tuple[tuple[float, float], tuple[float, float], str]]:
    """Yield both sides of each door between rooms, 0.5 m from the wall, and the door's name."""
    for wall in layout.walls[4:]:
        (x, y), along_x = wall["from"], wall["from"][1] == wall["to"][1]
        for door in wall["doors"]:
            ahead = door["centre"]
            sides = [(x + ahead, y + side) if along_x else (x + side, y + ahead) for side in (-0.5, 0.5)]
            yield sides[0], sides[1], door["name"]
