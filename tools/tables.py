"""Totals as tables of Markdown for the docs, and single runs as files for whoever wants to look closer."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

BUILD = Path(__file__).resolve().parents[1] / "build"
"""Where the files of single runs are; git ignores it."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def write_runs(name: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Path:
    """Write single runs, a row for each, to ``build/NAME.csv``.

    Returns:
        The file.
    """
    BUILD.mkdir(exist_ok=True)
    file = BUILD / f"{name}.csv"
    with file.open("w", newline="", encoding="utf-8") as output:
        csv.writer(output, lineterminator="\n").writerows([head, *rows])
    return file


def milliseconds(ordered: Sequence[float], share: float) -> str:
    """Return the value below which a share of some seconds lies, e.g. ``12 ms``."""
    place = max(0, math.ceil(share * len(ordered)) - 1)
    return f"{1000.0 * ordered[place]:.0f} ms"


def write_between_marks(file: Path, name: str, text: str) -> None:
    """Replace what stands between ``<!-- NAME -->`` and ``<!-- end of NAME -->`` in a page.

    Raises:
        ValueError: The page has no such marks.
    """
    page = file.read_text()
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(page):
        raise ValueError(f"{file} has no marks {begin} and {end}")
    file.write_text(pattern.sub(lambda _: f"{begin}\n\n{text}\n\n{end}", page))
