"""Expressions cut into tokens. Each knows where it stands in the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees.language.quantities import UNITS
from florence_bt.trees.language.source import Position

_UNIT = "|".join(
    re.escape(unit)
    for unit in sorted({u for units in UNITS.values() for u in units}, key=lambda u: (-len(u), u))
)
_TOKEN = re.compile(
    rf"""
    (?P<space>\s+)
  | (?P<quantity>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?:\s*(?:{_UNIT})(?!\w|/[^\W\d]|°))?)
  | (?P<key>\$(?:[a-z][a-z0-9_]*|\{{[a-z][a-z0-9_]*\}}))
  | (?P<text>"[^"]*"|'[^']*')
  | (?P<word>[^\W\d]\w*)
  | (?P<symbol><=(?!=)|>=(?!=)|==(?!=)|!=(?!=)|<(?![>=])|>(?!=)|[-+*/().,])
    """,
    re.VERBOSE,
)
_MEANT: Mapping[str, str] = {
    "===": "==",
    "<>": "!=",
    "=>": ">=",
    "=<": "<=",
    "&&": "and",
    "||": "or",
    "=": "==",
    "&": "and",
    "|": "or",
    "!": "not",
    "%": "a number between 0 and 1",
    "^": "a * a",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
    "×": "*",
    "·": "*",
    "÷": "/",
    "−": "-",
    "–": "-",
    "“": '"',
    "”": '"',
    "„": '"',
    "‘": "'",
    "’": "'",
    "{{": "$key, without braces",
}
"""Signs of other languages -> what is written here."""

_WORD = re.compile(r"\s*((?:[^\W\d]|°)\w*(?:/[^\W\d]\w*)?)")
_OPERATORS = ("and", "or", "<", "==", "+", "*")
_LONG = {
    "meter": "m",
    "meters": "m",
    "metre": "m",
    "metres": "m",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "minute": "min",
    "minutes": "min",
    "hour": "h",
    "hours": "h",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "kmh": "km/h",
    "mps": "m/s",
}
"""Units as people also write them -> the unit."""


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of an expression.

    Attributes:
        kind: ``quantity``, ``key``, ``text``, ``word``, ``symbol`` or ``end``.
        text: As written.
        position: Where it begins.
    """

    kind: str
    text: str
    position: Position


class Places:
    """Where the characters of a text stand in its file.

    Args:
        position: Where the text begins.
        exact: Whether the text stands there as it is, on one line; otherwise every character is said to stand
            at the beginning.
    """

    def __init__(self, position: Position, *, exact: bool = True) -> None:
        self._position = position
        self._exact = exact

    def at(self, offset: int) -> Position:
        """The place of a character, counted from 0."""
        if not self._exact:
            return self._position
        return Position(self._position.line, self._position.column + offset)


def cut(text: str, places: Places) -> list[Token]:
    """Cut an expression into tokens, with one of the kind ``end`` after the last.

    Raises:
        ConfigError: With the line and column of what is no part of an expression.
    """
    tokens: list[Token] = []
    offset = 0
    while offset < len(text):
        match = _TOKEN.match(text, offset)
        if match is None:
            raise _strange(text, offset, places.at(offset))
        if match.lastgroup == "quantity":
            _refuse_unit(text, match.end(), match[0], places)
        if match.lastgroup != "space":
            tokens.append(Token(str(match.lastgroup), match[0], places.at(offset)))
        offset = match.end()
    tokens.append(Token("end", "", places.at(len(text.rstrip()))))
    return tokens


def problem_at(position: Position, problem: str, *valid: str) -> ConfigError:
    """An error with a place."""
    return ConfigError(problem, line=position.line, column=position.column, valid=valid)


def _refuse_unit(text: str, end: int, number: str, places: Places) -> None:
    """A word right after a number can only be meant as a unit."""
    match = _WORD.match(text, end)
    if match is None or match[1] in ("and", "or"):
        return
    position = places.at(match.start(1))
    if not number[-1].isdigit() and number[-1] != ".":
        raise problem_at(position, f"{match[1]!r} cannot follow {number!r}", *_OPERATORS)
    units = [unit for known in UNITS.values() for unit in known]
    long = _LONG.get(match[1].lower())
    valid = (long,) if long else closest_first(match[1], units)
    raise problem_at(position, f"{match[1]!r} is no unit", *(f"{number} {unit}" for unit in valid))


def _strange(text: str, offset: int, position: Position) -> ConfigError:
    for sign, meant in _MEANT.items():
        if text.startswith(sign, offset):
            return problem_at(position, f"{sign!r} is not known here", meant)
    if text[offset] in "\"'":
        return problem_at(position, "the text has no end", f"a closing {text[offset]}")
    if text[offset] == "$":
        rest = re.match(r"\$\{?(\w*)", text[offset:])
        name = rest[1].lower() if rest else ""
        return problem_at(position, "a $ must stand before the name of a key", f"${name or 'key'}")
    if text[offset] in "[]{}":
        return problem_at(position, f"{text[offset]!r} has no place in an expression", "( and )")
    return problem_at(position, f"{text[offset]!r} has no place in an expression")
