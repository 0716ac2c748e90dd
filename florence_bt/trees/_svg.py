"""Diagrams as SVG: the root on the left, leaves stacked on the right, parents beside their children.

Widths are estimated from the number of characters, so no font has to be measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape

from florence_bt.trees.diagram import Box

_TITLE_CHAR = 8.3
_DETAIL_CHAR = 6.1
_LINE = 15.0
_PAD = 9.0
_GAP_X = 44.0
_GAP_Y = 12.0
_MARGIN = 20.0
_MAX_CHARS = 46

_COLOURS = {
    "sequence": ("#e8eef7", "#4a6fa5"),
    "selector": ("#fdf3dc", "#b8860b"),
    "parallel": ("#ece6f5", "#7253a6"),
    "skill": ("#e5f3e8", "#3c8a4e"),
    "run": ("#dff1f3", "#2b7f8a"),
    "fail": ("#fbe4e2", "#b03a2e"),
}
_OTHER = ("#f3f3f3", "#707070")


@dataclass
class _Placed:
    """A box with its place; x and y of the upper left corner."""

    box: Box
    lines: list[str]
    width: float
    height: float
    x: float = 0.0
    y: float = 0.0
    below: list[_Placed] = field(default_factory=list)

    def walk(self) -> Iterator[_Placed]:
        yield self
        for child in self.below:
            yield from child.walk()

    def shift(self, by: float) -> None:
        for placed in self.walk():
            placed.y += by


def diagram_svg(root: Box) -> str:
    """An SVG picture of a diagram."""
    placed = _measure(root)
    _set_columns(placed)
    _set_rows(placed, _MARGIN)
    everything = list(placed.walk())
    width = max(p.x + p.width for p in everything) + _MARGIN
    height = max(p.y + p.height for p in everything) + _MARGIN
    body = [_edge(p, child) for p in everything for child in p.below] + [_node(p) for p in everything]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="DejaVu Sans, Verdana, sans-serif">',
            f"<title>{escape(root.title)}</title>",
            '<rect width="100%" height="100%" fill="#ffffff"/>',
            *body,
            "</svg>",
            "",
        ]
    )


def _measure(box: Box) -> _Placed:
    lines = [line for detail in box.details for line in _wrap(detail)]
    title = max(len(box.title), 6) * _TITLE_CHAR
    kind = len(_head(box)) * _DETAIL_CHAR
    width = max([title, kind, *(len(line) * _DETAIL_CHAR for line in lines)]) + 2 * _PAD
    height = (2 + len(lines)) * _LINE + _PAD
    return _Placed(box, lines, width, height, below=[_measure(child) for child in box.below])


def _wrap(text: str) -> list[str]:
    """Break a long detail at spaces."""
    lines, line = [], ""
    for word in text.split(" "):
        if line and len(line) + 1 + len(word) > _MAX_CHARS:
            lines.append(line)
            line = "  " + word
        else:
            line = f"{line} {word}" if line else word
    return [*lines, line]


def _set_columns(root: _Placed) -> None:
    """Every depth is a column, as wide as its widest box."""
    x, column = _MARGIN, [root]
    while column:
        for placed in column:
            placed.x = x
        x += max(placed.width for placed in column) + _GAP_X
        column = [child for placed in column for child in placed.below]


def _set_rows(placed: _Placed, top: float) -> float:
    """Stack the leaves from ``top`` down; returns where the next one may begin."""
    if not placed.below:
        placed.y = top
        return top + placed.height + _GAP_Y
    next_top = top
    for child in placed.below:
        next_top = _set_rows(child, next_top)
    first, last = placed.below[0], placed.below[-1]
    placed.y = (first.y + first.height / 2 + last.y + last.height / 2 - placed.height) / 2
    if placed.y < top:
        # The box is taller than its children together: they move down beside its middle.
        for child in placed.below:
            child.shift(top - placed.y)
        next_top += top - placed.y
        placed.y = top
    return max(next_top, placed.y + placed.height + _GAP_Y)


def _edge(parent: _Placed, child: _Placed) -> str:
    x1, y1 = parent.x + parent.width, parent.y + parent.height / 2
    x2, y2 = child.x, child.y + child.height / 2
    middle = x2 - _GAP_X / 2
    dashed = ' stroke-dasharray="5 4"' if child.box.edge else ""
    way = f"M{x1:.1f} {y1:.1f} H{middle:.1f} V{y2:.1f} H{x2:.1f}"
    return f'<path d="{way}" fill="none" stroke="#8a8a8a"{dashed}/>'


def _node(placed: _Placed) -> str:
    fill, stroke = _COLOURS.get(placed.box.kind, _OTHER)
    radius = 3 if placed.box.below else 10
    x, y = placed.x + _PAD, placed.y
    parts = [
        f'<rect x="{placed.x:.1f}" y="{y:.1f}" width="{placed.width:.1f}" height="{placed.height:.1f}" '
        f'rx="{radius}" fill="{fill}" stroke="{stroke}"/>',
        f'<text x="{x:.1f}" y="{y + 14:.1f}" font-size="9" fill="{stroke}">{_head(placed.box)}</text>',
        f'<text x="{x:.1f}" y="{y + 29:.1f}" font-size="12" font-weight="bold" fill="#202020">'
        f"{escape(placed.box.title)}</text>",
    ]
    for index, line in enumerate(placed.lines):
        parts.append(
            f'<text x="{x:.1f}" y="{y + 29 + (index + 1) * _LINE:.1f}" font-size="10" fill="#404040" '
            f'xml:space="preserve">{escape(line)}</text>'
        )
    return "\n".join(parts)


def _head(box: Box) -> str:
    """The small word on top of a box."""
    return f"{box.edge}: {box.kind}" if box.edge else box.kind
