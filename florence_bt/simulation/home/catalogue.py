"""Furniture of generated homes: ``maps/furniture.yaml``, checked."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from florence_bt.core.paths import find_data
from florence_bt.simulation.home.flat import Entry, Finite, HexColour, Models, Name, Places
from florence_bt.simulation.home.model_reader import Location, ModelReader


class PieceKind(Entry):
    """A kind of piece, of which one of several models may stand there; the file says what each key means."""

    models: Annotated[tuple[Name, ...], Field(min_length=1)]
    colours: Name | tuple[HexColour, ...]
    moves: Annotated[float, Field(ge=0.0, le=2.0)] = 0.0


class Companion(PieceKind):
    """A piece that stands beside the main one, in whose frame it is placed."""

    x: Finite
    y: Finite
    turn_deg: Finite = 0.0
    chance: Annotated[float, Field(ge=0.0, le=1.0)]


class Group(PieceKind):
    """A main piece and what belongs to it."""

    stands: Literal["wall", "free", "any"]
    front: Annotated[float, Field(ge=0.0, le=3.0)] = 0.0
    on_map: bool = True
    hotspot: Name | None = None
    companions: tuple[Companion, ...] = Field(default=(), alias="with")


class Furnishing(Entry):
    """A group of furniture for a room, and how many of it the room gets."""

    group: Name
    count: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0, le=20)]]


class Catalogue(Entry):
    """The whole file."""

    palettes: dict[Name, Annotated[tuple[HexColour, ...], Field(min_length=1)]]
    models: Models
    places: Places
    groups: dict[Name, Group]
    rooms: dict[Name, tuple[Furnishing, ...]]

    def colours_of(self, kind: PieceKind) -> tuple[HexColour, ...]:
        """Return the colours that a piece may have."""
        return self.palettes[kind.colours] if isinstance(kind.colours, str) else kind.colours


@functools.cache
def load_catalogue() -> Catalogue:
    """Read the catalogue that comes with Florence.

    Raises:
        ConfigError: The file is missing or wrong, with file:line:column.
    """
    source = ModelReader(find_data("maps", "furniture.yaml"))
    catalogue = source.parse(Catalogue)

    def check(location: Location, what: str, names: Iterable[str], known: Iterable[str]) -> None:
        for name in names:
            if name not in known:
                raise source.unknown_at(location, what, name, list(known))

    check(("places",), "model", catalogue.places, catalogue.models)
    for label, group in catalogue.groups.items():
        for kind in (group, *group.companions):
            check(("groups", label), "model", kind.models, catalogue.models)
            if isinstance(kind.colours, str):
                check(("groups", label), "palette", [kind.colours], catalogue.palettes)
    for room, furnishings in catalogue.rooms.items():
        for index, furnishing in enumerate(furnishings):
            check(("rooms", room, index), "group", [furnishing.group], catalogue.groups)
    return catalogue
