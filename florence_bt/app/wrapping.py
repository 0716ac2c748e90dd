"""Breaks what is printed at blanks, where a terminal would break it inside of words."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
from collections.abc import Sequence
from typing import TextIO

_INDENT = 4
"""Columns by which a line that goes on is moved in. Chosen."""
_COLUMNS = re.compile(r"\s*\S+(?: \S+)*  +")
"""A name in front of its text: two blanks or more part them."""


def terminal_columns(stream: TextIO | None = None) -> int | None:
    """Return how wide the terminal is that is printed to; None for a pipe, where nothing is broken."""
    return shutil.get_terminal_size().columns if (stream or sys.stdout).isatty() else None


def hanging(line: str, columns: int | None) -> str:
    """Break a line at blanks; what follows stands below its last column, or is indented.

    A word that alone is longer than the terminal is wide, such as a path, is left whole.
    """
    if columns is None or len(line) <= columns:
        return line
    column = _COLUMNS.match(line)
    indent = column.end() if column is not None else len(line) - len(line.lstrip()) or _INDENT
    return textwrap.fill(
        line,
        columns,
        subsequent_indent=" " * (indent if indent <= columns // 2 else _INDENT),
        break_long_words=False,
        break_on_hyphens=False,
    )


def in_columns(rows: Sequence[Sequence[str]], columns: int | None) -> list[str]:
    """Lay rows of as many cells each out as a table, whose last column is a text of any length.

    Where a row is too long for the terminal, its last cells go to lines of their own: the text, broken at
    blanks, and the cells before it, too, where even those do not fit beside each other.

    Args:
        rows: The rows, the head line first.
        columns: How wide the terminal is; None for one line a row, however long.
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]) - 1)]
    fixed = sum(widths) + 2 * len(widths)
    beside = len(widths)
    if columns is not None and any(fixed + len(row[-1]) > columns for row in rows):
        while beside > 1 and sum(widths[:beside]) + 2 * beside - 2 > columns:
            beside -= 1
        return [line for row in rows for line in _stacked(row, widths[:beside], columns)]
    return ["  ".join([*_padded(row, widths), row[-1]]).rstrip() for row in rows]


def _padded(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    return [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]


def _stacked(row: Sequence[str], widths: Sequence[int], columns: int) -> list[str]:
    below = [" " * _INDENT + cell for cell in row[len(widths) :] if cell]
    return ["  ".join(_padded(row, widths)).rstrip(), *(hanging(cell, columns) for cell in below)]
