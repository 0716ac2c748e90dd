"""Changes a hotspot file in place: its comments, its order and what is not meant stay as they are.

Each change is a small edit of the text, which is read again before it takes the old file's place: what would
not say exactly what was meant is refused.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import yaml

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.core.odd_characters import needs_quotes
from florence_bt.core.plain_yaml import (
    Position,
    YamlMapping,
    YamlNode,
    YamlScalar,
    YamlSequence,
)
from florence_bt.core.polygons import Polygon
from florence_bt.core.text_files import LINE_BREAK, decode, read_bytes
from florence_bt.core.zones import Zone
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots, Places, parse_places, read_item

Edit = tuple[int, int, str]
"""Beginning and end of a text, and the text that comes in its place."""

_BY_HAND = "an edit by hand"
_NEW_FILE = "# Rooms, objects and zones: docs/manual/places.md.\nhotspots:\n"


class HotspotFile:
    """A hotspot file that is being changed.

    Args:
        path: The file, which must be sound.
        create: Whether to begin a new one where there is none; it is there once it is saved.

    Raises:
        ConfigError: It cannot be read, or is wrong.
    """

    def __init__(self, path: str | Path, *, create: bool = False) -> None:
        self.path = Path(path)
        is_new = create and not self.path.exists()
        self._text = _NEW_FILE if is_new else decode(read_bytes(self.path), self.path)
        self._places: Places = parse_places(self._text.encode(), self.path)
        self._wanted = self._places.sound().copy()

    @property
    def hotspots(self) -> Hotspots:
        """Read the file as it is now."""
        return self._wanted

    # Changes.

    def put(self, hotspot: Hotspot, written: Mapping[str, str] | None = None) -> None:
        """Add a hotspot, or change the one with its label.

        Args:
            hotspot: The hotspot.
            written: How to write ``x``, ``y`` or ``yaw``, such as ``90 deg``.
        """
        entry, typed = _hotspot_entry(hotspot), dict(written or {})
        known = self._wanted.get(hotspot.label)
        self._wanted.put(hotspot)
        if known is None:
            if "yaw" in typed:
                entry = {"yaw" if name == "phi" else name: text for name, text in entry.items()}
            self._append("hotspots", entry | typed)
            return
        old, item = _hotspot_entry(known), self._places.entry("hotspots", hotspot.label)
        angle = "phi" if item.get("yaw") is None else "yaw"
        edits = []
        for name, text in entry.items():
            if text != old.get(name):
                key, typed_key = (angle, "yaw") if name == "phi" else (name, name)
                edits.append(self._edit(item, key, typed.get(typed_key, text)))
        self._apply(*edits)

    def rename(self, old: str, new: str) -> None:
        """Give a hotspot another label.

        Raises:
            ConfigError: There is no such hotspot, or one of the new name.
        """
        item = self._places.entry("hotspots", old)
        if self._wanted.get(new) is not None:
            raise ConfigError(f"there is a hotspot {new!r} already", file=self.path, valid=["another label"])
        spots = [replace(spot, label=new) if spot.label == old else spot for spot in self._wanted]
        self._wanted = Hotspots(spots, zones=self._wanted.zones)
        self._apply(self._edit(item, "label", _text(new)))

    def remove(self, label: str) -> None:
        """Remove a hotspot.

        Raises:
            ConfigError: There is none.
        """
        item = self._places.entry("hotspots", label)
        spots = [spot for spot in self._wanted if spot.label != label]
        self._wanted = Hotspots(spots, zones=self._wanted.zones)
        self._remove("hotspots", item)

    def put_zone(self, zone: Zone) -> None:
        """Add a zone, or change the one with its label."""
        if any(known.label == zone.label for known in self._wanted.zones):
            self.remove_zone(zone.label)
        self._wanted.zones += (zone,)
        self._append("zones", _zone_entry(zone))

    def remove_zone(self, label: str) -> None:
        """Remove a zone.

        Raises:
            ConfigError: There is none.
        """
        item = self._places.entry("zones", label)
        self._wanted.zones = tuple(zone for zone in self._wanted.zones if zone.label != label)
        self._remove("zones", item)

    def turn(self, move: Pose2) -> None:
        """Move everything into another frame, to a millimetre and a hundredth of a degree.

        Args:
            move: Pose of the frame of now in the new one.
        """
        for spot in tuple(self._wanted):
            pose = move @ spot.pose
            values = {"x": _metres(pose.x), "y": _metres(pose.y), "yaw": f"{math.degrees(pose.yaw):.5g} deg"}
            if spot.polygon:
                values["polygon"] = _moved_corners(spot.polygon, move)
            self.put(read_hotspot(spot.label, values, spot), values)
        for zone in self._wanted.zones:
            values = _zone_entry(zone) | {"polygon": _moved_corners(zone.polygon, move)}
            values.pop("label")
            new = read_zone(zone.label, values)
            self._wanted.zones = tuple(new if each is zone else each for each in self._wanted.zones)
            item = self._places.entry("zones", zone.label)
            self._apply(self._edit(item, "polygon", values["polygon"]))

    def text(self) -> str:
        """Return the text of the changed file.

        Raises:
            ConfigError: It would not be read back.
        """
        read = self._places.sound()
        if tuple(read) != tuple(self._wanted) or read.zones != self._wanted.zones:
            raise ConfigError(
                "the file is written in a way that cannot be changed here", file=self.path, valid=[_BY_HAND]
            )
        return self._text

    def save(self) -> None:
        """Write the file in one step; the old one is kept beside it with the ending ``.bak``.

        Raises:
            ConfigError: The file cannot be written, or would not be read back; the old one is untouched.
        """
        text = self.text()
        try:
            contents = {Path(os.path.realpath(self.path)): text.encode()}
            if self.path.exists():
                backup = self.path.with_name(self.path.name + ".bak")
                contents = {backup: read_bytes(self.path), **contents}
            replace_files(contents)
        except OSError as error:
            raise ConfigError(f"cannot write the hotspots: {error}", file=self.path) from error

    # Edits of the text.

    def _use(self, text: str) -> None:
        self._text = text
        self._places = parse_places(text.encode(), self.path)

    def _offset(self, position: Position) -> int:
        return self._line_begin(position.line) + position.column - 1

    def _span(self, scalar: YamlScalar) -> tuple[int, int]:
        if scalar.first_column is None:
            raise ConfigError(
                f"{scalar.text!r} is written in a way that cannot be changed here",
                file=self.path,
                line=scalar.position.line,
                column=scalar.position.column,
                valid=[_BY_HAND],
            )
        begin = self._offset(scalar.position)
        return begin, begin + len(scalar.text) + 2 * scalar.quoted

    def _apply(self, *edits: Edit) -> None:
        """Put texts in the place of others, the last one first, so that the places of the rest stay right."""
        text = self._text
        for begin, end, new in sorted(edits, key=lambda edit: -edit[0]):
            text = text[:begin] + new + text[end:]
        self._use(text)

    def _edit(self, item: YamlMapping, name: str, text: str) -> Edit:
        """Return what writes a value of an item: in place of its old one, or behind that of ``y``."""
        value = item.get(name)
        if isinstance(value, YamlSequence) and not self._in_brackets(value):
            key = item.key(name)
            assert key is not None, "it has a value"
            return self._offset(key.position) + len(name) + 1, self._end_of(value), f" {text}"
        if value is not None:
            return self._offset(value.position), self._end_of(value), text
        after = item.get("y")
        assert isinstance(after, YamlScalar), "the file is sound"
        if self._in_braces(item):
            _, end = self._span(after)
            return end, end, f", {name}: {text}"
        line_end = self._line_end(after.position.line)
        return line_end, line_end, f"\n{' ' * (item.position.column - 1)}{name}: {text}"

    def _append(self, section: str, entry: Mapping[str, str]) -> None:
        """Write an entry behind the last one of a section."""
        text = "{" + ", ".join(f"{name}: {value}" for name, value in entry.items()) + "}"
        items = self._section(section)
        if items is None:
            ended = self._text if not self._text or self._text.endswith("\n") else self._text + "\n"
            self._use(f"{ended}{section}:\n  - {text}\n")
        elif not isinstance(items, YamlSequence) or not items.items:  # nothing, or empty brackets
            if isinstance(items, YamlSequence):
                begin = self._offset(items.position)
                self._apply((begin, self._end_of(items), ""))
            end = self._line_end(self._key(section).position.line)
            self._apply((end, end, f"\n  - {text}"))
        elif self._in_brackets(items):
            end = self._end_of(items.items[-1])
            self._apply((end, end, f", {text}"))
        else:
            end = self._end_of(items.items[-1])
            end = end + len(LINE_BREAK.split(self._text[end:], 1)[0])
            self._apply((end, end, f"\n{' ' * self._dash(items.items[-1])}- {text}"))

    def _remove(self, section: str, item: YamlMapping) -> None:
        items = self._section(section)
        assert isinstance(items, YamlSequence), "the item is in it"
        index = items.items.index(item)
        if len(items.items) == 1:
            begin, end = self._offset(items.position), self._end_of(items)
            if not self._in_brackets(items):
                key = self._key(section)
                begin = self._offset(key.position) + len(section) + 1
            self._apply((begin, end, "[]" if self._in_brackets(items) else " []"))
        elif self._in_brackets(items):
            last = index == len(items.items) - 1
            begin = self._end_of(items.items[index - 1]) if last else self._offset(item.position)
            end = self._end_of(item) if last else self._offset(items.items[index + 1].position)
            self._apply((begin, end, ""))
        else:
            # The line of its dash, up to the line behind what it ends with: comments stay.
            begin = self._line_begin(self._dash_line(item))
            end = self._end_of(item)
            rest = self._text[end:]
            comment = LINE_BREAK.search(rest)
            self._apply((begin, end + (comment.end() if comment else len(rest)), ""))

    def _section(self, section: str) -> YamlNode | None:
        root = self._places.root
        return root.get(section) if isinstance(root, YamlMapping) else None

    def _key(self, section: str) -> YamlScalar:
        root = self._places.root
        assert isinstance(root, YamlMapping), "the file is sound"
        key = root.key(section)
        assert key is not None, "asked for a section that is there"
        return key

    def _in_braces(self, node: YamlMapping) -> bool:
        return self._text[self._offset(node.position)] == "{"

    def _in_brackets(self, node: YamlSequence) -> bool:
        return self._text[self._offset(node.position)] == "["

    def _end_of(self, node: YamlNode) -> int:
        """Return the offset behind the last character of a node."""
        if isinstance(node, YamlScalar):
            return self._span(node)[1]
        inside = [value for _, value in node.entries] if isinstance(node, YamlMapping) else list(node.items)
        begin = self._offset(node.position)
        in_signs = {"{": "}", "[": "]"}.get(self._text[begin])
        end = self._end_of(inside[-1]) if inside else begin + 1
        if in_signs is None:
            return end
        while self._text[end] != in_signs:
            # Only blanks, commas and comments stand between the last value and the bracket.
            end = self._line_end_at(end) if self._text[end] == "#" else end + 1
        return end + 1

    def _line_begin(self, line: int) -> int:
        return [0, *(match.end() for match in LINE_BREAK.finditer(self._text))][line - 1]

    def _line_end(self, line: int) -> int:
        return self._line_end_at(self._line_begin(line))

    def _line_end_at(self, offset: int) -> int:
        found = LINE_BREAK.search(self._text, offset)
        return found.start() if found else len(self._text)

    def _dash_line(self, item: YamlNode) -> int:
        """Return the line with the dash of an item of a list."""
        line = item.position.line
        while not self._text[self._line_begin(line) :].lstrip(" ").startswith("-"):
            line -= 1
        return line

    def _dash(self, item: YamlNode) -> int:
        """Return how far the dash of an item is indented."""
        rest = self._text[self._line_begin(self._dash_line(item)) :]
        return len(rest) - len(rest.lstrip(" "))


def read_hotspot(label: str, values: Mapping[str, str], known: Hotspot | None = None) -> Hotspot:
    """Read a hotspot whose values were typed one by one.

    Args:
        label: Its label.
        values: Key -> value, as in the file.
        known: The hotspot that has the other values.

    Raises:
        ConfigError: Something is wrong; without a place in a file.
    """
    others = {} if known is None else _hotspot_entry(known)
    others.pop("label", None)
    if "yaw" in values:
        others.pop("phi", None)
    (hotspot,) = read_item("hotspots", label, others | dict(values)).hotspots
    return hotspot


def read_zone(label: str, values: Mapping[str, str]) -> Zone:
    """Read a zone whose values were typed one by one; as :func:`read_hotspot`."""
    (zone,) = read_item("zones", label, values).hotspots.zones
    return zone


def _hotspot_entry(hotspot: Hotspot) -> dict[str, str]:
    yaw = hotspot.pose.yaw
    entry = {
        "label": _text(hotspot.label),
        "x": repr(hotspot.pose.x),
        "y": repr(hotspot.pose.y),
        "phi": f"{yaw if abs(yaw) <= math.tau else math.remainder(yaw, math.tau)!r} rad",
        "kind": hotspot.kind,
    }
    return entry | ({"polygon": _corners(hotspot.polygon)} if hotspot.polygon else {})


def _zone_entry(zone: Zone) -> dict[str, str]:
    entry = {"label": _text(zone.label), "kind": zone.kind, "polygon": _corners(zone.polygon)}
    return entry | ({"speed_limit": zone.limit_text} if zone.limit_text else {})


def _corners(polygon: Polygon) -> str:
    return "[" + ", ".join(f"[{x!r}, {y!r}]" for x, y in polygon) + "]"


def _moved_corners(polygon: Polygon, move: Pose2) -> str:
    moved = (move.apply(*corner) for corner in polygon)
    return "[" + ", ".join(f"[{_metres(x)}, {_metres(y)}]" for x, y in moved) + "]"


def _metres(length: float) -> str:
    return repr(round(length, 3) + 0.0)


class _Dumper(yaml.SafeDumper):
    """Puts quotes round texts that :func:`parse_yaml` would not take without them."""

    def represent_str(self, data: str) -> yaml.ScalarNode:
        node = super().represent_str(data)
        if node.style is None and needs_quotes(data):
            node.style = '"'
        return node


_Dumper.add_representer(str, _Dumper.represent_str)


def _text(text: str) -> str:
    """Write a text as YAML, in quotes where it needs them inside of braces."""
    dumped = yaml.dump([text], Dumper=_Dumper, default_flow_style=True, allow_unicode=True, width=math.inf)
    return dumped.strip()[1:-1]
