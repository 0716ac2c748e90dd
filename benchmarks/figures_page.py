"""The figures of benchmarks, and the page of them: a table for each file of benchmarks."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest

from benchmarks.measure import is_small
from tools.made_tables import figures_of
from tools.tables import command_of, made_of, table, text_between_marks, write_table

HEAD = ("what", "measured", "remark")
EARLIER = "of an earlier run"


@dataclass
class Figure:
    """One line of a table."""

    what: str
    value: str
    remark: str
    missed: bool = False
    """Whether the benchmark failed that measured it."""

    @property
    def shown(self) -> str:
        """What was measured, marked when a limit was missed."""
        return f"{self.value} (**missed**)" if self.missed else self.value


@dataclass
class Figures:
    """What the benchmarks of one file measured.

    Attributes:
        lines: In the order in which they were measured.
        failed: Benchmark -> why it failed before it had a figure.
        complete: Whether every benchmark of the file ran and has its figures.
    """

    lines: list[Figure] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    complete: bool = True

    def add(self, what: str, value: str, remark: str = "") -> None:
        """Add a line."""
        self.lines.append(Figure(what, value, remark))

    @staticmethod
    def limit(value: float, *, least: float | None = None, most: float | None = None) -> None:
        """Fail the benchmark when what it measured misses a limit; a small run has measured too little."""
        if is_small():
            return
        if least is not None and value < least:
            pytest.fail(f"{value:g} is less than {least:g}")
        if most is not None and value > most:
            pytest.fail(f"{value:g} is more than {most:g}")


def merged(figures: Figures, before: str) -> str:
    """Write the table of a file.

    Lines of before that were not measured stay, as such of an earlier run, while some benchmark of the file
    failed or was left out: which lines are its own nobody knows.

    Args:
        figures: What was measured now.
        before: The table with the line below it as it stands in the page.
    """
    rows = [(each.what, each.shown, each.remark) for each in figures.lines]
    rows += [(f"`{name}`", "**failed**", why) for name, why in figures.failed.items()]
    if not figures.complete:
        made = made_of(before)
        note = f"{EARLIER}, {made.date} on {made.commit}" if made else EARLIER
        now = {what for what, *_ in rows}
        for what, value, remark in _rows_of(before):
            if what not in now and value != "**failed**":
                said = remark if EARLIER in remark else f"{remark}; {note}".removeprefix("; ")
                rows.append((what, value, said))
    return table(HEAD, rows)


def _rows_of(text: str) -> list[list[str]]:
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line[1:-1].split(" | ", 2)] for line in lines[2:]]


def write_figures(page: Path, sections: dict[str, Figures]) -> None:
    """Write what was measured into a page; tables of files of which nothing was measured stay."""
    for name, figures in sorted(sections.items()):
        if not figures.lines and not figures.failed:
            continue
        if text_between_marks(page, name) is None:
            with page.open("a", encoding="utf-8") as opened:
                opened.write(f"\n## {name}\n\n<!-- {name} -->\n\n<!-- end of {name} -->\n")
        text = merged(figures, text_between_marks(page, name) or "")
        made = figures_of(name)
        write_table(page, name, text, command_of(made.tool, made.arguments.split()))
