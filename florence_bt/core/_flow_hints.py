"""Hints for texts between { and }, or [ and ], where a colon, a comma or a # ends them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

_KEY = re.compile(r"\s*(?P<key>[^\s:,\[\]{}\"'][^:,\[\]{}\"']*):\s+")
_NEXT_ENTRY = re.compile(r",\s*[a-z_][a-z0-9_]*:(?:\s|$)")
_LAST_WORD = re.compile(r"(?:^|\s)(?P<word>[a-z_][a-z0-9_]*)$")
_NO_TEXT = re.compile(r"[-+\d$\[{\"']|(?:true|false)\s*$")
"""The beginning of another value than a text."""
_ONE_NAME = re.compile(r"[a-z][a-z0-9_]*\s*")
_CLOSING = {"{": "}", "[": "]"}


@dataclass(frozen=True, slots=True)
class FlowHint:
    """A problem in plain words.

    Attributes:
        problem: What is wrong.
        valid: What would have worked.
        line: Where, 1-based.
        column: Likewise.
    """

    problem: str
    valid: tuple[str, ...]
    line: int
    column: int


def explain_flow(
    lines: list[str], begun: int, line: int, column: int, beside: Collection[str]
) -> FlowHint | None:
    """Say which text between brackets needs quotes.

    Args:
        lines: The lines of the file.
        begun: The line of the bracket that the YAML library sees open.
        line: Where it gave up, 1-based.
        column: Likewise.
        beside: Keys that stand beside others; one of them in a text probably lacks its comma.

    Returns:
        The hint; None when something else is wrong.
    """
    for number in range(begun, min(line, len(lines)) + 1):
        sign = _swallowing_comment(lines[number - 1])
        if sign is not None:
            problem = "text with # needs quotes, because a comment begins with #"
            return FlowHint(problem, (_without_comments(lines[number - 1]),), number, sign + 1)
    if line > len(lines):
        return None
    text, index = lines[line - 1], column - 1
    entry = _Entry.at(text, index)
    if entry is None or index < entry.start:
        return None
    before = text[entry.start : index].rstrip()
    if text[index : index + 1] == ":" and before:
        return FlowHint(*_colon(entry, before, beside), line, column)
    if len(before) > 1 and before[0] in "\"'" and before.endswith(before[0]):
        return FlowHint("the text goes on after its closing quote", (entry.in_quotes(),), line, column)
    if before.startswith("$") and text.startswith("[", index):
        return FlowHint("an item of a list stands in ${ } here", (entry.computed(),), line, column)
    first = text[entry.start : entry.start + 1]
    if (first in tuple("!*&") and before) or (first in tuple("@`%|>") and not before):
        problem = f"text that begins with {first} needs quotes"
        return FlowHint(problem, (entry.in_quotes(),), line, entry.start + 1)
    if text.startswith("- ", index) and not before:
        return FlowHint("between [ and ] a list has no dashes", ("[kitchen, hall]",), line, column)
    return None


def _without_comments(line: str) -> str:
    """Put quotes round every text in which a comment begins."""
    for _ in range(line.count("#")):
        sign = _swallowing_comment(line)
        entry = _Entry.at(line, sign) if sign is not None else None
        line = entry.in_quotes() if entry is not None else line
    return line.strip()


def _colon(entry: _Entry, before: str, beside: Collection[str]) -> tuple[str, tuple[str, ...]]:
    """Explain a text with a colon, or a missing comma before the next key."""
    last = _LAST_WORD.search(before)
    value = before[: last.start()] if last is not None else ""
    if last is None or not value:
        return "text with a colon needs quotes", (entry.in_quotes(),)
    with_comma = entry.with_comma_after(len(value))
    if last["word"] in beside or _NO_TEXT.match(value):
        return f"a comma is missing before {last['word']!r}", (with_comma,)
    if not _ONE_NAME.fullmatch(value):
        return "text with a colon needs quotes", (entry.in_quotes(),)
    return "text with a colon needs quotes, or a comma is missing", (entry.in_quotes(), with_comma)


@dataclass(frozen=True, slots=True)
class _Entry:
    """The value of an entry between brackets, in its line.

    Attributes:
        line: The line.
        start: Where the value begins, 0-based.
        end: Where it ends.
    """

    line: str
    start: int
    end: int

    @classmethod
    def at(cls, line: str, index: int) -> _Entry | None:
        """Return the innermost entry round a place; None when it is outside brackets."""
        opened: list[int] = []
        for place, sign in _signs(line[:index]):
            if sign in _CLOSING:
                opened.append(place + 1)
            elif sign in "]}" and opened:
                opened.pop()
            elif sign == "," and opened:
                opened[-1] = place + 1
        if not opened:
            return None
        key = _KEY.match(line, opened[-1])
        start = key.end() if key is not None else opened[-1]
        start += len(line[start:]) - len(line[start:].lstrip(" "))
        return cls(line, start, _end_of_value(line, start, item=key is None))

    def in_quotes(self) -> str:
        """Return the line with the value in quotes."""
        return f"{self.line[: self.start].lstrip()}{quoted(self._value)}{self.line[self.end :].rstrip()}"

    def computed(self) -> str:
        """Return the line with the value as an expression in quotes."""
        inside = quoted(f"${{{self._value}}}")
        return f"{self.line[: self.start].lstrip()}{inside}{self.line[self.end :].rstrip()}"

    def with_comma_after(self, length: int) -> str:
        """Return the line with a comma after so many characters of the value."""
        place = self.start + length
        return f"{self.line[:place].rstrip().lstrip()}, {self.line[place:].strip()}"

    @property
    def _value(self) -> str:
        return self.line[self.start : self.end].strip()


def quoted(value: str) -> str:
    """Put a text in the quotes of YAML that need nothing changed inside, if there are any."""
    value = _bare(value.strip())
    if '"' not in value and "\\" not in value:
        return f'"{value}"'
    return "'" + value.replace("'", "''") + "'"


def _bare(value: str) -> str:
    """Take off quotes that end too soon, also typographic ones, and those of ``""Hello""``."""
    sign = value[:1]
    if sign in ("'", '"') and value.endswith(sign) and len(value) > 1:
        inside = value[1:-1]
        if inside.count(sign) % 2 or (inside.startswith(sign) and inside.endswith(sign)):
            return inside.strip(sign)
    if value[:1] in ("\N{LEFT DOUBLE QUOTATION MARK}", "\N{DOUBLE LOW-9 QUOTATION MARK}"):
        return value[1:].rstrip("\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}")
    return value


def _signs(text: str) -> Iterator[tuple[int, str]]:
    """Yield the signs of YAML with their places, without what stands in quotes."""
    quote, begins = "", True
    for index, sign in enumerate(text):
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'" and begins:
            quote = sign
        else:
            yield index, sign
        begins = sign in "{[,:" or (begins and sign == " ")


def _end_of_value(line: str, start: int, *, item: bool) -> int:
    """Return where a value ends: at the next entry, or before the bracket that closes the table or list."""
    depth = 0
    for place, sign in _signs(line[start:]):
        if sign in _CLOSING:
            depth += 1
        elif sign in "]}":
            if depth == 0:
                return start + place
            depth -= 1
        elif (depth == 0 and item and sign == ",") or (depth == 0 and _NEXT_ENTRY.match(line, start + place)):
            return start + place
    return len(line.rstrip())


def _swallowing_comment(line: str) -> int | None:
    """Return where a comment begins that takes the closing bracket with it."""
    opened, before = 0, ""
    for place, sign in _signs(line):
        if sign == "#" and before in (" ", "\t") and opened > 0:
            return place if any(closing in line[place:] for closing in "]}") else None
        opened += (sign in _CLOSING) - (sign in ("]", "}"))
        before = sign
    return None
