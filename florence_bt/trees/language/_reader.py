"""Small steps of the parser: each takes a piece of the source, notes what is wrong with it, and goes on."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.torn_texts import TornText, torn_texts
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.scanning import closing_brace
from florence_bt.trees.language.findings import ERROR, MAX_FINDINGS, Finding
from florence_bt.trees.language.kinds import IDENTIFIER
from florence_bt.trees.language.model import Expression, Literal, PoseParts, Reference, Template, Value
from florence_bt.trees.language.source import Listing, Position, Source, Table, Text

_DOLLAR = re.compile(r"\$(?:(?P<dollar>\$)|(?P<key>[a-z][a-z0-9_]*)|\{(?P<braced>[a-z][a-z0-9_]*)\}|)")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

_POSE = "{x: 1 m, y: 2 m, yaw: 90 deg}"

_MEANT_BY = {"yes": "true", "on": "true", "true": "true", "no": "false", "off": "false", "false": "false"}
"""What people write for true and false."""
_OTHER_YAWS = ("theta", "phi", "th", "angle", "heading", "orientation")
"""What others call the heading of a pose."""


class Reader:
    """Collects what is wrong with a file while it is read.

    Args:
        file: The file, named in the findings.
    """

    def __init__(self, file: Path) -> None:
        self.findings: list[Finding] = []
        self._file = str(file)

    @property
    def full(self) -> bool:
        """Whether more was noted than is ever shown."""
        return len(self.findings) > MAX_FINDINGS

    def problem(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note an error; those beyond what is ever shown are dropped."""
        if not self.full:
            self.findings.append(
                Finding(self._file, position.line, position.column, ERROR, message, tuple(valid))
            )

    def unknown(self, position: Position, what: str, name: str, names: Iterable[str]) -> None:
        """Note a name that does not exist, with those that look like it."""
        if not self.full:
            self.problem(position, f"unknown {what} {name!r}", closest_first(name, names))

    def table(self, source: Source | None, what: str) -> Table | None:
        """A table, or nothing (noted, unless nothing was written)."""
        if isinstance(source, Table):
            return source
        if source is not None and not (isinstance(source, Text) and source.empty):
            first = source.items[0] if isinstance(source, Listing) and source.items else source
            name = first.text if isinstance(first, Text) and IDENTIFIER.fullmatch(first.text) else "name"
            dashes = ", without dashes" if isinstance(source, Listing) else ""
            valid = [f"{what}: {{{name}: ...}}{dashes}"]
            self.problem(source.position, f"{what} must be a table (key: value)", valid)
        return None

    def text(self, source: Source, what: str) -> str | None:
        """A text that is not empty."""
        if isinstance(source, Text) and not source.empty and source.text.strip():
            return source.text.strip()
        self.problem(source.position, f"{what} must be a text")
        return None

    def identifier(self, source: Source, what: str, valid: Iterable[str] = ()) -> Literal | None:
        """A name in lower case; ``valid`` is what would have worked, if the caller knows better."""
        if isinstance(source, Text) and IDENTIFIER.fullmatch(source.text):
            return Literal(source.text, True, source.position)
        written = source.text if isinstance(source, Text) and not source.empty else ""
        message = f"{what} must be a name of lower-case letters, digits and underscores"
        meant = _as_name(written)
        valid = tuple(valid) or ((meant,) if meant else ())
        self.problem(source.position, message + (f", not {written!r}" if written else ""), valid)
        return None

    def choice(self, source: Source, what: str, choices: Iterable[str], default: str) -> str:
        """One of a few words."""
        choices = tuple(choices)
        if isinstance(source, Text) and source.text in choices:
            return source.text
        written = source.text if isinstance(source, Text) else "this"
        meant = _MEANT_BY.get(written.lower())
        valid = (meant,) if meant in choices else choices
        self.problem(source.position, f"{what} cannot be {written!r}", valid)
        return default

    def identifiers(self, source: Source, what: str) -> tuple[Literal, ...]:
        """A list of names, or a single one."""
        items = source.items if isinstance(source, Listing) else (source,)
        return tuple(name for item in items if (name := self.identifier(item, what)) is not None)

    def values(self, source: Source | None, what: str) -> tuple[tuple[Literal, Value], ...]:
        """A table of names and values; those that cannot be read (noted) are left out."""
        table = self.table(source, what)
        pairs: list[tuple[Literal, Value]] = []
        torn = {text.key: text for text in torn_texts(table)} if table else {}
        pieces = {piece for text in torn.values() for piece in text.pieces}
        for key, item in table.entries if table else ():
            if key in pieces:
                continue
            name = self.identifier(key, f"a name in {what}")
            if key in torn:
                self.torn(torn[key])
                continue
            value = self.value(item, f"{key.text!r}")
            if name is not None and value is not None:
                pairs.append((name, value))
        return tuple(pairs)

    def torn(self, text: TornText) -> None:
        """Note a text that fell apart at its commas."""
        message = f"{text.key.text!r}: a text with commas needs quotes here"
        if text.whole.startswith("(") and text.whole.endswith(")"):
            self.problem(text.first.position, f"{message}, and a pose is a table", [_POSE])
        else:
            self.problem(text.first.position, message, [text.valid])

    def keys(self, source: Source | None) -> tuple[tuple[Literal, Literal], ...]:
        """``out``: a table of outputs and the keys that receive them."""
        table = self.table(source, "out")
        pairs = []
        for key, item in table.entries if table else ():
            output = self.identifier(key, "an output")
            target = self.identifier(_without_dollar(item), "a key")
            if output is not None and target is not None:
                pairs.append((output, target))
        return tuple(pairs)

    def value(self, source: Source, what: str) -> Value | None:
        """A literal, a reference, a text with keys, or a pose."""
        if isinstance(source, Table):
            return self._pose(source, what)
        if isinstance(source, Listing):
            valid = [_POSE] if len(source.items) == 3 else ["a single value"]
            self.problem(source.position, f"{what} cannot be a list", valid)
            return None
        if source.empty:
            # What begins with # is a comment.
            self.problem(source.position, f"{what} has no value", ["a value", 'quotes round it: "..."'])
            return None
        return self._scalar(source)

    def expression(self, source: Source, what: str) -> Expression | None:
        """An expression that stands alone; ``${`` and ``}`` round it do no harm."""
        if not isinstance(source, Text) or source.empty or not source.text.strip():
            valid = ["$distance < 1 m", "$found and not $done"]
            self.problem(source.position, f"{what} needs an expression", valid)
            return None
        text = source.text.rstrip()
        start = len(text) - len(text.lstrip())
        if text.startswith("${", start) and closing_brace(text, start + 2) == len(text) - 1:
            inside = text[start + 2 : -1]
            if not IDENTIFIER.fullmatch(inside):
                return self._parsed(source, inside, start + 2)
        return self._parsed(source, text[start:], start)

    def _parsed(self, source: Text, text: str, offset: int) -> Expression | None:
        """Parse a part of a scalar; a line break counts as a space."""
        column = source.first_column
        place = source.position if column is None else Position(source.position.line, column + offset)
        try:
            return parse_expression(text, place, exact=column is not None)
        except ConfigError as error:
            self.problem(Position(error.line or 1, error.column or 1), error.problem, error.valid)
            return None

    def _scalar(self, source: Text) -> Value | None:
        text = source.text.strip()
        if text.startswith("${") and closing_brace(text, 2) == len(text) - 1:
            inside = text[2:-1]
            if not IDENTIFIER.fullmatch(inside):
                return self._parsed(source, inside, source.text.index("${") + 2)
        parts: list[str | Reference] = []
        end = 0
        for match in _DOLLAR.finditer(source.text):
            parts.append(source.text[end : match.start()])
            end = match.end()
            key = match["key"] or match["braced"]
            if key:
                parts.append(Reference(key, source.position))
            elif match["dollar"]:
                parts.append("$")
            else:
                self._lone_dollar(source, match.end())
                return None
        parts.append(source.text[end:])
        parts = [part for part in parts if part != ""]
        if len(parts) == 1 and isinstance(parts[0], Reference):
            return parts[0]
        if any(isinstance(part, Reference) for part in parts):
            return Template(tuple(parts), source.position, source.quoted)
        return Literal("".join(str(part) for part in parts), source.quoted, source.position)

    def _lone_dollar(self, source: Text, after: int) -> None:
        end = closing_brace(source.text, after + 1) if source.text.startswith("{", after) else None
        if end is None:
            name = _NAME.match(source.text, after)
            meant = _as_name(name[0]) if name else None
            valid = [f"${meant or 'key'}", "$$ for a dollar sign"]
            problem = f"keys have lower-case letters, not ${name[0]}" if name and meant else "a lone $"
            self.problem(source.position, f"{problem} in {source.text!r}", valid)
            return
        written = source.text[after - 1 : end + 1]
        valid = [f"set: {{key: {written!r}}} first, and $key in the text"]
        self.problem(source.position, f"the expression {written} must stand alone, not in a text", valid)

    def _pose(self, table: Table, what: str) -> PoseParts | None:
        parts: dict[str, Value] = {}
        for key, item in table.entries:
            if key.text in _OTHER_YAWS and table.key("yaw") is None:
                self.problem(key.position, f"unknown part of a pose {key.text!r}", ["yaw"])
            elif key.text not in ("x", "y", "yaw"):
                self.unknown(key.position, "part of a pose", key.text, ("x", "y", "yaw"))
            elif (value := self.value(item, f"{key.text} of the pose")) is not None:
                parts[key.text] = value
        missing = [name for name in ("x", "y", "yaw") if table.key(name) is None]
        other = next((key for key, _ in table.entries if key.text in _OTHER_YAWS), None)
        if missing and not (missing == ["yaw"] and other is not None):
            self.problem(
                table.position,
                f"{what}: the pose lacks {', '.join(missing)}",
                [_POSE],
            )
        return PoseParts(parts["x"], parts["y"], parts["yaw"], table.position) if len(parts) == 3 else None


def _as_name(written: str) -> str | None:
    """The name that somebody wrote in another way: ``My-Mission.yaml`` or ``$my_mission``."""
    last = (
        re.split(r"[/\\]", written)[-1].strip().removeprefix("$").removesuffix(".yaml").removesuffix(".yml")
    )
    name = re.sub(r"[\s-]+", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", last)).lower()
    return name if IDENTIFIER.fullmatch(name) else None


def _without_dollar(source: Source) -> Source:
    """``out: {pose: $goal}`` means the key ``goal`` as well."""
    if isinstance(source, Text) and source.text.startswith("$"):
        return Text(source.text[1:], source.quoted, source.position)
    return source
