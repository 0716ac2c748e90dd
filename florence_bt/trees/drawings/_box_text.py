"""The lines of text in a box of a diagram, and how wide they are.

Widths are taken from a table of the font's characters, so that no font has to be loaded.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

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
    """The estimated width of a text in pixels."""
    return size * sum(_WIDTH_OF.get(char, 0.7 if ord(char) < 0x2E80 else 1.0) for char in text)


def box_lines(box: Box) -> list[TextLine]:
    """The lines of a box from top to bottom."""
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
    """The small words on top: the way from the box above, and the kind where the title does not say it."""
    in_title = box.kind == "skill" or box.title.lower().startswith(box.kind)
    return " · ".join(word for word in (box.edge, "" if in_title else box.kind) if word)


def _broken(text: str) -> list[str]:
    return textwrap.wrap(text, MAX_CHARS, break_on_hyphens=False)
