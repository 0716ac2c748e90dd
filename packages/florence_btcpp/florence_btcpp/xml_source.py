"""Reads XML into elements that know their line: bounded, without entities."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.core.text_files import MAX_BYTES, read_bytes

MAX_ELEMENTS = 5_000
"""Most elements in a file."""
MAX_PORTS = 500
"""Most attributes of an element."""
MAX_ATTRIBUTES = 10_000
"""Most attributes in a file."""
MAX_TEXT = 10_000
"""Most characters of an attribute, or of the text of an element: a mission cannot have a longer one."""
MAX_DEPTH = 256
"""Deepest nesting of nodes, which is BehaviorTree.CPP's own limit."""
_OUTER = 2
"""``<root>`` and ``<BehaviorTree>``, which stand around the nodes."""


@dataclass(eq=False, slots=True)
class Element:
    """An XML element.

    Attributes:
        tag: Its name.
        attributes: Its attributes in the order of the file.
        position: Where it begins.
        children: The elements directly below.
        text: The character data directly below, without the white space around it.
    """

    tag: str
    attributes: dict[str, str]
    position: Position = field(default_factory=Position)
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def get(self, name: str, default: str = "") -> str:
        """Return the value of an attribute."""
        return self.attributes.get(name, default)

    def walk(self) -> Iterator[Element]:
        """Yield this element and every element below, in the order of the file."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))


def read_xml(path: Path) -> Element:
    """Read an XML file.

    Raises:
        ConfigError: The file cannot be read, is too large or too deep, is not XML, or has a document type
            (entities could make a small file explode, or read other files).
    """
    if not path.is_file():
        raise ConfigError("there is no such file", file=path)
    return parse_xml(read_bytes(path), path)


def parse_xml(data: bytes, path: Path) -> Element:
    """Read XML bytes; ``path`` is only named in errors.

    Raises:
        ConfigError: As :func:`read_xml`.
    """
    if len(data) > MAX_BYTES:
        raise ConfigError(
            f"the file has more than {MAX_BYTES} bytes", file=path, valid=["smaller files, with <include>"]
        )
    try:
        return _Builder(path).build(data)
    except _NotXml as error:
        escaped = _ATTRIBUTE.sub(_with_escapes, data)
        if escaped == data:
            raise
        try:
            return _Builder(path).build(escaped)
        except _NotXml:
            raise error from None


class _NotXml(ConfigError):
    """The parser refuses the file."""


_ATTRIBUTE = re.compile(rb"""=\s*(?:"[^"]*"|'[^']*')""")
_RAW_AND = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)")


def _with_escapes(attribute: re.Match[bytes]) -> bytes:
    """Escape a raw ``&`` or ``<`` in an attribute; the parser of BehaviorTree.CPP takes them raw."""
    return _RAW_AND.sub(b"&amp;", attribute[0]).replace(b"<", b"&lt;")


class _Builder:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.ordered_attributes = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype
        self._open: list[Element] = []
        self._root: Element | None = None
        self._count = 0
        self._attributes = 0

    def build(self, data: bytes) -> Element:
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            place = Position(error.lineno, error.offset + 1)
            problem = f"not XML: {expat.errors.messages[error.code]}"
            raise _NotXml(problem, file=self._path, line=place.line, column=place.column) from error
        except (LookupError, ValueError) as error:
            raise self._error(f"not XML: {error}", Position(1, 1), ["encoding UTF-8"]) from error
        assert self._root is not None  # expat refuses a file without an element
        return self._root

    def _start(self, tag: str, flat: list[str]) -> None:
        place = self._place()
        if len(self._open) >= MAX_DEPTH + _OUTER:
            raise self._error(f"nodes are nested more than {MAX_DEPTH} deep", place, ["<SubTree>"])
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise self._error(f"the file has more than {MAX_ELEMENTS} elements", place, ["<include>"])
        if len(flat) > 2 * MAX_PORTS:
            raise self._error(f"<{tag}> has more than {MAX_PORTS} attributes", place)
        for name, value in zip(flat[::2], flat[1::2], strict=True):
            if max(len(name), len(value)) > MAX_TEXT:
                raise self._error(f"an attribute of <{tag:.100}> has more than {MAX_TEXT} characters", place)
        self._attributes += len(flat) // 2
        if self._attributes > MAX_ATTRIBUTES:
            raise self._error(f"the file has more than {MAX_ATTRIBUTES} attributes", place, ["<include>"])
        element = Element(tag, dict(zip(flat[::2], flat[1::2], strict=True)), place)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.text = element.text.strip()

    def _characters(self, text: str) -> None:
        if self._open and not text.isspace():
            element = self._open[-1]
            element.text += text
            if len(element.text) > MAX_TEXT:
                problem = f"the text in <{element.tag:.100}> has more than {MAX_TEXT} characters"
                raise self._error(problem, element.position)

    def _refuse_doctype(self, *_: object) -> NoReturn:
        raise self._error(
            "a document type is not allowed: entities are not read", self._place(), ["plain XML"]
        )

    def _place(self) -> Position:
        return Position(self._parser.CurrentLineNumber, self._parser.CurrentColumnNumber + 1)

    def _error(self, problem: str, place: Position, valid: list[str] | None = None) -> ConfigError:
        return ConfigError(problem, file=self._path, line=place.line, column=place.column, valid=valid or ())
