"""Reads the parts that files have in common: words and times, and of missions and skills names and values.

What is wrong is added to the findings, and the reading goes on.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.core.unquoted_commas import UnquotedComma, unquoted_commas
from florence_bt.core.yaml_reader import YamlReader, written
from florence_bt.trees.kinds.words import NEVER_INPUTS
from florence_bt.trees.language import _suggestions as suggestions
from florence_bt.trees.language.expressions.parser import closing_brace, parse_expression
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import (
    Expression,
    ListItems,
    Literal,
    PoseParts,
    Reference,
    Template,
    Value,
)
from florence_bt.trees.language.quantities import is_duration, read_value
from florence_bt.trees.language.vocabulary import IDENTIFIER, OTHER_YAWS

T = TypeVar("T")

_DOLLAR = re.compile(r"\$(?:(?P<dollar>\$)|(?P<key>[a-z][a-z0-9_]*)|\{(?P<braced>[a-z][a-z0-9_]*)\}|)")
_NAME = re.compile(r"[A-Za-z_À-ɏ][A-Za-z0-9_À-ɏ]*")

_NAMES = re.compile(r"[a-z][a-z0-9_]*(?:(?:, *| +)[a-z][a-z0-9_]*)+")
"""Several names without their brackets."""

_GLUED = re.compile(r"(?P<name>[a-z][a-z0-9_]*):(?P<value>\S.*)")
"""An entry without the space behind its colon, which YAML reads as a name: ``text:Hello``."""
_POSE = "{x: 1 m, y: 2 m, yaw: 90 deg}"


class WordReader(FindingList):
    """Reads words and times of one file; each method returns None when it added to the findings."""

    def __init__(self, file: Path, *, imported: bool = False) -> None:
        super().__init__(file, imported=imported)
        self.yaml = YamlReader(file)

    def noted(self, read: Callable[..., T], *what: Any) -> T | None:
        """Read something with a method of :attr:`yaml`; what it raises is added to the findings."""
        try:
            return read(*what)
        except ConfigError as error:
            self.add_error(error)
            return None

    def text(self, source: YamlNode, what: str) -> str | None:
        """Read a text that is not empty."""
        text = self.noted(self.yaml.text, source, what)
        return None if text is None else text.strip()

    def choice(self, source: YamlNode, what: str, words: Collection[str]) -> str | None:
        """Read one of a few words."""
        return self.noted(self.yaml.choice, source, what, words)

    def flag(self, source: YamlNode | None, what: str) -> bool:
        """Read true or false; false where nothing is written."""
        return source is not None and bool(self.noted(self.yaml.flag, source, what))

    def duration(self, source: YamlNode, what: str) -> float | None:
        """Read a duration in seconds, zero or more."""
        text = written(source)
        try:
            seconds = float(read_value(text, Kind.DURATION))
        except ConfigError as error:
            self.error(source.position, f"{what}: {error.problem}", error.valid)
            return None
        if seconds < 0.0:
            self.error(source.position, f"{what} cannot be {text!r}", ["3 s", "500 ms", "2 min"])
            return None
        return seconds


class Reader(WordReader):
    """Reads parts of one file; each method returns None, or leaves out, what it added to the findings."""

    def mapping(self, source: YamlNode | None, what: str) -> YamlMapping | None:
        """Read a mapping, or None (a finding, unless nothing was written)."""
        if isinstance(source, YamlMapping):
            return source
        if source is not None and not (isinstance(source, YamlScalar) and source.empty):
            first = source.items[0] if isinstance(source, YamlSequence) and source.items else source
            name = (
                first.text if isinstance(first, YamlScalar) and IDENTIFIER.fullmatch(first.text) else "name"
            )
            dashes = ", without dashes" if isinstance(source, YamlSequence) else ""
            inside = {"out": f"{name}: {name}", "with": f"name of an input: {name}"}.get(what, f"{name}: ...")
            valid = [f"{what}: {{{inside}}}{dashes}"]
            self.error(source.position, f"{what} must be a mapping (key: value)", valid)
        return None

    def identifier(self, source: YamlNode, what: str, valid: Iterable[str] = ()) -> Literal | None:
        """Read a name in lower case; ``valid`` is what would have worked, if the caller knows better."""
        if isinstance(source, YamlScalar) and IDENTIFIER.fullmatch(source.text):
            return Literal(source.text, True, source.position)
        written = source.text if isinstance(source, YamlScalar) and not source.empty else ""
        message = f"{what} must be a name of lower-case letters, digits and underscores"
        suggestion = _as_name(written)
        valid = tuple(valid) or ((suggestion,) if suggestion else ())
        self.error(source.position, message + (f", not {written!r}" if written else ""), valid)
        return None

    def identifiers(self, source: YamlNode, what: str) -> tuple[Literal, ...]:
        """Read a list of names, or a single one."""
        items = source.items if isinstance(source, YamlSequence) else (source,)
        several = isinstance(source, YamlScalar) and _NAMES.fullmatch(source.text)
        valid = (f"[{', '.join(re.split('[ ,]+', several[0]))}]",) if several else ()
        return tuple(name for item in items if (name := self.identifier(item, what, valid)) is not None)

    def values(self, source: YamlNode | None, what: str) -> tuple[tuple[Literal, Value], ...]:
        """Read a mapping of names to values; those that cannot be read are left out."""
        mapping = self.mapping(source, what)
        pairs: list[tuple[Literal, Value]] = []
        fallen_apart = {text.key: text for text in unquoted_commas(mapping)} if mapping else {}
        pieces = {piece for text in fallen_apart.values() for piece in text.pieces}
        for key, item in mapping.entries if mapping else ():
            if key in pieces:
                continue
            glued = _GLUED.fullmatch(key.text) if isinstance(item, YamlScalar) and item.empty else None
            if glued is not None and not key.quoted:
                valid = [f"{glued['name']}: {glued['value']}"]
                self.error(key.position, f"{what}: a space is missing behind the colon", valid)
                continue
            if what == "with" and key.text in NEVER_INPUTS:
                self.error(
                    key.position, f"{key.text!r} stands among the inputs", [f"{key.text} indented like with"]
                )
                continue
            name = self.identifier(key, f"a name in {what}")
            if key in fallen_apart:
                self.unquoted_comma(fallen_apart[key])
                continue
            value = self.value(item, f"{key.text!r}")
            if name is not None and value is not None:
                pairs.append((name, value))
        return tuple(pairs)

    def unquoted_comma(self, text: UnquotedComma) -> None:
        """Add a text that fell apart at its commas."""
        message = f"{text.key.text!r}: text with commas needs quotes here"
        if text.whole.startswith("(") and text.whole.endswith(")"):
            self.error(text.first.position, f"{message}, and a pose is a mapping", [_POSE])
        else:
            self.error(text.first.position, message, [text.valid])

    def keys(self, source: YamlNode | None) -> tuple[tuple[Literal, Literal], ...]:
        """Read ``out``: a mapping of outputs and the keys that receive them."""
        mapping = self.mapping(source, "out")
        pairs = []
        for key, item in mapping.entries if mapping else ():
            output = self.identifier(key, "an output")
            target = self.identifier(without_dollar(item), "a key")
            if output is not None and target is not None:
                pairs.append((output, target))
        return tuple(pairs)

    def value(self, source: YamlNode, what: str) -> Value | None:
        """Read a literal, a reference, a text with keys, or a pose."""
        if isinstance(source, YamlMapping):
            return self._pose(source, what)
        if isinstance(source, YamlSequence):
            items = [self.value(item, f"an item of {what}") for item in source.items]
            given = tuple(item for item in items if item is not None)
            return ListItems(given, source.position) if len(given) == len(items) else None
        if source.empty:
            # What begins with # is a comment.
            self.error(source.position, f"{what} has no value", ["a value", 'quotes round it: "..."'])
            return None
        return self._scalar(source)

    def expression(
        self,
        source: YamlNode,
        what: str,
        *,
        or_node: bool = False,
        constants: Mapping[str, Any] | None = None,
    ) -> Expression | None:
        """Read an expression that stands alone; ``${`` and ``}`` round it do no harm.

        Args:
            source: Where it stands.
            what: What has it.
            or_node: Whether a node could stand there as well.
            constants: Of an expression over a message: the values that its type names.
        """
        if not isinstance(source, YamlScalar) or source.empty or not source.text.strip():
            node = suggestions.for_condition(what, source)
            message = f"{what} needs an expression" + (", not a node" if node else "")
            self.error(source.position, message, node or ["$distance < 1 m", "$found and not $done"])
            return None
        text = source.text.rstrip()
        if or_node and IDENTIFIER.fullmatch(text) and text not in ("true", "false"):
            message = f"{what}: {text!r} is neither a key nor a node"
            self.error(source.position, message, (f"${text}", f"{{{text}: }}, if it is a skill"))
            return None
        if is_duration(text):
            message = f"{what}: {text.strip()!r} is a time that passes, and no condition"
            self.error(source.position, message, [suggestions.for_duration(what, text.strip())])
            return None
        start = len(text) - len(text.lstrip())
        if text.startswith("${", start) and closing_brace(text, start + 2) == len(text) - 1:
            inside = text[start + 2 : -1]
            if not IDENTIFIER.fullmatch(inside):
                return self.expression_in(source, inside, start + 2, constants)
        return self.expression_in(source, text[start:], start, constants)

    def expression_in(
        self, source: YamlScalar, text: str, offset: int, constants: Mapping[str, Any] | None = None
    ) -> Expression | None:
        """Read an expression that is a part of a scalar; a line break counts as a space.

        Args:
            source: The scalar.
            text: The part.
            offset: Where in the scalar the part begins, in characters.
            constants: As for :meth:`expression`.
        """
        column = source.first_column
        place = source.position if column is None else Position(source.position.line, column + offset)
        try:
            return parse_expression(text, place, exact=column is not None, constants=constants)
        except ConfigError as error:
            self.add_error(error)
            return None

    def _scalar(self, source: YamlScalar) -> Value | None:
        text = source.text.strip()
        if text.startswith("${") and closing_brace(text, 2) == len(text) - 1:
            inside = text[2:-1]
            if not IDENTIFIER.fullmatch(inside):
                return self.expression_in(source, inside, source.text.index("${") + 2)
        parts: list[str | Reference] = []
        end = 0
        for match in _DOLLAR.finditer(source.text):
            parts.append(source.text[end : match.start()])
            end = match.end()
            key = match["key"] or match["braced"]
            more = _NAME.match(source.text, match.start("key")) if match["key"] else None
            if more is not None and more[0] != key:
                behind = more[0][len(key) :]
                valid = [f"${_as_name(more[0])}", *([f"${{{key}}}{behind}"] if behind.isascii() else [])]
                message = f"keys have letters from a to z, not ${more[0]} in {source.text!r}"
                self.error(source.position, message, valid)
                return None
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

    def _lone_dollar(self, source: YamlScalar, after: int) -> None:
        end = closing_brace(source.text, after + 1) if source.text.startswith("{", after) else None
        if end is None:
            name = _NAME.match(source.text, after)
            suggestion = _as_name(name[0]) if name else None
            valid = [f"${suggestion or 'key'}", "$$ for a dollar sign"]
            problem = f"keys have lower-case letters, not ${name[0]}" if name and suggestion else "a lone $"
            self.error(source.position, f"{problem} in {source.text!r}", valid)
            return
        written = source.text[after - 1 : end + 1]
        valid = [f"set: {{key: {written!r}}} first, and $key in the text"]
        self.error(source.position, f"the expression {written} must stand alone, not inside text", valid)

    def _pose(self, mapping: YamlMapping, what: str) -> PoseParts | None:
        names = [key.text for key, _ in mapping.entries]
        if names and not {"x", "y", "yaw", *OTHER_YAWS} & {*names}:
            valid = [f"[{', '.join(names)}]", "a single value", _POSE]
            self.error(mapping.position, f"{what}: a value is needed, not a table", valid)
            return None
        parts: dict[str, Value] = {}
        for key, item in mapping.entries:
            if key.text in OTHER_YAWS and mapping.key("yaw") is None:
                self.error(key.position, f"unknown part of a pose {key.text!r}", ["yaw"])
            elif key.text not in ("x", "y", "yaw"):
                self.unknown(
                    key.position, f"unknown part of a pose {key.text!r}", key.text, ("x", "y", "yaw")
                )
            elif (value := self.value(item, f"{key.text} of the pose")) is not None:
                parts[key.text] = value
        missing = [name for name in ("x", "y", "yaw") if mapping.key(name) is None]
        other = next((key for key, _ in mapping.entries if key.text in OTHER_YAWS), None)
        if missing and not (missing == ["yaw"] and other is not None):
            self.error(
                mapping.position,
                f"{what}: the pose lacks {', '.join(missing)}",
                [_POSE],
            )
        return PoseParts(parts["x"], parts["y"], parts["yaw"], mapping.position) if len(parts) == 3 else None


_LETTERS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "æ": "ae", "ø": "oe", "å": "aa", "œ": "oe"}
)
"""Letters that are two when they are written with those of a name."""


def _as_name(written: str) -> str | None:
    """Return the name that was written in another way: ``My-Mission.yaml``, ``$my_mission``, ``größe``."""
    last = (
        re.split(r"[/\\]", written)[-1].strip().removeprefix("$").removesuffix(".yaml").removesuffix(".yml")
    )
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", last).lower().translate(_LETTERS)
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", words) if not unicodedata.combining(sign))
    name = re.sub(r"[\W_]+", "_", plain, flags=re.ASCII).strip("_")
    return name if IDENTIFIER.fullmatch(name) else None


def without_dollar(source: YamlNode) -> YamlNode:
    """Remove the dollar sign of a key: ``out: {pose: $goal}`` means the key ``goal`` as well."""
    if isinstance(source, YamlScalar) and source.text.startswith("$"):
        return YamlScalar(source.text[1:], source.quoted, source.position)
    return source
