"""The text of a YAML file as pieces that can be left out, swapped and replaced; the rest stays as it was."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import yaml

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_TO_END_OF_LINE = re.compile(r"[^\n]*\n?")
_COMMA_BEHIND = re.compile(r"\s*,\s*")


@dataclass(frozen=True, slots=True)
class Piece:
    """A value in the text: a scalar, a list or a mapping.

    Attributes:
        start: Where it begins, in characters from the start of the text.
        end: Where it ends; of a block the end of the last thing in it.
        column: The column where it begins, from 0.
        line: The line where it begins, from 1.
        text: The text of a scalar, without quotes; None of a list or mapping.
        items: The items of a list.
        entries: The keys and values of a mapping.
        flow: Whether it stands in brackets or braces.
        plain: Whether it is a scalar without quotes.
    """

    start: int
    end: int
    column: int
    line: int
    text: str | None = None
    items: tuple[Piece, ...] = ()
    entries: tuple[tuple[Piece, Piece], ...] = ()
    flow: bool = False
    plain: bool = False

    def get(self, key: str) -> Piece | None:
        """Return the value of a key of a mapping, None when it is not there."""
        return next((value for name, value in self.entries if name.text == key), None)


class SourceText:
    """A YAML text that was read, and the changes that can be made of it; each makes a new text.

    Args:
        text: The text, which can be read.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.root = self._piece(yaml.compose(text, Loader=_LOADER))

    def _piece(self, node: Any) -> Piece:
        start = node.start_mark
        place = (start.index, node.end_mark.index, start.column, start.line + 1)
        if isinstance(node, yaml.ScalarNode):
            written = self.text[place[0] : place[1]]
            end = place[0] + len(written.rstrip()) if written.strip() else place[0]
            return Piece(place[0], end, *place[2:], text=node.value, plain=not node.style)
        flow = bool(node.flow_style)
        if isinstance(node, yaml.SequenceNode):
            items = tuple(map(self._piece, node.value))
            end = place[1] if flow or not items else items[-1].end
            return Piece(place[0], end, *place[2:], items=items, flow=flow)
        entries = tuple((self._piece(key), self._piece(value)) for key, value in node.value)
        end = place[1] if flow or not entries else max(entries[-1][1].end, entries[-1][0].end + 1)
        return Piece(place[0], end, *place[2:], entries=entries, flow=flow)

    def replaced(self, piece: Piece, new: str) -> str:
        """Write something else in the place of a piece."""
        return self._cut(piece.start, piece.end, new)

    def swapped(self, first: Piece, second: Piece) -> str:
        """Exchange two pieces, the first of which stands further up."""
        text = self.text
        between = text[first.end : second.start]
        new = text[second.start : second.end] + between + text[first.start : first.end]
        return self._cut(first.start, second.end, new)

    def without_entry(self, mapping: Piece, number: int) -> str | None:
        """Leave out an entry of a mapping.

        Returns:
            The text; None where a comment would have to go that is about something else.
        """
        key, value = mapping.entries[number]
        end = max(value.end, key.end + 1)
        if mapping.flow:
            return self._without_part(key.start, end)
        line = self.text.rfind("\n", 0, key.start) + 1
        if not self.text[line : key.start].strip():
            return self._cut(line, self._line_end(end), "")
        if number + 1 == len(mapping.entries):
            return None
        following = mapping.entries[number + 1][0].start
        return None if "#" in self.text[end:following] else self._cut(key.start, following, "")

    def without_item(self, parent: Piece, number: int) -> str | None:
        """Leave out an item of a list in brackets; None for another list."""
        item = parent.items[number]
        return self._without_part(item.start, item.end) if parent.flow else None

    def unwrapped(self, outer: Piece, inner: Piece) -> str:
        """Write a piece that stands in another one in its place, indented as that was."""
        indent = inner.column - outer.column
        first, *rest = self.text[inner.start : inner.end].split("\n")
        lines = [first, *(line[indent:] if not line[:indent].strip() else line for line in rest)]
        return self._cut(outer.start, outer.end, "\n".join(lines))

    def _without_part(self, start: int, end: int) -> str:
        """Leave out a part of a list or mapping in brackets, with one comma."""
        behind = _COMMA_BEHIND.match(self.text, end)
        if behind is not None:
            return self._cut(start, behind.end(), "")
        before = self.text[:start].rstrip()
        return self._cut(len(before) - 1 if before.endswith(",") else start, end, "")

    def _line_end(self, index: int) -> int:
        match = _TO_END_OF_LINE.match(self.text, index)
        return match.end() if match is not None else index

    def _cut(self, start: int, end: int, new: str) -> str:
        return self.text[:start] + new + self.text[end:]
