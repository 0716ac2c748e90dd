"""What ``florence test -k`` means: words that must occur, with ``and``, ``or``, ``not`` and brackets."""

from __future__ import annotations

import re
from collections.abc import Callable

from florence_bt.core.errors import ConfigError

Chooser = Callable[[str], bool]

_TOKEN = re.compile(
    r"""\s*(?:(?P<mark>[()])|"(?P<text>[^"]*)"|'(?P<other>[^']*)'|(?P<word>[^\s()"'][^\s()]*))"""
)
"""A quote counts only where a word begins: ``robot's`` is a word."""
_OPERATORS = ("and", "or", "not")
_EXAMPLE = '"stop and not (kitchen or hall)"'


def keyword_filter(keyword: str) -> Chooser:
    """Which names a keyword chooses; in any case.

    Words without ``and`` or ``or`` between them are one piece of text. What stands in quotes is a text too,
    whatever it holds.

    Raises:
        ConfigError: It cannot be read.
    """
    tokens = _tokens(keyword)
    if not tokens:
        return lambda name: True
    parser = _Parser(keyword, tokens)
    chosen = parser.either()
    parser.expect_end()
    return lambda name: chosen(name.lower())


def _tokens(keyword: str) -> list[tuple[str, str]]:
    """Kind (``mark``, ``operator``, ``text``) and text of each part."""
    found: list[tuple[str, str]] = []
    at, text = 0, keyword.strip().lower()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise ConfigError(f"-k {keyword!r}: a quote has no partner", valid=[_EXAMPLE])
        at = match.end()
        if match["mark"]:
            found.append(("mark", match["mark"]))
        elif match["word"] in _OPERATORS:
            found.append(("operator", match["word"]))
        else:
            piece = next(part for part in (match["text"], match["other"], match["word"]) if part is not None)
            if match["word"] and found and found[-1][0] == "text":
                found[-1] = ("text", f"{found[-1][1]} {piece}")
            else:
                found.append(("text", piece))
    return found


class _Parser:
    def __init__(self, keyword: str, tokens: list[tuple[str, str]]) -> None:
        self._keyword = keyword
        self._tokens = [*tokens, ("end", "the end")]

    def either(self) -> Chooser:
        ways = [self._both()]
        while self._take("or"):
            ways.append(self._both())
        return lambda name: any(way(name) for way in ways)

    def expect_end(self) -> None:
        if self._tokens[0][0] != "end":
            self._refuse("'and' or 'or' is missing before")

    def _both(self) -> Chooser:
        conditions = [self._condition()]
        while self._take("and"):
            conditions.append(self._condition())
        return lambda name: all(condition(name) for condition in conditions)

    def _condition(self) -> Chooser:
        if self._take("not"):
            chosen = self._condition()
            return lambda name: not chosen(name)
        if self._take("("):
            inner = self.either()
            if not self._take(")"):
                self._refuse("a ')' is missing before")
            return inner
        kind, wanted = self._tokens[0]
        if kind != "text":
            self._refuse("a word is missing before")
        del self._tokens[0]
        return lambda name: wanted in name

    def _take(self, text: str) -> bool:
        kind, found = self._tokens[0]
        if kind in ("mark", "operator") and found == text:
            del self._tokens[0]
            return True
        return False

    def _refuse(self, problem: str) -> None:
        raise ConfigError(f"-k {self._keyword!r}: {problem} {self._tokens[0][1]!r}", valid=[_EXAMPLE])
