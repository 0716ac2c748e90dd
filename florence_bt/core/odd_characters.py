"""Characters that look like a space, like nothing or like a quote in an editor, and are none for YAML.

They come from word processors, web pages and chats. In quotes they are text like any other.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass

_SPACES = "\u00a0\u1680\u2000-\u200a\u202f\u205f\u3000"
_INVISIBLE = "\u00ad\u200b\u200e\u200f\u202a-\u202e\u2060-\u2064\u2066-\u2069"
"""Without the joiners U+200C and U+200D, which some scripts and emoji need."""
_ODD = re.compile(f"[{_SPACES}{_INVISIBLE}]")
_SPACE = re.compile(f"[{_SPACES}]")
_QUOTES = {
    "\u201c": "\u201c\u201d",  # English
    "\u201d": "\u201d",  # Swedish
    "\u201e": "\u201c\u201d",  # German, Polish
    "\u2018": "\u2018\u2019",
    "\u2019": "\u2019",
    "\u201a": "\u2018\u2019",
    "\u00ab": "\u00bb",  # French
    "\u00bb": "\u00ab",
}
"""Opening typographic quote -> what closes it."""
_BYTE_ORDER_MARK = "\ufeff"


@dataclass(frozen=True, slots=True)
class OddCharacter:
    """One such character.

    Attributes:
        index: Where it stands in its text.
        problem: What is wrong, in words.
        valid: What would have worked.
        instead: What was probably meant in its place.
    """

    index: int
    problem: str
    valid: tuple[str, ...]
    instead: str


def named(char: str) -> str:
    """Name a character for people: ``U+00A0 (no-break space)``."""
    name = "byte order mark" if char == _BYTE_ORDER_MARK else unicodedata.name(char, "").lower()
    return f"U+{ord(char):04X}" + (f" ({name})" if name else "")


def odd_characters(text: str) -> Iterator[OddCharacter]:
    """Yield the odd characters of an unquoted text in order; of typographic quotes only outer ones."""
    around = len(text) > 2 and text[-1] in _QUOTES.get(text[0], "") and '"' not in text
    if around:
        problem = f"the quote {named(text[0])} is none for YAML but part of the text"
        yield OddCharacter(0, problem, (f'"{text[1:-1]}"',), '"')
    else:
        for match in _ODD.finditer(text):
            yield _odd(match)
    if around:
        yield OddCharacter(len(text) - 1, "", (), '"')


def needs_quotes(text: str) -> bool:
    """Tell whether a text needs quotes in a file, because it has odd characters that are meant."""
    return any(odd_characters(text))


def _odd(match: re.Match[str]) -> OddCharacter:
    name = named(match[0])
    if _SPACE.match(match[0]):
        problem, valid = f"{name} looks like a space and is none outside quotes", "a plain space"
        return OddCharacter(match.start(), problem, (valid, "quotes round the text, if it is meant"), " ")
    problem = f"{name} cannot be seen and is not allowed outside quotes"
    return OddCharacter(match.start(), problem, ("the text without it",), "")
