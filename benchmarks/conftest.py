"""Collects the figures of the benchmarks and prints them as a table; ``--figures FILE`` writes it too."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

# The client pyroombaadapter installs a package of its own that is called tests.
sys.modules["tests"] = ModuleType("tests")
sys.modules["tests"].__path__ = [str(Path(__file__).parents[1] / "tests")]


@dataclass
class Figure:
    """One line of the table."""

    what: str
    value: str
    remark: str
    missed: bool = False
    """Whether the benchmark failed that measured it."""

    @property
    def shown(self) -> str:
        """What was measured, marked when a limit was missed."""
        return f"{self.value} (**missed**)" if self.missed else self.value


class Figures:
    """What the benchmarks of one file measured."""

    def __init__(self) -> None:
        self.lines: list[Figure] = []

    def add(self, what: str, value: str, remark: str = "") -> None:
        """Add a line."""
        self.lines.append(Figure(what, value, remark))

    def markdown(self) -> str:
        """The table."""
        head = ["| what | measured | remark |", "|---|---|---|"]
        return "\n".join(head + [f"| {f.what} | {f.shown} | {f.remark} |" for f in self.lines]) + "\n"


Sections = dict[str, Figures]
"""By the name of the benchmark file."""


def write_figures(file: Path, sections: Sections) -> None:
    """Write the tables; those of benchmark files that did not run, or not as a whole, stay."""
    tables: dict[str, str] = {}
    if file.exists():
        for part in file.read_text(encoding="utf-8").split("\n## ")[1:]:
            name, _, table = part.partition("\n")
            tables[name] = table.strip() + "\n"
    machine = f"{os.cpu_count()} cores, Python {platform.python_version()}"
    tables |= {name: figures.markdown() for name, figures in sections.items() if figures.lines}
    text = (
        '# Figures\n\nMade by `make bench ARGS="--figures docs/notes/benchmarks.md"`, one table for each '
        "file of `benchmarks/`; medians unless said otherwise; **missed** marks what a benchmark "
        "measured that failed its limit. "
        f"Machine of the last run: {machine}. Compare ratios, not absolute times.\n"
    )
    body = "".join(f"\n## {name}\n\n{table}" for name, table in sorted(tables.items()))
    file.write_text(text + body, encoding="utf-8")


FIGURES = pytest.StashKey[Sections]()
INCOMPLETE = pytest.StashKey[set[str]]()
"""The names of the benchmark files of which something was left out, or failed before it had a figure."""
BEFORE = pytest.StashKey[int]()
"""How many figures its file had when a benchmark began."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--figures", type=Path, help="write the figures to this Markdown file")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[FIGURES] = {}
    config.stash[INCOMPLETE] = set()


def pytest_deselected(items: Sequence[pytest.Item]) -> None:
    for item in items:
        item.config.stash[INCOMPLETE].add(item.path.stem)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        section = item.config.stash[FIGURES].get(item.path.stem, Figures())
        measured = section.lines[item.stash.get(BEFORE, len(section.lines)) :]
        for figure in measured:
            figure.missed = True
        if not measured:
            item.config.stash[INCOMPLETE].add(item.path.stem)
    return report


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Figures:
    section = request.config.stash[FIGURES].setdefault(request.node.path.stem, Figures())
    request.node.stash[BEFORE] = len(section.lines)
    return section


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    sections = config.stash[FIGURES]
    lines = [figure for figures in sections.values() for figure in figures.lines]
    if not lines:
        return
    terminalreporter.section("figures")
    for figure in lines:
        remark = f"  ({figure.remark})" if figure.remark else ""
        terminalreporter.write_line(f"{figure.what:<62} {figure.shown}{remark}")
    file = config.getoption("--figures")
    if file is not None:
        incomplete = config.stash[INCOMPLETE]
        write_figures(file, {name: table for name, table in sections.items() if name not in incomplete})
        left = ", ".join(sorted(incomplete & set(sections)))
        terminalreporter.write_line(
            f"written to {file}" + (f", without the incomplete {left}" if left else "")
        )


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ROS domain of the benchmarks, on this machine."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "97")
    from florence_bt.ros.environment import reach_of

    for name, value in reach_of({}).variables.items():
        monkeypatch.delenv(name, raising=False) if value is None else monkeypatch.setenv(name, value)
