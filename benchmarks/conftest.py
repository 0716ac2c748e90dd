"""Collects the figures of the benchmarks and prints them.

``--figures FILE`` writes them into a page, ``--small`` measures as little as goes through all of the code,
``--domain N`` chooses the ROS domain.
"""

from __future__ import annotations

import sys
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import pytest

from benchmarks.figures_page import Figures, write_figures
from benchmarks.measure import be_small

if TYPE_CHECKING:
    from benchmarks.running_system import Systems

# The client pyroombaadapter installs a package of its own that is called tests.
sys.modules["tests"] = ModuleType("tests")
sys.modules["tests"].__path__ = [str(Path(__file__).parents[1] / "tests")]

SECTIONS = pytest.StashKey[dict[str, Figures]]()
"""By the name of the benchmark file."""
BEFORE = pytest.StashKey[int]()
"""How many figures its file had when a benchmark began."""
DOMAIN = 97
"""A ROS domain that no test uses."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--figures", type=Path, help="write the figures into this Markdown page")
    parser.addoption("--small", action="store_true", help="measure as little as goes through all of the code")
    parser.addoption("--domain", type=int, default=DOMAIN, help="ROS domain of the benchmarks")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[SECTIONS] = {}
    if config.getoption("--small"):
        be_small()


def section_of(config: pytest.Config, path: Path) -> Figures:
    """Return the figures of a benchmark file."""
    return config.stash[SECTIONS].setdefault(path.stem, Figures())


def pytest_deselected(items: Sequence[pytest.Item]) -> None:
    for item in items:
        section_of(item.config, item.path).complete = False


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    if isinstance(collector, pytest.File) and not report.passed:
        section = section_of(collector.config, collector.path)
        section.complete = False
        if report.failed:
            section.failed[collector.path.name] = why(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    section = section_of(item.config, item.path)
    if report.skipped:
        section.complete = False
    elif report.failed:
        measured = section.lines[item.stash.get(BEFORE, len(section.lines)) :]
        for figure in measured:
            figure.missed = True
        if not measured:
            section.complete = False
            section.failed.setdefault(item.name, why(report))
    return report


def why(report: pytest.CollectReport | pytest.TestReport) -> str:
    """Return in one line why something failed, as a cell of a table."""
    crash = getattr(report.longrepr, "reprcrash", None)
    text = crash.message if crash is not None else str(report.longrepr)
    lines = text.strip().splitlines() or [""]
    return (lines[0] if crash is not None else lines[-1]).replace("|", "/")[:200]


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Figures:
    section = section_of(request.config, request.node.path)
    request.node.stash[BEFORE] = len(section.lines)
    return section


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    sections = config.stash[SECTIONS]
    lines = [figure for figures in sections.values() for figure in figures.lines]
    if lines:
        terminalreporter.section("figures")
    for figure in lines:
        remark = f"  ({figure.remark})" if figure.remark else ""
        terminalreporter.write_line(f"{figure.what:<62} {figure.shown}{remark}")
    file = config.getoption("--figures")
    if file is not None:
        write_figures(file, sections)
        terminalreporter.write_line(f"written to {file}")


@pytest.fixture(scope="module")
def domain(request: pytest.FixtureRequest) -> Iterator[None]:
    """A ROS domain of the benchmarks, on this machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(request.config.getoption("--domain")))
        from florence_bt.ros.environment import reach_of

        for name, value in reach_of({}).variables.items():
            patch.delenv(name, raising=False) if value is None else patch.setenv(name, value)
        yield


@pytest.fixture(scope="module")
def systems(domain: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Systems]:
    """Whole systems, as they are asked for; the last one is ended after the file."""
    from benchmarks.running_system import Systems

    made = Systems(tmp_path_factory.mktemp("systems"))
    yield made
    made.close()
