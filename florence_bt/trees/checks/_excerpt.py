"""The offending line of a finding, with a mark under the offending text, as good compilers show it."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.source import NOT_UTF8, read_bytes, readable

MAX_WIDTH = 100
"""How many characters of a line are shown at most."""
_BEFORE = 60
"""How many characters before the offending text are shown when the line is longer."""

_LINE_BREAK = re.compile("\r\n|\r|\n")
_OFFENDING = re.compile(
    r"""
    "(?:[^"\\]|\\.)*" | '(?:[^']|'')*'     # in quotes, as a whole
    | \$\{[^{}]*\}                         # ${...}
    | \$?[A-Za-z_][A-Za-z0-9_.]*           # a name or $key
    | [<>=!]=?                             # an operator of an expression
    | (?:[^\s,:\]\[{}#]|:(?!\s|$)|\ (?=[A-Za-z°/]))+    # a number, perhaps with its unit after a space
    """,
    re.VERBOSE,
)
_QUOTED = re.compile("'([^'\n]+)'")


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A piece of a line.

    Attributes:
        line: The piece, without control characters.
        start: Where the offending text begins in it, 0-based.
        text: The offending text; empty when the place is behind the end of the line.
    """

    line: str
    start: int
    text: str


class Excerpts:
    """Knows the lines of the files that findings are about; reads each file once.

    Args:
        known: File -> its text, for those that are not on the disk (the standard input).
    """

    def __init__(self, known: Mapping[str, str] | None = None) -> None:
        self._lines = {file: _LINE_BREAK.split(text) for file, text in (known or {}).items()}

    def of(self, finding: Finding) -> Excerpt | None:
        """The offending line of a finding, None when the file has no such line or cannot be read."""
        lines = self._lines.get(finding.file)
        if lines is None:
            lines = self._lines[finding.file] = _lines_of(finding.file)
        if not 0 < finding.line <= len(lines) or not lines[finding.line - 1].strip():
            return None
        line, start = lines[finding.line - 1], finding.column - 1
        text = _offending(line, start, finding.message)
        first = max(0, start - _BEFORE) if len(line) > MAX_WIDTH else 0
        shown = line[first : first + MAX_WIDTH]
        head, tail = "…" * (first > 0), "…" * (first + MAX_WIDTH < len(line))
        printable = "".join(char if char.isprintable() else " " for char in shown)
        return Excerpt(f"{head}{printable}{tail}", start - first + len(head), text)


def marks_under(excerpt: Excerpt) -> str:
    """The carets under the offending text, as wide as it is in a terminal."""
    wide = width(excerpt.line[: excerpt.start])
    room = excerpt.line[excerpt.start : excerpt.start + len(excerpt.text)]
    return " " * wide + "^" * max(1, width(room))


def width(text: Iterable[str]) -> int:
    """How many columns of a terminal a text takes."""
    return sum(
        0 if unicodedata.combining(char) else 2 if unicodedata.east_asian_width(char) in "WF" else 1
        for char in text
    )


def _offending(line: str, start: int, message: str) -> str:
    """What of a line a message is about."""
    if NOT_UTF8 in message:
        return line[start : start + 1]  # one byte, whatever stands round it
    match = _OFFENDING.match(line, start)
    text = match[0].rstrip() if match else line[start : start + 1]
    # What the message itself quotes stands there as a whole, whatever signs are in it.
    told = [quoted for quoted in _QUOTED.findall(message) if line.startswith(quoted, start)]
    return max((text, *told), key=len)


def _lines_of(file: str) -> list[str]:
    try:
        text = readable(read_bytes(Path(file)))
    except ConfigError:
        text = None  # the finding itself says that the file cannot be read
    return _LINE_BREAK.split(text) if text is not None else []
