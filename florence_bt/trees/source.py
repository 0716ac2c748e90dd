"""Reads a YAML file into texts, lists and tables that know their line and column.

Scalars stay text, so that ``no`` is not false and ``12:30`` is not 750; the mission language types them.
Anchors, tags, several documents and duplicate keys are refused: a mission says each thing once, in sight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from florence_bt.core.errors import ConfigError

MAX_BYTES = 1_000_000
"""Largest file that is read."""
MAX_DEPTH = 64
"""Deepest nesting of lists and tables."""

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_PLAIN_TAGS = (None, "!", "tag:yaml.org,2002:str", "tag:yaml.org,2002:seq", "tag:yaml.org,2002:map")


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A place in a file.

    Attributes:
        line: 1-based.
        column: 1-based.
    """

    line: int = 1
    column: int = 1


@dataclass(frozen=True, slots=True)
class Text:
    """A scalar.

    Attributes:
        text: As written, without quotes.
        quoted: Whether it stood in quotes or in a block, and so is certainly a text.
        position: Where it begins.
    """

    text: str
    quoted: bool
    position: Position

    @property
    def empty(self) -> bool:
        """Whether nothing was written (or YAML's null)."""
        return not self.quoted and self.text in ("", "~", "null")


@dataclass(frozen=True, slots=True)
class Listing:
    """A list.

    Attributes:
        items: Its items.
        position: Where it begins.
    """

    items: tuple[Source, ...]
    position: Position


@dataclass(frozen=True, slots=True)
class Table:
    """A mapping.

    Attributes:
        entries: Keys and values in the order of the file; no key twice.
        position: Where it begins.
    """

    entries: tuple[tuple[Text, Source], ...]
    position: Position

    def get(self, key: str) -> Source | None:
        """The value of a key, None when it is not there."""
        return next((value for name, value in self.entries if name.text == key), None)

    def key(self, name: str) -> Text | None:
        """The key itself, for its position."""
        return next((key for key, _ in self.entries if key.text == name), None)


Source = Text | Listing | Table


def read_source(path: Path) -> Source:
    """Read a YAML file.

    Raises:
        ConfigError: The file cannot be read, is no UTF-8, too large, too deep, or no YAML of the plain kind.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ConfigError(f"the file cannot be read: {error.strerror}", file=path) from error
    return parse_source(data, path)


def parse_source(data: bytes, path: Path) -> Source:
    """Read YAML bytes; ``path`` is only named in errors.

    Raises:
        ConfigError: As :func:`read_source`.
    """
    if len(data) > MAX_BYTES:
        raise ConfigError(f"the file has more than {MAX_BYTES} bytes", file=path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        column = error.start - (data.rfind(b"\n", 0, error.start) + 1) + 1
        raise ConfigError(
            f"byte 0x{data[error.start]:02x} is not UTF-8",
            file=path,
            line=line,
            column=column,
            valid=["saving the file as UTF-8"],
        ) from error
    _refuse_tabs(text, path)
    try:
        return _Composer(text, path).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        position = _position(mark) if mark is not None else Position()
        problem = ": ".join(part for part in (error.context, error.problem) if part)
        raise ConfigError(
            f"not YAML: {problem}", file=path, line=position.line, column=position.column
        ) from error
    except yaml.YAMLError as error:
        raise ConfigError(f"not YAML: {str(error).splitlines()[0]}", file=path, line=1, column=1) from error


def _refuse_tabs(text: str, path: Path) -> None:
    for number, line in enumerate(text.split("\n"), start=1):
        indent = line[: len(line) - len(line.lstrip(" \t"))]
        if "\t" in indent:
            raise ConfigError(
                "a tab in the indentation",
                file=path,
                line=number,
                column=indent.index("\t") + 1,
                valid=["spaces"],
            )


def _position(mark: Any) -> Position:
    return Position(mark.line + 1, mark.column + 1)


class _Composer:
    """Builds the sources of one document from YAML events."""

    def __init__(self, text: str, path: Path) -> None:
        self._path = path
        self._events: Iterator[Any] = iter(yaml.parse(text, Loader=_LOADER))

    def document(self) -> Source:
        root: Source | None = None
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    raise self._error(event, "a second document begins here", "one mission in a file")
                root = self._node(next(self._events), 0)
        if root is None or (isinstance(root, Text) and root.empty):
            raise ConfigError("the file is empty", file=self._path, line=1, column=1)
        return root

    def _node(self, event: Any, depth: int) -> Source:
        position = _position(event.start_mark)
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            raise self._error(
                event, "anchors and aliases are not allowed", "writing the value again", "run: a mission"
            )
        if event.tag not in _PLAIN_TAGS:
            raise self._error(event, f"the tag {event.tag} is not allowed", "the value without a tag")
        if depth > MAX_DEPTH:
            raise self._error(
                event, f"lists and tables are nested more than {MAX_DEPTH} deep", "run: a mission"
            )
        if isinstance(event, yaml.ScalarEvent):
            return Text(event.value, event.style is not None and event.style != "", position)
        if isinstance(event, yaml.SequenceStartEvent):
            return Listing(tuple(self._items(depth)), position)
        return Table(tuple(self._entries(depth)), position)

    def _items(self, depth: int) -> Iterator[Source]:
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            yield self._node(event, depth + 1)

    def _entries(self, depth: int) -> Iterator[tuple[Text, Source]]:
        seen: dict[str, int] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            key = self._node(event, depth + 1)
            if not isinstance(key, Text):
                raise self._error(event, "a key must be a plain text")
            if key.text in seen:
                raise self._error(
                    event, f"the key {key.text!r} stands here twice (first in line {seen[key.text]})"
                )
            seen[key.text] = key.position.line
            yield key, self._node(next(self._events), depth + 1)

    def _error(self, event: Any, problem: str, *valid: str) -> ConfigError:
        position = _position(event.start_mark)
        return ConfigError(problem, file=self._path, line=position.line, column=position.column, valid=valid)
