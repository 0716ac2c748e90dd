"""What may stand in a flat's source file (pydantic models); :mod:`flat` turns it into a Flat."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, AllowInfNan, BaseModel, ConfigDict, Field, model_validator


def _check_colour(text: str) -> str:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise ValueError(f"{text!r} is no colour; write it as '#rrggbb'")
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
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PoseEntry(_Entry):
    """A place and a direction."""

    x: Finite
    y: Finite
    phi_deg: Finite = 0.0


class DoorEntry(_Entry):
    """A gap in a wall."""

    name: Name
    centre: Metres
    width: Metres


class WallEntry(_Entry):
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
            raise ValueError(f"the wall {self.name!r} must run towards growing coordinates")
        end = 0.0
        for door in sorted(self.doors, key=lambda each: each.centre):
            if door.centre - door.width / 2 < end:
                raise ValueError(f"the door {door.name!r} overlaps another one or the wall's end")
            end = door.centre + door.width / 2
        if end > self.to[axis] - self.from_[axis]:
            raise ValueError(f"a door of the wall {self.name!r} reaches beyond the wall's end")
        return self


class WallsEntry(_Entry):
    """All walls and what they have in common."""

    height: Metres
    thickness: Metres
    colour: HexColour
    door_height: Metres
    lines: Annotated[tuple[WallEntry, ...], Field(min_length=1)]


class RoomEntry(_Entry):
    """A rectangle of the floor and the place in it where the robot looks around."""

    x: Span
    y: Span
    hotspot: PoseEntry


class SeatEntry(PoseEntry):
    """A place where a person may sit."""

    room: Name


class PartEntry(_Entry):
    """A box or an upright cylinder of a model."""

    box: tuple[Metres, Metres] | None = None
    cylinder: Metres | None = None
    at: Point = (0.0, 0.0)
    z: Span
    colour: HexColour | None = None

    @model_validator(mode="after")
    def _check(self) -> PartEntry:
        if (self.box is None) == (self.cylinder is None):
            raise ValueError("a part is either `box: [size x, size y]` or `cylinder: radius`")
        if self.z[0] < 0.0:
            raise ValueError("a part cannot reach below the floor")
        return self


class FurnitureEntry(_Entry):
    """One piece of furniture: a model, placed and coloured."""

    name: Name
    model: Name
    x: Finite
    y: Finite
    turn_deg: Finite = 0.0
    colour: HexColour


class FlatFile(_Entry):
    """The whole source file."""

    name: Name
    start: PoseEntry
    floor: HexColour
    walls: WallsEntry
    rooms: Annotated[dict[Name, RoomEntry], Field(min_length=1)]
    hotspots: dict[Name, PoseEntry] = {}
    seats: tuple[SeatEntry, ...] = ()
    models: dict[Name, Annotated[tuple[PartEntry, ...], Field(min_length=1)]] = {}
    furniture: tuple[FurnitureEntry, ...] = ()
