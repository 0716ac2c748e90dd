"""Layout of a diagram's boxes: below each other as in an outline, or side by side in one or more rows.

For each box all combinations of width and height are kept that no other combination beats. Of those of the
root the one is taken that is not too wide and comes closest to the shape of a page.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

INDENT = 26.0
"""Distance by which children are moved to the right in an outline."""
GAP_X = 18.0
"""Space between boxes side by side."""
GAP_Y = 10.0
"""Space between boxes below each other."""
DROP = 30.0
"""Space between a box and its children side by side, for the lines."""
MAX_ROWS = 6
"""Most rows that children side by side are broken into."""
MAX_CHOICES = 24
"""Combinations of width and height that are kept for a box."""


@dataclass(eq=False)
class PlacedBox:
    """A box to be placed.

    Attributes:
        width: Of the box itself.
        height: Of the box itself.
        children: The boxes below.
        x: Left edge, once placed.
        y: Upper edge, once placed.
        rows: Its children in rows; empty when they stand below each other.
    """

    width: float
    height: float
    children: list[PlacedBox] = field(default_factory=list)
    x: float = 0.0
    y: float = 0.0
    rows: list[list[PlacedBox]] = field(default_factory=list)

    def walk(self) -> Iterator[PlacedBox]:
        """Yield this item and every item below."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, slots=True)
class _Choice:
    """One way to lay out a box with everything below it."""

    width: float
    height: float
    below: tuple[_Choice, ...] = ()
    rows: tuple[int, ...] = ()
    """Number of children in each row; empty when they stand below each other."""


def lay_out(root: PlacedBox, max_width: float, shape: float) -> tuple[float, float]:
    """Place all items.

    Args:
        root: The root; it and all items below get their places.
        max_width: Widest the whole may be, if that is possible at all.
        shape: Width divided by height that is aimed at.

    Returns:
        The width and height of the whole.
    """
    choices = _choices(root)
    fitting = [choice for choice in choices if choice.width <= max_width] or [
        min(choices, key=lambda c: c.width)
    ]
    best = min(fitting, key=lambda choice: max(choice.width / shape, choice.height))
    _place(root, best, 0.0, 0.0)
    return best.width, best.height


def _choices(item: PlacedBox) -> list[_Choice]:
    if not item.children:
        return [_Choice(item.width, item.height)]
    below = [_choices(child) for child in item.children]
    found = list(_stacked(item, below))
    if len(item.children) > 1:
        found += _in_rows(item, below)
    return _best(found)


def _stacked(item: PlacedBox, below: Sequence[list[_Choice]]) -> Iterator[_Choice]:
    for limit in sorted({choice.width for choices in below for choice in choices}):
        picked = [_lowest(choices, limit) for choices in below]
        kept = tuple(choice for choice in picked if choice is not None)
        if len(kept) == len(below):
            width = max(item.width, INDENT + max(choice.width for choice in kept))
            height = item.height + sum(GAP_Y + choice.height for choice in kept)
            yield _Choice(width, height, kept)


def _in_rows(item: PlacedBox, below: Sequence[list[_Choice]]) -> Iterator[_Choice]:
    for limit in sorted({choice.height for choices in below for choice in choices}):
        picked = [_narrowest(choices, limit) for choices in below]
        kept = tuple(choice for choice in picked if choice is not None)
        if len(kept) < len(below):
            continue
        total = sum(choice.width for choice in kept) + GAP_X * (len(kept) - 1)
        for rows in range(1, min(MAX_ROWS, len(kept)) + 1):
            yield _broken(item, kept, max(total / rows, *(choice.width for choice in kept)))


def _broken(item: PlacedBox, kept: tuple[_Choice, ...], width: float) -> _Choice:
    """Put children in rows that are not wider than so much."""
    rows: list[list[_Choice]] = [[]]
    for choice in kept:
        if rows[-1] and _row_width(rows[-1]) + GAP_X + choice.width > width:
            rows.append([])
        rows[-1].append(choice)
    indent = INDENT if len(rows) > 1 else 0.0
    wide = max(item.width, indent + max(_row_width(row) for row in rows))
    high = item.height + sum(DROP + max(choice.height for choice in row) for row in rows)
    return _Choice(wide, high, kept, tuple(len(row) for row in rows))


def _row_width(row: Sequence[_Choice]) -> float:
    return sum(choice.width for choice in row) + GAP_X * (len(row) - 1)


def _lowest(choices: list[_Choice], width: float) -> _Choice | None:
    return min((c for c in choices if c.width <= width), key=lambda c: c.height, default=None)


def _narrowest(choices: list[_Choice], height: float) -> _Choice | None:
    return min((c for c in choices if c.height <= height), key=lambda c: c.width, default=None)


def _best(choices: list[_Choice]) -> list[_Choice]:
    """Return those that no other beats in width and height, the narrowest first; not more than this many."""
    kept: list[_Choice] = []
    for choice in sorted(choices, key=lambda c: (c.width, c.height)):
        if not kept or choice.height < kept[-1].height:
            kept.append(choice)
    if len(kept) <= MAX_CHOICES:
        return kept
    step = (len(kept) - 1) / (MAX_CHOICES - 1)
    return [kept[round(index * step)] for index in range(MAX_CHOICES)]


def _place(item: PlacedBox, choice: _Choice, x: float, y: float, *, centred: bool = True) -> None:
    """Place an item with everything below it into a rectangle whose upper left corner is given."""
    item.x, item.y, item.rows = x, y, []
    pairs = list(zip(item.children, choice.below, strict=True))
    if not choice.rows:
        top = y + item.height + GAP_Y
        for child, below in pairs:
            _place(child, below, x + INDENT, top, centred=False)
            top += below.height + GAP_Y
        return
    top, indent = y + item.height + DROP, INDENT if len(choice.rows) > 1 else 0.0
    for count in choice.rows:
        row, pairs = pairs[:count], pairs[count:]
        left = x + indent
        for child, below in row:
            _place(child, below, left, top)
            left += below.width + GAP_X
        item.rows.append([child for child, _ in row])
        top += max(below.height for _, below in row) + DROP
    if centred and len(item.rows) == 1:
        first, last = item.children[0], item.children[-1]
        middle = (first.x + first.width / 2 + last.x + last.width / 2) / 2
        item.x = min(max(x, middle - item.width / 2), x + choice.width - item.width)
