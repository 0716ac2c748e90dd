"""Reads a YAML file that a person wrote into scalars, sequences and mappings that know their line and column.

Only plain YAML is read. Scalars stay text, so that ``no`` is not false and ``12:30`` is not 750; whoever
reads the file types them. Anchors, aliases, merges, tags, several documents and duplicate keys are
refused: a file says each thing once, in sight, and cannot grow when it is read. Every limit below is met
before memory or time is spent on what lies behind it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from florence_bt.core._flow_hints import explain_flow
from florence_bt.core._yaml_hints import explain
from florence_bt.core.errors import ConfigError
from florence_bt.core.odd_characters import OddCharacter, odd_characters
from florence_bt.core.text_files import LINE_BREAK, decode, read_bytes

MAX_DEPTH = 100
"""Deepest nesting of lists and mappings."""
_TOO_DEEP = f"lists and mappings are nested more than {MAX_DEPTH} deep"
MAX_PARTS = 60_000
"""Keys, values, lists and mappings that one file has at most."""
MAX_TEXT = 10_000
"""Characters that a single text has at most."""
MAX_PROBLEMS = 200
"""With how many problems that can be passed over a file is still read to its end."""


_MAX_PASSES = 20
"""Passes through a file with odd characters: further ones may show when others are put right."""


class EmptyFile(ConfigError):
    """The file is empty, or holds only comments."""


_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_PLAIN_TAGS = (None, "!", "tag:yaml.org,2002:str", "tag:yaml.org,2002:seq", "tag:yaml.org,2002:map")


_WORD = re.compile("[^ \t\r\n\"'#]*")
_IN_QUOTES = re.compile(r"\"[^\"]*\"|'[^']*'")


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A place in a file.

    Attributes:
        line: 1-based.
        column: 1-based, in characters.
    """

    line: int = 1
    column: int = 1


@dataclass(frozen=True, slots=True)
class YamlScalar:
    """A scalar.

    Attributes:
        text: As written, without quotes.
        quoted: Whether it stood in quotes or in a block, and so is certainly a text.
        position: Where it begins.
        first_column: The column of the first character when the text stands in the file exactly as it is
            here; None when it is spread over lines or has escapes.
    """

    text: str
    quoted: bool
    position: Position
    first_column: int | None = field(default=None, compare=False)

    @property
    def empty(self) -> bool:
        """Tell whether nothing was written (or YAML's null)."""
        return not self.quoted and self.text in ("", "~", "null")


@dataclass(frozen=True, slots=True)
class YamlSequence:
    """A list.

    Attributes:
        items: Its items.
        position: Where it begins.
    """

    items: tuple[YamlNode, ...]
    position: Position


@dataclass(frozen=True, slots=True)
class YamlMapping:
    """A mapping.

    Attributes:
        entries: Keys and values in the order of the file; no duplicate key.
        position: Where it begins.
    """

    entries: tuple[tuple[YamlScalar, YamlNode], ...]
    position: Position

    def get(self, key: str) -> YamlNode | None:
        """Return the value of a key, None when it is not there."""
        return next((value for name, value in self.entries if name.text == key), None)

    def key(self, name: str) -> YamlScalar | None:
        """Return the key itself, for its position."""
        return next((key for key, _ in self.entries if key.text == name), None)


YamlNode = YamlScalar | YamlSequence | YamlMapping


def texts_in(source: YamlNode | None) -> Iterator[str]:
    """Yield the texts of all values at or below a node, without the keys."""
    if isinstance(source, YamlScalar):
        yield source.text
    elif source is not None:
        below = source.items if isinstance(source, YamlSequence) else [value for _, value in source.entries]
        for each in below:
            yield from texts_in(each)


def read_yaml(path: Path) -> YamlNode:
    """Read a YAML file.

    Args:
        path: A regular file; pipes and devices are refused, because they may never end.

    Raises:
        ConfigError: The file cannot be read, is not UTF-8, beyond a limit of this module, or not plain YAML.
    """
    return parse_yaml(read_bytes(path), path)


def parse_yaml(
    data: bytes, path: Path, problems: list[ConfigError] | None = None, beside: Collection[str] = ()
) -> YamlNode:
    """Read YAML bytes; ``path`` is only named in errors.

    Args:
        data: The bytes.
        path: The file.
        problems: Receives what is wrong and can be passed over: duplicate keys, tags, anchors, a
            second document, odd spaces. Without it the first of them is raised.
        beside: Keys that stand beside others, for suggestions: ``with`` below ``run``.

    Raises:
        ConfigError: As :func:`read_yaml`; or more than :data:`MAX_PROBLEMS` problems came together.
    """
    text = decode(data, path)
    told: list[ConfigError] = []
    if not text.isascii():
        text = _as_meant(text, path, told)
    if told and problems is None:
        raise told[0]
    if problems is not None:
        problems += told[: MAX_PROBLEMS - len(problems)]
    try:
        return _Composer(text, path, problems).document()
    except yaml.MarkedYAMLError as error:
        raise (told[0] if told else _not_yaml(error, text, path, beside)) from error


def _as_meant(text: str, path: Path, problems: list[ConfigError]) -> str:
    """Replace odd characters by what was probably meant; each of them is a problem."""
    for _ in range(_MAX_PASSES):
        found = list(islice(_odd_characters(text), MAX_PROBLEMS))
        problems += [_odd_error(text, each, path) for each in found if each.problem]
        for each in reversed(found):
            text = f"{text[: each.index]}{each.instead}{text[each.index + 1 :]}"
        if not found or len(problems) >= MAX_PROBLEMS:
            break
    return text


def _odd_characters(text: str) -> Iterator[OddCharacter]:
    """Yield the odd characters outside quotes and comments up to where the text is no YAML."""
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            if isinstance(event, yaml.ScalarEvent) and not event.style:
                begin, end = _index(event.start_mark), _index(event.end_mark)
                for odd in odd_characters(text[begin:end]):
                    yield replace(odd, index=begin + odd.index)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        if mark is not None:
            yield from _odd_before(text, mark.index)


def _index(mark: Any) -> int:
    """Count the characters before a mark."""
    return int(mark.index)


def _odd_before(text: str, index: int) -> Iterator[OddCharacter]:
    """Yield the odd characters in the line where the text is no YAML, up to the word that stands there."""
    begin, rest = text.rfind("\n", 0, index) + 1, _WORD.match(text, index)
    end = rest.end() if rest is not None else index
    without_quotes = _IN_QUOTES.sub(lambda match: " " * len(match[0]), text[begin:end])
    for odd in odd_characters(without_quotes):
        yield replace(odd, index=begin + odd.index)


def _odd_error(text: str, odd: OddCharacter, path: Path) -> ConfigError:
    lines = LINE_BREAK.split(text[: odd.index])
    return ConfigError(odd.problem, file=path, line=len(lines), column=len(lines[-1]) + 1, valid=odd.valid)


def _not_yaml(error: yaml.MarkedYAMLError, text: str, path: Path, beside: Collection[str]) -> ConfigError:
    mark = error.problem_mark or error.context_mark
    position = min(_position(mark) if mark is not None else Position(), _end_of(text))
    begun = error.context_mark.line + 1 if error.context_mark is not None else position.line
    if begun < position.line and _colon_is_missing(error):
        position = Position(begun, len(LINE_BREAK.split(text)[begun - 1].rstrip()) + 1)
    lines, problem = LINE_BREAK.split(text), error.problem or str(error)
    if "nesting depth" in problem:  # PyYAML from 6.0.4 on reads no further
        return ConfigError(
            _TOO_DEEP, file=path, line=position.line, column=position.column, valid=["a flatter file"]
        )
    flow = explain_flow(lines, begun, position.line, position.column, beside)
    if flow is not None:
        return ConfigError(
            f"not YAML: {flow.problem}", file=path, line=flow.line, column=flow.column, valid=flow.valid
        )
    hint = explain(lines, position.line, position.column, problem, beside)
    began_above = begun < position.line and not hint.of_line
    problem = hint.problem + (f" (begun in line {begun})" if began_above else "")
    return ConfigError(
        f"not YAML: {problem}", file=path, line=position.line, column=position.column, valid=hint.valid
    )


def _colon_is_missing(error: yaml.MarkedYAMLError) -> bool:
    """Tell whether a line has no colon; the library looks for it up to the next line, and complains there."""
    return bool(error.problem) and "could not find expected ':'" in str(error.problem)


def _end_of(text: str) -> Position:
    """Return the place behind the last character that is not white space."""
    lines = LINE_BREAK.split(text.rstrip())
    return Position(len(lines), len(lines[-1]) + 1)


def _position(mark: Any) -> Position:
    return Position(mark.line + 1, mark.column + 1)


def _first_column(event: Any, position: Position, quoted: bool) -> int | None:
    start, end = event.start_mark, event.end_mark
    as_it_is = start.line == end.line and end.column - start.column == len(event.value) + 2 * quoted
    return position.column + quoted if as_it_is else None


def _sign_of(event: Any) -> str:
    return "*" if isinstance(event, yaml.AliasEvent) else "&"


class _Composer:
    """Builds the sources of one document from YAML events."""

    def __init__(self, text: str, path: Path, problems: list[ConfigError] | None) -> None:
        self._path = path
        self._problems = problems
        self._parts = 0
        self._events: Iterator[Any] = iter(yaml.parse(text, Loader=_LOADER))

    def document(self) -> YamlNode:
        root: YamlNode | None = None
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    self._note(self._error(event, "a second document begins here", "one document in a file"))
                    break
                root = self._node(next(self._events), 0)
        if root is None or (isinstance(root, YamlScalar) and root.empty):
            raise EmptyFile("the file is empty", file=self._path, line=1, column=1)
        return root

    def _node(self, event: Any, depth: int) -> YamlNode:
        self._refuse_what_is_not_plain(event, depth)
        position = _position(event.start_mark)
        if isinstance(event, yaml.ScalarEvent):
            if len(event.value) > MAX_TEXT:
                problem = f"a text of {len(event.value)} characters; at most {MAX_TEXT} are read"
                raise self._error(event, problem, "a shorter text")
            quoted = event.style is not None and event.style != ""
            return YamlScalar(event.value, quoted, position, _first_column(event, position, quoted))
        if isinstance(event, yaml.SequenceStartEvent):
            return YamlSequence(tuple(self._items(depth)), position)
        return YamlMapping(tuple(self._entries(depth)), position)

    def _refuse_what_is_not_plain(self, event: Any, depth: int) -> None:
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            valid = ("writing the value again", f"quotes round it, if it is text with {_sign_of(event)}")
            error = self._error(event, "anchors and aliases are not allowed", *valid)
            if isinstance(event, yaml.AliasEvent):
                raise error
            self._note(error)
        if event.tag not in _PLAIN_TAGS:
            valid = ("the value without a tag", "quotes round it, if it is text with !")
            if event.tag.startswith("!$"):
                valid = (f"not {event.tag[1:]}", valid[1])
            self._note(self._error(event, f"the tag {event.tag} is not allowed", *valid))
        if depth > MAX_DEPTH:
            raise self._error(event, _TOO_DEEP, "a flatter file")
        self._parts += 1
        if self._parts > MAX_PARTS:
            problem = f"the file has more than {MAX_PARTS} keys and values"
            raise self._error(event, problem, "several smaller files")

    def _items(self, depth: int) -> Iterator[YamlNode]:
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            yield self._node(event, depth + 1)

    def _entries(self, depth: int) -> Iterator[tuple[YamlScalar, YamlNode]]:
        seen: dict[str, int] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            key = self._node(event, depth + 1)
            if not isinstance(key, YamlScalar):
                valid = ("a name and a colon",)
                if isinstance(event, yaml.MappingStartEvent) and event.flow_style:
                    valid = ("$key for the value of a key, without braces",)
                elif isinstance(event, yaml.SequenceStartEvent):
                    valid = ("a line of its own for each item of the list",)
                raise self._error(event, "a key must be a plain text", *valid)
            if key.text == "<<" and not key.quoted:
                raise self._error(event, "merges (<<) are not allowed", "writing the entries again")
            value = self._node(next(self._events), depth + 1)
            if key.text in seen:
                duplicate = f"the key {key.text!r} is duplicated (first in line {seen[key.text]})"
                self._note(self._error(event, duplicate, "one of the two", "another name"))
                continue
            seen[key.text] = key.position.line
            yield key, value

    def _note(self, error: ConfigError) -> None:
        """Note something that is wrong and can be passed over."""
        if self._problems is None:
            raise error
        if len(self._problems) == MAX_PROBLEMS:
            raise self._problems[0]
        self._problems.append(error)

    def _error(self, event: Any, problem: str, *valid: str) -> ConfigError:
        position = _position(event.start_mark)
        return ConfigError(problem, file=self._path, line=position.line, column=position.column, valid=valid)
