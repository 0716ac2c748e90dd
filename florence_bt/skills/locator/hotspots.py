"""Hotspots: labelled poses of rooms and objects, and the YAML file that keeps them.

Free of numpy and ROS: ``florence check`` reads hotspot files too.
"""

from __future__ import annotations

import itertools
import math
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.odd_characters import needs_quotes
from florence_bt.core.plain_yaml import EmptyFile, Position, YamlNode, parse_yaml
from florence_bt.core.settings_file import SettingsReader
from florence_bt.core.text_files import read_bytes, replace_text

KINDS = ("room", "object")
FIELDS = ("label", "x", "y", "phi", "kind", "polygon")

Point = tuple[float, float]


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
    kind: str = "room"
    polygon: tuple[Point, ...] = ()

    def contains(self, x: float, y: float) -> bool:
        """Tell whether the polygon contains a point (even-odd rule); False without a polygon."""
        inside = False
        for (ax, ay), (bx, by) in zip(self.polygon, self.polygon[1:] + self.polygon[:1], strict=True):
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
        return inside


class Hotspots:
    """A list of hotspots, each label once, in the order of the file.

    Args:
        hotspots: The hotspots.
        positions: Label -> where it stands in the file that was read.
    """

    def __init__(
        self, hotspots: Iterable[Hotspot] = (), positions: Mapping[str, Position] | None = None
    ) -> None:
        self._by_label = {hotspot.label: hotspot for hotspot in hotspots}
        self._positions = dict(positions or {})

    def __iter__(self) -> Iterator[Hotspot]:
        """Iterate over the hotspots in order."""
        return iter(self._by_label.values())

    def __len__(self) -> int:
        """Count the hotspots."""
        return len(self._by_label)

    def copy(self) -> Hotspots:
        """Copy the hotspots, to go back to them."""
        return Hotspots(self, self._positions)

    def labels(self) -> tuple[str, ...]:
        """Return every label in order."""
        return tuple(self._by_label)

    def rooms(self) -> tuple[Hotspot, ...]:
        """Return the hotspots that are rooms."""
        return tuple(hotspot for hotspot in self if hotspot.kind == "room")

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

    def put(self, label: str, pose: Pose2) -> Hotspot:
        """Move a hotspot, or add a room when the label is new; kind and polygon of a known one stay."""
        old = self._by_label.get(label)
        new = Hotspot(label, pose, old.kind, old.polygon) if old else Hotspot(label, pose)
        self._by_label[label] = new
        return new

    def unknown(self, label: str) -> str:
        """Say that a label does not exist, and which ones do."""
        if not self._by_label:
            return f"there is no hotspot {label!r}: the list of hotspots is empty"
        close = ", ".join(closest_first(label, self.labels()))
        return f"there is no hotspot {label!r} (would have worked: {close})"


def load_hotspots(path: str | Path) -> Hotspots:
    """Read a hotspot file.

    Raises:
        ConfigError: The file cannot be read or is wrong; with file, line and column.
    """
    try:
        data = read_bytes(Path(path))
    except ConfigError as error:
        raise ConfigError(f"the hotspots: {error.problem}", file=path, valid=error.valid) from error
    return _parse(data, Path(path))


def parse_hotspots(text: str, file: str | Path = "hotspots.yaml") -> Hotspots:
    """Read the text of a hotspot file: a list ``hotspots`` of {label, x, y, phi, kind, polygon}.

    Args:
        text: YAML; x, y in metres, phi in radians, map frame.
        file: The name for error messages.

    Raises:
        ConfigError: Something is wrong; with file, line and column.
    """
    return _parse(text.encode(), Path(file))


def _parse(data: bytes, file: Path) -> Hotspots:
    try:
        source = parse_yaml(data, file)
    except EmptyFile:
        return Hotspots()
    return _HotspotsReader(file).read(source)


class _Dumper(yaml.SafeDumper):
    """Puts quotes round texts that :func:`parse_yaml` would not take without them."""

    def represent_str(self, data: str) -> yaml.ScalarNode:
        node = super().represent_str(data)
        if node.style is None and needs_quotes(data):
            node.style = '"'
        return node


_Dumper.add_representer(str, _Dumper.represent_str)


def dump_hotspots(hotspots: Hotspots) -> str:
    """Write the text of a hotspot file; :func:`parse_hotspots` reads the same hotspots back."""
    entries = []
    for hotspot in hotspots:
        entry: dict[str, object] = {
            "label": hotspot.label,
            "x": hotspot.pose.x,
            "y": hotspot.pose.y,
            "phi": yaw if abs(yaw := hotspot.pose.yaw) <= math.tau else math.remainder(yaw, math.tau),
            "kind": hotspot.kind,
        }
        if hotspot.polygon:
            entry["polygon"] = [list(point) for point in hotspot.polygon]
        entries.append(entry)
    text = yaml.dump(
        {"hotspots": entries}, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None
    )
    return f"# Rooms and objects: x, y in metres, phi in radians, map frame.\n{text}"


def save_hotspots(hotspots: Hotspots, path: str | Path) -> None:
    """Write a hotspot file in one step; the old one is kept beside it with the ending ``.bak``.

    The text is read back, with the reader of the next start, before it takes the old file's place.

    Raises:
        ConfigError: The file cannot be written, or not be read back; the old one is untouched.
    """
    target, text = Path(path), dump_hotspots(hotspots)
    _read_back(hotspots, text)
    try:
        if target.exists():
            shutil.copy2(target, target.with_name(target.name + ".bak"))
        replace_text(target, text)
    except OSError as error:
        raise ConfigError(f"cannot write the hotspots: {error}", file=path) from error


def _read_back(hotspots: Hotspots, text: str) -> None:
    """Raise a ConfigError when a text would not give these hotspots at the next start."""
    try:
        read = tuple(parse_hotspots(text))
    except ConfigError as error:
        raise ConfigError(f"it could not be read back: {error.problem}", valid=error.valid) from error
    for wanted, found in itertools.zip_longest(hotspots, read):
        if wanted != found:
            raise ConfigError(f"{wanted} would be read back as {found}", valid=["plain text as the label"])


class _HotspotsReader(SettingsReader):
    """Reads the hotspots of one file."""

    def read(self, root: YamlNode) -> Hotspots:
        top = self.mapping(root, ("hotspots",), needed=("hotspots",))
        hotspots: dict[str, Hotspot] = {}
        positions: dict[str, Position] = {}
        for item in self.sequence(top["hotspots"], "hotspots"):
            hotspot = self._hotspot(item)
            if hotspot.label in hotspots:
                raise self.error(f"the label {hotspot.label!r} is there twice", item)
            hotspots[hotspot.label] = hotspot
            positions[hotspot.label] = item.position
        return Hotspots(hotspots.values(), positions)

    def _hotspot(self, source: YamlNode) -> Hotspot:
        fields = self.mapping(source, FIELDS, needed=("label", "x", "y"))
        label = self.text(fields["label"], "label")
        kind = self.choice(fields["kind"], "kind", KINDS) if "kind" in fields else "room"
        phi = self._angle(fields["phi"]) if "phi" in fields else 0.0
        pose = Pose2(self.number(fields["x"], "x"), self.number(fields["y"], "y"), phi)
        polygon = self._polygon(fields["polygon"]) if "polygon" in fields else ()
        return Hotspot(label, pose, kind, polygon)

    def _polygon(self, source: YamlNode) -> tuple[Point, ...]:
        points = []
        for item in self.sequence(source, "polygon"):
            numbers = [self.number(number, "a corner") for number in self.sequence(item, "a corner")]
            if len(numbers) != 2:
                raise self.error("a corner has two numbers", item, valid=("[1.0, 2.0]",))
            points.append((numbers[0], numbers[1]))
        if len(points) < 3:
            raise self.error(f"a polygon has at least 3 corners, not {len(points)}", source)
        return tuple(points)

    def _angle(self, source: YamlNode) -> float:
        angle = self.number(source, "phi")
        if abs(angle) > math.tau:
            problem = f"phi is in radians, and {angle:g} is more than a whole turn"
            in_degrees = (
                (f"{math.radians(angle):.4f}, if {angle:g} degrees are meant",) if abs(angle) <= 360 else ()
            )
            raise self.error(problem, source, valid=in_degrees or ("-3.14 to 3.14",))
        return angle
