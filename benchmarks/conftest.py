"""Collects the figures of the benchmarks and prints them as a table; ``--figures FILE`` writes it too."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class Figure:
    """One line of the table."""

    what: str
    value: str
    remark: str


class Figures:
    """What the benchmarks measured."""

    def __init__(self) -> None:
        self.lines: list[Figure] = []

    def add(self, what: str, value: str, remark: str = "") -> None:
        """Add a line."""
        self.lines.append(Figure(what, value, remark))

    def markdown(self) -> str:
        """The table."""
        head = ["| what | measured | remark |", "|---|---|---|"]
        return "\n".join(head + [f"| {f.what} | {f.value} | {f.remark} |" for f in self.lines]) + "\n"


FIGURES = pytest.StashKey[Figures]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--figures", type=Path, help="write the figures to this Markdown file")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[FIGURES] = Figures()


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Figures:
    return request.config.stash[FIGURES]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    figures = config.stash[FIGURES]
    if not figures.lines:
        return
    terminalreporter.section("figures")
    for figure in figures.lines:
        remark = f"  ({figure.remark})" if figure.remark else ""
        terminalreporter.write_line(f"{figure.what:<62} {figure.value}{remark}")
    file = config.getoption("--figures")
    if file is not None:
        machine = f"{os.cpu_count()} cores, Python {platform.python_version()}"
        text = (
            '# Figures\n\nMade by `make bench ARGS="--figures docs/benchmarks.md"`; medians unless said '
            f"otherwise. Machine of the last run: {machine}. Compare ratios, not absolute times.\n\n"
        )
        file.write_text(text + figures.markdown(), encoding="utf-8")
        terminalreporter.write_line(f"written to {file}")
