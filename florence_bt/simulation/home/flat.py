"""The simulated flat as plain values: solids, rooms, hotspots and seats, read from one source file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, AllowInfNan, BaseModel, ConfigDict, Field, model_validator

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.core.paths import find_data
from florence_bt.simulation.home.model_reader import Location, ModelReader
from florence_bt.simulation.sensors.scene import Surface

Colour = tuple[int, int, int]
"""Red, green, blue, each 0 to 255."""


@dataclass(frozen=True, slots=True)
class Solid:
    """An upright box or cylinder that stands still.

    Attributes:
        name: The wall or piece of furniture it belongs to; several solids may share it.
        x: Centre in the map frame, metres.
        y: Centre in the map frame, metres.
        yaw: Direction of the box's first side in the map frame, radians.
        half: Half of the box's sides in metres; None for a cylinder.
        radius: Radius of the cylinder in metres; 0 for a box.
        bottom: Height of the lower face above the floor in metres.
        top: Height of the upper face above the floor in metres.
        colour: Its colour.
        surface: What the laser and the Kinect see of it.
    """

    name: str
    x: float
    y: float
    yaw: float
    half: tuple[float, float] | None
    radius: float
    bottom: float
    top: float
    colour: Colour
    surface: Surface = "plain"


@dataclass(frozen=True, slots=True)
class FlatHotspot:
    """A labelled pose of the robot in the map frame (document, section 3.8)."""

    label: str
    pose: Pose2


@dataclass(frozen=True, slots=True)
class Room:
    """A rectangular room.

    Attributes:
        name: Its label.
        x: Lowest and highest x in metres (centre lines of its walls).
        y: Lowest and highest y in metres.
        hotspot: Where the robot looks around in it.
    """

    name: str
    x: tuple[float, float]
    y: tuple[float, float]
    hotspot: FlatHotspot

    @property
    def polygon(self) -> tuple[tuple[float, float], ...]:
        """The four corners, counter-clockwise."""
        (left, right), (low, high) = self.x, self.y
        return ((left, low), (right, low), (right, high), (left, high))

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point of the map frame lies in the room."""
        return self.x[0] <= x < self.x[1] and self.y[0] <= y < self.y[1]


@dataclass(frozen=True, slots=True)
class Seat:
    """A place where a person may sit, and where that person looks."""

    room: str
    pose: Pose2


@dataclass(frozen=True, slots=True)
class RestingPlace:
    """A piece of furniture, or a part of it, that one person sits or lies on.

    Attributes:
        furniture: The name of the piece.
        posture: What a person does there.
        pose: The middle of the hips of somebody who sits, and where they look; the middle of the body of
            somebody who lies, and where their head is from there. Map frame.
        height: Of the surface above the floor in metres.
    """

    furniture: str
    posture: Literal["seated", "lying"]
    pose: Pose2
    height: float


@dataclass(frozen=True, slots=True)
class Door:
    """A gap in a wall: its centre and its width in metres, and whether its leaf closes it now."""

    name: str
    x: float
    y: float
    width: float
    closed: bool = False


@dataclass(frozen=True, slots=True)
class Flat:
    """The simulated flat.

    Attributes:
        name: Names the generated files.
        start: Where the robot stands at first.
        floor_colour: Colour of the floor.
        solids: Walls and furniture.
        mapped: The same as they stood when the map was made.
        doors: Gaps in the walls.
        rooms: The rooms; together they cover the flat.
        objects: Hotspots that belong to objects instead of rooms.
        seats: Where people may sit on a stool of their own.
        places: Where people may sit or lie on the furniture.
    """

    name: str
    start: Pose2
    floor_colour: Colour
    solids: tuple[Solid, ...]
    mapped: tuple[Solid, ...]
    doors: tuple[Door, ...]
    rooms: tuple[Room, ...]
    objects: tuple[FlatHotspot, ...]
    seats: tuple[Seat, ...]
    places: tuple[RestingPlace, ...]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Lowest x, lowest y, highest x, highest y over all rooms, metres."""
        return (
            min(room.x[0] for room in self.rooms),
            min(room.y[0] for room in self.rooms),
            max(room.x[1] for room in self.rooms),
            max(room.y[1] for room in self.rooms),
        )

    def room(self, name: str) -> Room:
        """Return the room of a name.

        Raises:
            ConfigError: There is no such room; the message lists those that exist.
        """
        for room in self.rooms:
            if room.name == name:
                return room
        names = [room.name for room in self.rooms]
        raise ConfigError(f"the flat has no room {name!r}", valid=closest_first(name, names))

    def room_at(self, x: float, y: float) -> Room | None:
        """Return the room that holds a point of the map frame, or None."""
        return next((room for room in self.rooms if room.contains(x, y)), None)


def default_flat_file() -> Path:
    """Return the source file of the flat that comes with the project."""
    return find_data("maps", "flat.source.yaml")


def load_flat(file: Path | None = None) -> Flat:
    """Read a flat.

    Args:
        file: The source file; the project's own flat when not given.

    Raises:
        ConfigError: The file is missing or wrong, with file:line:column.
    """
    source = ModelReader(file if file is not None else default_flat_file())
    entries = source.parse(FlatFile)
    _check_names(source, entries)
    for index, piece in enumerate(entries.furniture):
        if piece.model not in entries.models:
            raise source.unknown_at(("furniture", index, "model"), "model", piece.model, list(entries.models))
    for model in entries.places:
        if model not in entries.models:
            raise source.unknown_at(("places", model), "model", model, list(entries.models))
    flat = build_flat(entries)
    _check_places(source, flat)
    return flat


def build_flat(entries: FlatFile) -> Flat:
    """Build the flat that the entries of a source file describe; their names must fit together."""
    return Flat(
        name=entries.name,
        start=_pose(entries.start),
        floor_colour=_colour(entries.floor),
        solids=tuple(_walls(entries.walls, mapped=False)) + tuple(_furniture(entries)),
        mapped=tuple(_walls(entries.walls, mapped=True)) + tuple(_mapped_furniture(entries)),
        doors=tuple(_doors(entries.walls)),
        rooms=tuple(
            Room(name, room.x, room.y, FlatHotspot(name, _pose(room.hotspot)))
            for name, room in entries.rooms.items()
        ),
        objects=tuple(FlatHotspot(label, _pose(pose)) for label, pose in entries.hotspots.items()),
        seats=tuple(Seat(seat.room, _pose(seat)) for seat in entries.seats),
        places=tuple(_places(entries)),
    )


def _pose(entry: PoseEntry) -> Pose2:
    return Pose2(entry.x, entry.y, normalize_angle(math.radians(entry.phi_deg)))


def _stand(piece: FurnitureEntry) -> Pose2:
    return Pose2(piece.x, piece.y, math.radians(piece.turn_deg))


def _colour(text: str) -> Colour:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def _walls(walls: WallsEntry, *, mapped: bool) -> Iterator[Solid]:
    """Yield the pieces between the doors, a lintel above each door, and the doors' leaves."""
    for wall in walls.lines:
        length = math.dist(wall.from_, wall.to)
        start = -walls.thickness / 2
        for door in sorted(wall.doors, key=lambda each: each.centre):
            edge = door.centre - door.width / 2
            yield _wall_piece(walls, wall, start, edge, 0.0)
            start = door.centre + door.width / 2
            if walls.door_height < walls.height:
                yield _wall_piece(walls, wall, edge, start, walls.door_height)
            if door.leaf != "none":
                yield _leaf(walls, wall, door, mapped=mapped)
        yield _wall_piece(walls, wall, start, length + walls.thickness / 2, 0.0)


def _wall_piece(walls: WallsEntry, wall: WallEntry, start: float, end: float, bottom: float) -> Solid:
    (x, y), along_x = wall.from_, wall.from_[1] == wall.to[1]
    middle = (start + end) / 2
    return Solid(
        name=wall.name,
        x=x + middle if along_x else x,
        y=y if along_x else y + middle,
        yaw=0.0 if along_x else math.pi / 2,
        half=((end - start) / 2, walls.thickness / 2),
        radius=0.0,
        bottom=bottom,
        top=walls.height,
        colour=_colour(walls.colour),
    )


def _leaf(walls: WallsEntry, wall: WallEntry, door: DoorEntry, *, mapped: bool) -> Solid:
    """Make a door's leaf; its hinge is beside the gap, so that an open one does not narrow it."""
    along = Pose2(*wall.from_, 0.0 if wall.from_[1] == wall.to[1] else math.pi / 2)
    degrees = door.open_deg if door.mapped_open_deg is None or not mapped else door.mapped_open_deg
    closed = abs(degrees) < _CLOSED_DEG
    x, y = along.apply(door.centre - door.width / 2 - (0.0 if closed else _LEAF_M / 2), 0.0)
    hinge = Pose2(x, y, along.yaw + math.radians(degrees))
    x, y = hinge.apply(door.width / 2, 0.0)
    glass = door.leaf == "glass"
    return Solid(
        name=door.name,
        x=x,
        y=y,
        yaw=hinge.yaw,
        half=(door.width / 2, _LEAF_M / 2),
        radius=0.0,
        bottom=0.0,
        top=walls.door_height,
        colour=_colour(door.colour),
        surface="glass" if glass else "plain",
    )


_LEAF_M = 0.04
"""Thickness of a door's leaf."""

_CLOSED_DEG = 5.0
"""A door that is open less than this is closed."""


def _doors(walls: WallsEntry) -> Iterator[Door]:
    for wall in walls.lines:
        (x, y), along_x = wall.from_, wall.from_[1] == wall.to[1]
        for door in wall.doors:
            closed = door.leaf != "none" and abs(door.open_deg) < _CLOSED_DEG
            here = (x + door.centre * along_x, y + door.centre * (not along_x))
            yield Door(door.name, *here, door.width, closed)


def _furniture(entries: FlatFile) -> Iterator[Solid]:
    for piece in entries.furniture:
        for part in entries.models[piece.model]:
            yield _placed(piece, _stand(piece), part)


def _mapped_furniture(entries: FlatFile) -> Iterator[Solid]:
    """Yield what stood there when the map was made, where it stood then."""
    for piece in entries.furniture:
        if piece.on_map:
            then = _stand(piece) if piece.moved_from is None else _pose(piece.moved_from)
            for part in entries.models[piece.model]:
                yield _placed(piece, then, part)


def _places(entries: FlatFile) -> Iterator[RestingPlace]:
    for piece in entries.furniture:
        for entry in entries.places.get(piece.model, ()):
            turned = _stand(piece)
            x, y = turned.apply(entry.x, entry.y)
            pose = Pose2(x, y, normalize_angle(turned.yaw + math.radians(entry.phi_deg)))
            yield RestingPlace(piece.name, entry.posture, pose, entry.height)


def _placed(piece: FurnitureEntry, turned: Pose2, part: PartEntry) -> Solid:
    x, y = turned.apply(*part.at)
    return Solid(
        name=piece.name,
        x=x,
        y=y,
        yaw=turned.yaw,
        half=(part.box[0] / 2, part.box[1] / 2) if part.box is not None else None,
        radius=part.cylinder if part.cylinder is not None else 0.0,
        bottom=part.z[0],
        top=part.z[1],
        colour=_colour(part.colour or piece.colour),
        surface=part.surface,
    )


def _check_names(source: ModelReader, entries: FlatFile) -> None:
    """Check that things that the robot can touch have unique names; so have those it can drive to."""
    seen: set[str] = set()
    named: list[tuple[Location, str]]
    named = [(("walls", "lines", index, "name"), wall.name) for index, wall in enumerate(entries.walls.lines)]
    named += [
        (("walls", "lines", index, "doors", place, "name"), door.name)
        for index, wall in enumerate(entries.walls.lines)
        for place, door in enumerate(wall.doors)
    ]
    named += [(("furniture", index, "name"), piece.name) for index, piece in enumerate(entries.furniture)]
    for location, name in named:
        if name in seen:
            raise source.error_at(location, f"the name {name!r} is given twice")
        seen.add(name)
    for label in entries.hotspots:
        if label in entries.rooms:
            raise source.error_at(("hotspots", label), f"{label!r} is a room already")


def _check_places(source: ModelReader, flat: Flat) -> None:
    """Check that hotspots, seats and the start lie where they claim to lie."""
    names = [room.name for room in flat.rooms]
    for room in flat.rooms:
        if not room.contains(room.hotspot.pose.x, room.hotspot.pose.y):
            raise source.error_at(
                ("rooms", room.name, "hotspot"), f"the hotspot lies outside of {room.name!r}"
            )
    for hotspot in flat.objects:
        if flat.room_at(hotspot.pose.x, hotspot.pose.y) is None:
            raise source.error_at(("hotspots", hotspot.label), f"{hotspot.label!r} lies in no room")
    for index, seat in enumerate(flat.seats):
        if seat.room not in names:
            raise source.unknown_at(("seats", index, "room"), "room", seat.room, names)
        if not flat.room(seat.room).contains(seat.pose.x, seat.pose.y):
            raise source.error_at(("seats", index), f"the seat lies outside of {seat.room!r}")
    if flat.room_at(flat.start.x, flat.start.y) is None:
        raise source.error_at(("start",), "the start lies in no room")


def _check_colour(text: str) -> str:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise ValueError(f"{text!r} is not a colour; write it as '#rrggbb'")
    return text


def _check_span(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError(f"the first number must be below the second, not {span[0]} and {span[1]}")
    return span


Finite = Annotated[float, AllowInfNan(False)]
Metres = Annotated[float, Field(gt=0.0, lt=100.0)]
Point = tuple[Finite, Finite]
Span = Annotated[tuple[Finite, Finite], AfterValidator(_check_span)]
HexColour = Annotated[str, AfterValidator(_check_colour)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=60)]


class Entry(BaseModel):
    """An entry of the file: nothing unknown, nothing changed later."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PoseEntry(Entry):
    """A place and a direction."""

    x: Finite
    y: Finite
    phi_deg: Finite = 0.0


class DoorEntry(Entry):
    """A gap in a wall, with or without a leaf that hangs at the end of the gap where the wall begins.

    ``open_deg`` turns the leaf counter-clockwise, ``mapped_open_deg`` is what the map shows.
    """

    name: Name
    centre: Metres
    width: Metres
    leaf: Literal["none", "wood", "glass"] = "none"
    open_deg: Annotated[float, Field(ge=-170.0, le=170.0)] = 0.0
    mapped_open_deg: Annotated[float, Field(ge=-170.0, le=170.0)] | None = None
    colour: HexColour = "#d9cdb8"


class WallEntry(Entry):
    """A straight wall along x or y between two points of its centre line."""

    name: Name
    from_: Point = Field(alias="from")
    to: Point
    doors: tuple[DoorEntry, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> WallEntry:
        along_x = self.from_[1] == self.to[1]
        if along_x == (self.from_[0] == self.to[0]):
            raise ValueError(f"the wall {self.name!r} must run along x or along y")
        axis = 0 if along_x else 1
        if self.to[axis] < self.from_[axis]:
            raise ValueError(f"the wall {self.name!r} must run towards increasing coordinates")
        end = 0.0
        for door in sorted(self.doors, key=lambda each: each.centre):
            if door.centre - door.width / 2 < end:
                raise ValueError(f"the door {door.name!r} overlaps another one or the wall's end")
            end = door.centre + door.width / 2
        if end > self.to[axis] - self.from_[axis]:
            raise ValueError(f"a door of the wall {self.name!r} reaches beyond the wall's end")
        return self


class WallsEntry(Entry):
    """All walls and what they have in common."""

    height: Metres
    thickness: Metres
    colour: HexColour
    door_height: Metres
    lines: Annotated[tuple[WallEntry, ...], Field(min_length=1)]


class RoomEntry(Entry):
    """A rectangle of the floor and the place in it where the robot looks around."""

    x: Span
    y: Span
    hotspot: PoseEntry


class SeatEntry(PoseEntry):
    """A place where a person may sit."""

    room: Name


class PartEntry(Entry):
    """A box or an upright cylinder of a model."""

    box: tuple[Metres, Metres] | None = None
    cylinder: Metres | None = None
    at: Point = (0.0, 0.0)
    z: Span
    colour: HexColour | None = None
    surface: Surface = "plain"

    @model_validator(mode="after")
    def _check(self) -> PartEntry:
        if (self.box is None) == (self.cylinder is None):
            raise ValueError("a part is either `box: [size x, size y]` or `cylinder: radius`")
        if self.z[0] < 0.0:
            raise ValueError("a part cannot reach below the floor")
        return self


class PlaceEntry(PoseEntry):
    """A place to sit or lie on a model, in its frame; :class:`RestingPlace` says what of a person."""

    posture: Literal["seated", "lying"]
    height: Metres


class FurnitureEntry(Entry):
    """One piece of furniture: a model, placed and coloured; moved, or not there when the map was made."""

    name: Name
    model: Name
    x: Finite
    y: Finite
    turn_deg: Finite = 0.0
    colour: HexColour
    on_map: bool = True
    moved_from: PoseEntry | None = None


Models = dict[Name, Annotated[tuple[PartEntry, ...], Field(min_length=1)]]
Places = dict[Name, tuple[PlaceEntry, ...]]


class FlatFile(Entry):
    """The whole source file."""

    name: Name
    start: PoseEntry
    floor: HexColour
    walls: WallsEntry
    rooms: Annotated[dict[Name, RoomEntry], Field(min_length=1)]
    hotspots: dict[Name, PoseEntry] = {}
    seats: tuple[SeatEntry, ...] = ()
    models: Models = {}
    places: Places = {}
    furniture: tuple[FurnitureEntry, ...] = ()
