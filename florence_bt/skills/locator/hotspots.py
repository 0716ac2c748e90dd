"""Hotspots: labelled poses of rooms and objects, zones, and the YAML file that keeps them.

Free of numpy and ROS: ``florence check`` reads hotspot files too. :mod:`hotspot_file` changes them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first, raise_all, spelling
from florence_bt.core.geometry import MAX_DISTANCE_M, Pose2
from florence_bt.core.plain_yaml import (
    EmptyFile,
    Position,
    YamlMapping,
    YamlNode,
    YamlScalar,
    YamlSequence,
    parse_yaml,
)
from florence_bt.core.polygons import Point, Polygon, contains
from florence_bt.core.text_files import read_bytes
from florence_bt.core.units import QUANTITY, UNITS
from florence_bt.core.yaml_reader import YamlReader, missing_key
from florence_bt.core.zones import KINDS as ZONE_KINDS
from florence_bt.core.zones import MAX_CORNERS, MAX_ZONES, SLOW, Zone

ROOM, OBJECT = "room", "object"
KINDS = (ROOM, OBJECT)
FIELDS = ("label", "x", "y", "phi", "yaw", "kind", "polygon")
ZONE_FIELDS = ("label", "kind", "polygon", "speed_limit")
SECTIONS = ("hotspots", "zones")

ROOM_NAMES = (
    *("kitchen", "living room", "bedroom", "bathroom", "toilet", "hall", "corridor", "study", "dining room"),
    *("office", "nursery", "guest room", "utility room", "laundry", "pantry", "attic", "cellar", "basement"),
    *("garage", "balcony", "terrace", "conservatory", "lobby", "lounge", "room"),
)
"""A taught hotspot with one of these names, whatever stands between its words, perhaps with a number behind
it, is a room; one with another name is an object. Chosen: the rooms of homes and of care homes."""

_ANGLES = UNITS[Kind.ANGLE]
_LENGTHS = {"": 1.0} | UNITS[Kind.LENGTH]
_LIMITS = {"%": 0.01} | UNITS[Kind.SPEED]


@dataclass(frozen=True, slots=True)
class Hotspot:
    """A labelled pose in the map frame.

    Attributes:
        label: The name people use, e.g. ``kitchen``.
        pose: Where the robot is to stand; metres and radians.
        kind: ``room`` or ``object``; only rooms answer the question where somebody is.
        polygon: The corners of the room in order, or empty when they are not known.
    """

    label: str
    pose: Pose2
    kind: str = ROOM
    polygon: Polygon = ()

    def contains(self, x: float, y: float) -> bool:
        """Tell whether the polygon contains a point (even-odd rule); False without a polygon."""
        return contains(self.polygon, x, y)


class Hotspots:
    """A list of hotspots, each label once, in the order of the file, and the zones of the same file.

    Args:
        hotspots: The hotspots.
        positions: Label -> where it stands in the file that was read.
        zones: The zones.
    """

    def __init__(
        self,
        hotspots: Iterable[Hotspot] = (),
        positions: Mapping[str, Position] | None = None,
        zones: Iterable[Zone] = (),
    ) -> None:
        self._by_label = {hotspot.label: hotspot for hotspot in hotspots}
        self._positions = dict(positions or {})
        self.zones = tuple(zones)

    def __iter__(self) -> Iterator[Hotspot]:
        """Iterate over the hotspots in order."""
        return iter(self._by_label.values())

    def __len__(self) -> int:
        """Count the hotspots."""
        return len(self._by_label)

    def copy(self) -> Hotspots:
        """Copy the hotspots, to go back to them."""
        return Hotspots(self, self._positions, self.zones)

    def labels(self) -> tuple[str, ...]:
        """Return every label in order."""
        return tuple(self._by_label)

    def rooms(self) -> tuple[Hotspot, ...]:
        """Return the hotspots that are rooms."""
        return tuple(hotspot for hotspot in self if hotspot.kind == ROOM)

    def by_name(self) -> dict[str, list[str]]:
        """Map what a text of a mission may name (``names`` of a port) to the labels that there are."""
        return {"hotspot": list(self.labels()), "room": [room.label for room in self.rooms()]}

    def room_of(self, x: float, y: float) -> str:
        """Return a point's room: the polygon that contains it, else the nearest room hotspot, else empty."""
        rooms = self.rooms()
        for room in rooms:
            if room.contains(x, y):
                return room.label
        here = Pose2(x, y)
        return min(rooms, key=lambda room: here.distance_to(room.pose)).label if rooms else ""

    def get(self, label: str) -> Hotspot | None:
        """Return the hotspot with this label, or None."""
        return self._by_label.get(label)

    def position_of(self, label: str) -> Position:
        """Return where a hotspot stands in its file; the file's beginning if it is from elsewhere."""
        return self._positions.get(label, Position())

    def put(self, hotspot: Hotspot) -> None:
        """Add a hotspot, in place of the one with its label."""
        self._by_label[hotspot.label] = hotspot

    def unknown(self, label: str) -> str:
        """Say that a label does not exist, and which ones do."""
        if not self._by_label:
            return f"there is no hotspot {label!r}: the list of hotspots is empty"
        close = ", ".join(closest_first(label, self.labels()))
        return f"there is no hotspot {label!r} (would have worked: {close})"


def kind_of_new(label: str, room_names: Iterable[str] = ROOM_NAMES) -> str:
    """Return the kind of a hotspot that is taught without one: a room if it is called so, else an object."""
    return ROOM if spelling(label).rstrip("0123456789") in map(spelling, room_names) else OBJECT


def load_hotspots(path: str | Path) -> Hotspots:
    """Read a hotspot file.

    Raises:
        ConfigError: The file cannot be read or is wrong; with file, line and column.
    """
    return read_places(path).sound()


def parse_hotspots(text: str, file: str | Path = "hotspots.yaml") -> Hotspots:
    """Read the text of a hotspot file: the lists ``hotspots`` and ``zones`` (docs/manual/places.md).

    Args:
        text: YAML.
        file: The name for error messages.

    Raises:
        ConfigError: Something is wrong; with file, line and column.
    """
    return parse_places(text.encode(), Path(file)).sound()


@dataclass(frozen=True, slots=True)
class Places:
    """A hotspot file as it was read.

    Attributes:
        file: The file.
        hotspots: What could be read; what is wrong has a default in its place.
        problems: What is wrong, in the order of the file.
        entries: Section -> label -> where it stands in the file.
        root: The whole file; None when it is empty.
    """

    file: Path
    hotspots: Hotspots
    problems: tuple[ConfigError, ...] = ()
    entries: Mapping[str, Mapping[str, YamlMapping]] = field(default_factory=dict)
    root: YamlNode | None = None

    def sound(self) -> Hotspots:
        """Return the hotspots.

        Raises:
            ConfigError: Something is wrong with the file; the first of its problems.
        """
        if not self.problems:
            return self.hotspots
        first, more = self.problems[0], len(self.problems) - 1
        hint = f"; florence hotspot check tells {more} more" if more else ""
        raise ConfigError(
            f"{first.problem}{hint}", file=first.file, line=first.line, column=first.column, valid=first.valid
        )

    def entry(self, section: str, label: str) -> YamlMapping:
        """Return where a hotspot or zone stands in the file.

        Raises:
            ConfigError: There is no such label.
        """
        found = self.entries.get(section, {}).get(label)
        if found is None:
            what = "hotspot" if section == "hotspots" else "zone"
            known = closest_first(label, self.entries.get(section, {}))
            raise ConfigError(f"there is no {what} {label!r}", file=self.file, valid=known)
        return found


def read_places(path: str | Path) -> Places:
    """Read a hotspot file with everything that is wrong with it.

    Raises:
        ConfigError: The file cannot be read, or is not YAML.
    """
    try:
        data = read_bytes(Path(path))
    except ConfigError as error:
        raise ConfigError(f"the hotspots: {error.problem}", file=path, valid=error.valid) from error
    return parse_places(data, Path(path))


def parse_places(data: bytes, file: Path) -> Places:
    """Read the bytes of a hotspot file with everything that is wrong with them.

    Raises:
        ConfigError: They are not YAML.
    """
    problems: list[ConfigError] = []
    try:
        source = parse_yaml(data, file, problems)
    except EmptyFile:
        return Places(file, Hotspots())
    return _PlacesReader(file, problems).read(source, problems)


def read_item(section: str, label: str, values: Mapping[str, str]) -> Places:
    """Read one hotspot or zone whose values were typed one by one.

    Args:
        section: ``hotspots`` or ``zones``.
        label: Its label.
        values: Key -> value, as in the file.

    Returns:
        Places with nothing else.

    Raises:
        ConfigError: What is wrong, all of it; without a place in a file.
    """
    start = Position()
    unreadable: dict[str, ConfigError] = {}
    if not label.strip():
        unreadable["label"] = ConfigError("the label is empty", valid=["sofa", "living room"])
    entries: list[tuple[YamlScalar, YamlNode]] = [
        (YamlScalar("label", False, start), YamlScalar(label if label.strip() else "?", True, start))
    ]
    for name, text in values.items():
        try:
            entries.append((YamlScalar(name, False, start), parse_yaml(text.encode(), Path(name))))
        except ConfigError as error:
            unreadable[name] = ConfigError(f"{name}: {error.problem}", valid=error.valid)
    items = YamlSequence((YamlMapping(tuple(entries), start),), start)
    sections = {"hotspots": YamlSequence((), start), section: items}
    root = YamlMapping(
        tuple((YamlScalar(name, False, start), part) for name, part in sections.items()), start
    )
    problems: list[ConfigError] = []
    places = _PlacesReader(Path(label), problems).read(root, problems)
    missing = {missing_key(name) for name in unreadable}
    wrong = [each for each in problems if each.problem not in missing]
    raise_all([*unreadable.values(), *(ConfigError(each.problem, valid=each.valid) for each in wrong)])
    return places


class _PlacesReader(YamlReader):
    """Reads one hotspot file to its end, whatever is wrong with it."""

    def read(self, root: YamlNode, problems: list[ConfigError]) -> Places:
        hotspots: list[Hotspot] = []
        zones: list[Zone] = []
        entries: dict[str, dict[str, YamlMapping]] = {section: {} for section in SECTIONS}
        try:
            top = self.mapping(root, SECTIONS, needed=("hotspots",))
        except ConfigError as error:
            self.note(error)
            top = {}
        for item in self._items(top, "hotspots", entries):
            hotspots.append(self._hotspot(item))
        for item in self._items(top, "zones", entries):
            zones.append(self._zone(item))
        if len(zones) > MAX_ZONES:
            self.note(self.error(f"{len(zones)} zones; at most {MAX_ZONES} are read", top["zones"]))
        positions = {label: item.position for label, item in entries["hotspots"].items()}
        ordered = sorted(problems, key=lambda error: (error.line or 0, error.column or 0))
        return Places(
            self.file, Hotspots(hotspots, positions, zones[:MAX_ZONES]), tuple(ordered), entries, root
        )

    def _items(
        self, top: Mapping[str, YamlNode], section: str, entries: dict[str, dict[str, YamlMapping]]
    ) -> Iterator[YamlMapping]:
        """Yield the items of a section that have a label of their own."""
        items: tuple[YamlNode, ...] = self.value(top, section, self._list, ())
        for item in items:
            try:
                label = self._label(item)
            except ConfigError as error:
                self.note(error)
                continue
            assert isinstance(item, YamlMapping)
            if label in entries[section]:
                first = entries[section][label].position.line
                self.note(self.error(f"the label {label!r} is there twice (first in line {first})", item))
                continue
            entries[section][label] = item
            yield item

    def _list(self, source: YamlNode, name: str) -> tuple[YamlNode, ...]:
        return () if isinstance(source, YamlScalar) and source.empty else self.sequence(source, name)

    def _label(self, item: YamlNode) -> str:
        if not isinstance(item, YamlMapping):
            raise self.error("a mapping is needed here", item, valid=FIELDS)
        label = item.get("label")
        if label is None:
            for key, _ in item.entries:
                if key.text not in FIELDS and closest_first(key.text, FIELDS)[0] == "label":
                    raise self.error(f"{key.text!r} is not known here", key, valid=["label"])
            raise self.error("'label' is missing", item, valid=["label: ..."])
        return self.text(label, "label")

    def _hotspot(self, item: YamlMapping) -> Hotspot:
        fields = self.mapping(item, FIELDS, needed=("x", "y"))
        if "phi" in fields and "yaw" in fields:
            self.note(self.error("'phi' and 'yaw' are the same", fields["yaw"], valid=("one of the two",)))
        angle = "yaw" if "yaw" in fields else "phi"
        pose = Pose2(
            self.value(fields, "x", self._length, 0.0),
            self.value(fields, "y", self._length, 0.0),
            self.value(fields, angle, self._angle, 0.0),
        )
        kind = self.value(fields, "kind", lambda source, name: self.choice(source, name, KINDS), ROOM)
        polygon: Polygon = self.value(fields, "polygon", self._polygon, ())
        return Hotspot(self._label(item), pose, kind, polygon)

    def _zone(self, item: YamlMapping) -> Zone:
        fields = self.mapping(item, ZONE_FIELDS, needed=("kind", "polygon"))
        kind = self.value(fields, "kind", lambda source, name: self.choice(source, name, ZONE_KINDS), "")
        polygon: Polygon = self.value(fields, "polygon", self._polygon, ())
        limit, is_share = self.value(fields, "speed_limit", self._limit, (0.0, False))
        if kind == SLOW and "speed_limit" not in fields:
            valid = ("speed_limit: 0.2 m/s", "speed_limit: 50 %")
            self.note(self.error("a slow zone needs a 'speed_limit'", item, valid))
        elif kind not in (SLOW, "") and "speed_limit" in fields:
            problem = f"a {kind} zone has no speed_limit"
            self.note(self.error(problem, fields["speed_limit"], valid=("kind: slow",)))
        return Zone(self._label(item), kind, polygon, limit, is_share)

    def _limit(self, source: YamlNode, name: str) -> tuple[float, bool]:
        valid = ("0.2 m/s", "50 %")
        limit = self.quantity(source, name, _LIMITS, valid)
        is_share = isinstance(source, YamlScalar) and source.text.rstrip().endswith("%")
        if not 0.0 < limit <= (1.0 if is_share else 100.0):
            raise self.error(f"{name} must be more than nothing, and at most 100 %", source, valid)
        return limit, is_share

    def _polygon(self, source: YamlNode, name: str) -> Polygon:
        points = [self._corner(item) for item in self.sequence(source, name)]
        if not 3 <= len(points) <= MAX_CORNERS:
            problem = f"a {name} has at least 3 corners, and at most {MAX_CORNERS}, not {len(points)}"
            raise self.error(problem, source)
        return tuple(points)

    def _corner(self, item: YamlNode) -> Point:
        numbers = [self._length(number, "a corner") for number in self.sequence(item, "a corner")]
        if len(numbers) != 2:
            raise self.error("a corner has two numbers", item, valid=("[1.0, 2.0]",))
        return numbers[0], numbers[1]

    def _length(self, source: YamlNode, name: str) -> float:
        text = source.text.strip() if isinstance(source, YamlScalar) else ""
        with_unit = QUANTITY.fullmatch(text)
        if with_unit is not None and with_unit[2] in _LENGTHS:
            length = self.quantity(source, name, _LENGTHS, ("1.5", "1.5 m"))
        else:
            length = self.number(source, name, ("1.5", "1.5 m"))
        if abs(length) > MAX_DISTANCE_M:
            raise self.error(f"{name} is {length:g} m", source, (f"at most {MAX_DISTANCE_M:g} m",))
        return length

    def _angle(self, source: YamlNode, name: str) -> float:
        try:
            bare = self.number(source, name)
        except ConfigError:
            angle = self.quantity(source, name, _ANGLES, ("90 deg", "1.57 rad"))
            if abs(angle) > math.tau:
                raise self.error(
                    f"{name} is more than a whole turn", source, ("-180 deg to 180 deg",)
                ) from None
            return angle
        as_radians, as_degrees = f"{bare:g} rad", f"{bare:g} deg"
        if name == "yaw":
            problem = f"yaw: {bare:g} has no unit; a bare number is read as radians in 'phi' alone"
            raise self.error(problem, source, (as_degrees, as_radians))
        if abs(bare) > math.tau:
            problem = f"phi is in radians, and {bare:g} is more than a whole turn"
            meant = (f"{as_degrees}, if degrees are meant",) if abs(bare) <= 360 else ("-180 deg to 180 deg",)
            raise self.error(problem, source, valid=meant)
        return bare
