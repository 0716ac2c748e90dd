"""Finds texts with commas that fell apart because they stand between { and } without quotes.

``{say: hello, you}`` is for YAML a table with two keys, ``say`` and ``you``; the second has no colon.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from florence_bt.core._flow_hints import quoted
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar

_DECIMAL = re.compile(r"-?\d+,\d+(?: ?[a-z/°%]+)?")
"""A number with a decimal comma, perhaps with a unit."""


@dataclass(frozen=True, slots=True)
class UnquotedComma:
    """A text that fell apart.

    Attributes:
        key: The key that it belongs to.
        first: Its first piece, the value of the key.
        pieces: The further pieces, which became keys.
    """

    key: YamlScalar
    first: YamlScalar
    pieces: tuple[YamlScalar, ...]

    @property
    def whole(self) -> str:
        """The whole text."""
        return ", ".join(piece.text for piece in (self.first, *self.pieces))

    @property
    def valid(self) -> str:
        """The entry as it would have worked; ``1,5 s`` is a number with a comma."""
        pieces = [piece.text for piece in (self.first, *self.pieces)]
        if _DECIMAL.fullmatch(",".join(pieces)):
            return f"{self.key.text}: {'.'.join(pieces)}"
        return f"{self.key.text}: {quoted(self.whole)}"


def unquoted_commas(table: YamlMapping) -> Iterator[UnquotedComma]:
    """Yield the texts of a table that fell apart, in the order of the file.

    A key without a colon behind a text in quotes, behind a list or at the beginning is none.
    """
    begun: tuple[YamlScalar, YamlScalar] | None = None
    pieces: list[YamlScalar] = []
    for key, value in table.entries:
        if begun is not None and _without_colon(key, value):
            pieces.append(key)
            continue
        if begun is not None and pieces:
            yield UnquotedComma(*begun, tuple(pieces))
        pieces = []
        whole = isinstance(value, YamlScalar) and not value.quoted and not value.empty
        begun = (key, value) if whole and isinstance(value, YamlScalar) else None
    if begun is not None and pieces:
        yield UnquotedComma(*begun, tuple(pieces))


def _without_colon(key: YamlScalar, value: YamlNode) -> bool:
    """Tell whether a key stands in a table without the colon, so that its empty value begins at its end."""
    if key.quoted or not isinstance(value, YamlScalar) or value.quoted or value.text:
        return False
    end = key.position.column + len(key.text)
    return value.position.line == key.position.line and value.position.column == end
