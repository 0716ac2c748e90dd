"""Diagrams as SVG: boxes in colours for their kinds, a line from each to those below it, and a legend.

Widths of texts are taken from a table of the font's characters, so that no font has to be loaded.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape

from florence_bt.trees.drawings._layout import DROP, INDENT, PlacedBox, lay_out
from florence_bt.trees.drawings.diagram import Box

FONT = "DejaVu Sans, Verdana, sans-serif"
TITLE, LABEL, LINE = 13.0, 10.5, 11.5
"""Sizes of the texts in pixels: titles, kinds, further lines."""
MAX_CHARS = 34
"""Longest line before it is broken."""
MAX_LINES = 12
"""Most lines of one box."""

_WIDTHS = (
    ("iljI.,:;|!'`", 0.32),
    ('ftr()[]{}/\\- "', 0.40),
    ("abcdeghknopqsuvxyz0123456789_$#?*", 0.63),
    ("ABCDEFGHJKLNOPQRSTUVXYZ&", 0.73),
    ("+<>=~^", 0.84),
    ("mwMW@%", 0.99),
)
_WIDTH_OF = {char: width for chars, width in _WIDTHS for char in chars}
_BOLD = 1.12
"""Width of bold letters by that of plain ones. Chosen."""


@dataclass(frozen=True, slots=True)
class TextLine:
    """A line in a box.

    Attributes:
        text: The line.
        size: Of the font, in pixels.
        role: ``label``, ``title``, ``guard``, ``detail`` or ``because``.
    """

    text: str
    size: float
    role: str

    @property
    def width(self) -> float:
        """The estimated width in pixels."""
        return text_width(self.text, self.size) * (_BOLD if self.role == "title" else 1.0)

    @property
    def height(self) -> float:
        """The height of the line in pixels."""
        return self.size * 1.32


def text_width(text: str, size: float) -> float:
    """Return the estimated width of a text in pixels."""
    return size * sum(_WIDTH_OF.get(char, 0.7 if ord(char) < 0x2E80 else 1.0) for char in text)


def box_lines(box: Box) -> list[TextLine]:
    """Return the lines of a box from top to bottom."""
    label = _label(box)
    lines = [TextLine(label, LABEL, "label")] if label else []
    lines += [TextLine(line, TITLE, "title") for line in _broken(box.title)]
    for role, texts in (("guard", box.guards), ("detail", box.details)):
        lines += [TextLine(line, LINE, role) for text in texts for line in _broken(text)]
    lines += [TextLine(line, LINE, "because") for text in box.because for line in _broken(f"“{text}”")]
    if len(lines) > MAX_LINES:
        more = len(lines) - MAX_LINES + 1
        lines = [*lines[: MAX_LINES - 1], TextLine(f"… {more} more lines", LINE, "detail")]
    return lines


def _label(box: Box) -> str:
    """Return the words on top: the way from the box above, and the kind if the title does not say it."""
    in_title = box.kind == "skill" or box.title.lower().startswith(box.kind)
    return " · ".join(word for word in (box.edge, "" if in_title else box.kind) if word)


def _broken(text: str) -> list[str]:
    return textwrap.wrap(text, MAX_CHARS, break_on_hyphens=False)


MAX_PIXELS = 1600
"""Widest a picture is, in pixels, when that is possible."""
SHAPE = 1.5
"""Width divided by height that is aimed at."""

_PAD_X, _PAD_Y = 9.0, 6.0
_MARGIN = 18.0
_MIN_WIDTH = 60.0
_LEGEND = 26.0
"""Pixels of a box's inside, of the margin, of a box's least width and of the legend. Chosen."""

COLOURS = {
    "sequence": ("#e3ebf7", "#2f5d9b"),
    "selector": ("#fdf0d0", "#94690a"),
    "parallel": ("#ece2f7", "#6a45a3"),
    "skill": ("#e0f2e4", "#2c7a40"),
    "run": ("#d8eff2", "#1f6f7a"),
    "fail": ("#fbe0dd", "#a83226"),
    "if": ("#fbe6f0", "#a33a72"),
    "switch": ("#fbe6f0", "#a33a72"),
    "condition": ("#fbe6f0", "#a33a72"),
}
"""Kind -> colours of the inside, and of the edge and the small words."""
OTHER = ("#efefef", "#5c5c5c")
_MEANING = {
    "sequence": "one after the other",
    "selector": "until one succeeds",
    "parallel": "at the same time",
    "skill": "skill",
    "run": "another mission",
    "fail": "fails",
    "if": "depends",
}
_INKS = {"guard": "#8a4b00", "because": "#555555", "detail": "#333333", "title": "#101010"}


@dataclass(frozen=True)
class _Drawn:
    """A box with its lines and its place."""

    box: Box
    lines: list[TextLine]
    item: PlacedBox
    below: list[_Drawn]

    def walk(self) -> Iterator[_Drawn]:
        yield self
        for child in self.below:
            yield from child.walk()


def diagram_svg(root: Box, max_width: float = MAX_PIXELS) -> str:
    """Draw an SVG picture of a diagram.

    Args:
        root: The diagram.
        max_width: Widest the picture may be, in pixels, if that is possible at all.
    """
    drawn = _measure(root)
    width, height = lay_out(drawn.item, max_width - 2 * _MARGIN, SHAPE)
    legend = list(_legend(root))
    width = max(width, sum(part for _, _, part in legend)) + 2 * _MARGIN
    height += 2 * _MARGIN + _LEGEND
    everything = list(drawn.walk())
    body = [
        f'<g transform="translate({_MARGIN:g} {_MARGIN:g})">',
        *(_line(parent, child) for parent in everything for child in parent.below),
        *(_box(each) for each in everything),
        "</g>",
        '<g class="legend">',
        *_drawn_legend(legend, height - _MARGIN / 2),
        "</g>",
    ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="{FONT}">',
            f"<title>{escape(root.title)}</title>",
            '<rect width="100%" height="100%" fill="#ffffff"/>',
            *body,
            "</svg>",
            "",
        ]
    )


def _measure(box: Box) -> _Drawn:
    lines, below = box_lines(box), [_measure(child) for child in box.below]
    width = max(_MIN_WIDTH, *(line.width for line in lines)) + 2 * _PAD_X
    height = sum(line.height for line in lines) + 2 * _PAD_Y
    return _Drawn(box, lines, PlacedBox(width, height, [child.item for child in below]), below)


def _line(parent: _Drawn, child: _Drawn) -> str:
    above, item = parent.item, child.item
    if not above.rows:
        x, y = above.x + INDENT / 2, above.y + above.height
        way = f"M{x:.1f} {y:.1f} V{item.y + item.height / 2:.1f} H{item.x:.1f}"
    else:
        x = above.x + (above.width / 2 if len(above.rows) == 1 else INDENT / 2)
        y, across = above.y + above.height, item.x + item.width / 2
        way = f"M{x:.1f} {y:.1f} V{item.y - DROP / 2:.1f} H{across:.1f} V{item.y:.1f}"
    dashed = ' stroke-dasharray="5 4"' if child.box.edge == "finally" else ""
    return f'<path d="{way}" fill="none" stroke="#9a9a9a" stroke-width="1.3"{dashed}/>'


def _box(drawn: _Drawn) -> str:
    box, item = drawn.box, drawn.item
    fill, stroke = COLOURS.get(box.kind, OTHER)
    radius = 11 if not box.below else 3
    dashed = ' stroke-dasharray="5 4"' if box.edge == "finally" else ""
    thick = 2.2 if box.kind == "run" else 1.3
    parts = [
        f'<rect x="{item.x:.1f}" y="{item.y:.1f}" width="{item.width:.1f}" height="{item.height:.1f}" '
        f'rx="{radius}" fill="{fill}" stroke="{stroke}" stroke-width="{thick}"{dashed}/>'
    ]
    y = item.y + _PAD_Y
    for line in drawn.lines:
        y += line.height
        ink = stroke if line.role == "label" else _INKS[line.role]
        style = {"title": ' font-weight="bold"', "because": ' font-style="italic"'}.get(line.role, "")
        parts.append(
            f'<text x="{item.x + _PAD_X:.1f}" y="{y - line.size * 0.28:.1f}" font-size="{line.size:g}" '
            f'fill="{ink}"{style}>{escape(line.text)}</text>'
        )
    return "\n".join(parts)


def _legend(root: Box) -> Iterator[tuple[str, str, float]]:
    """Yield the kinds that appear, what they mean, and how much room each takes."""
    kinds = {"if" if box.kind in ("switch", "condition") else box.kind for box in root.walk()}
    for kind, meaning in _MEANING.items():
        if kind in kinds:
            yield kind, meaning, 40 + text_width(meaning, LABEL)


def _drawn_legend(legend: list[tuple[str, str, float]], y: float) -> Iterator[str]:
    x = _MARGIN
    for kind, meaning, room in legend:
        fill, stroke = COLOURS[kind]
        size = f'width="16" height="11" rx="3" fill="{fill}" stroke="{stroke}"'
        yield f'<rect x="{x:.1f}" y="{y - 11:.1f}" {size}/>'
        place = f'x="{x + 21:.1f}" y="{y - 1.5:.1f}" font-size="{LABEL:g}"'
        yield f'<text {place} fill="#555555">{meaning}</text>'
        x += room
