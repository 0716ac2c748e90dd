"""The pytest plugin: the fixture ``florence``, and scenario files as tests.

pytest loads this module in every session where Florence is installed. It loads nothing else before a test
asks for the fixture, or scenario files are collected: those that the setting ``florence_scenarios`` names, or
those on the command line of ``florence test`` (the option ``--florence-test``).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from florence_bt.mission_testing.coverage import Coverage
    from florence_bt.mission_testing.mission_tester import MissionTester
    from florence_bt.mission_testing.scenarios.scenario import Scenario
    from florence_bt.mission_testing.scenarios.scenario_file import Libraries

_LIBRARIES = pytest.StashKey["Libraries"]()
_COVERAGE = pytest.StashKey["Coverage"]()
_SCENARIOS = re.compile(rb"^(?:scen\w*|given|then|missions?)\s*:", re.MULTILINE)
"""A line that only a scenario file has; a mission has the last of these words too."""
_MISSION = re.compile(rb"^tree\s*:", re.MULTILINE)
_CERTAIN = re.compile(rb"^scenarios\s*:", re.MULTILINE)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options and the settings ``florence_missions`` and ``florence_scenarios``."""
    missions = "folders of missions, relative to the root of the project; later ones shadow earlier ones"
    scenarios = "scenario files and folders of them that pytest runs as tests, relative to the project's root"
    parser.addini("florence_missions", missions, type="paths", default=[])
    parser.addini("florence_scenarios", scenarios, type="paths", default=[])
    group = parser.getgroup("florence", "missions of Florence")
    add = group.addoption
    add("--florence-test", action="store_true", help="run the scenario files that are named here")
    add("--florence-missions", action="append", default=[], metavar="FOLDER", help="a folder of missions")
    add("--florence-coverage", action="store_true", help="report which nodes and outcomes scenarios saw")
    add("--florence-min-coverage", type=float, metavar="PERCENT", help="fail when fewer outcomes were seen")


def pytest_configure(config: pytest.Config) -> None:
    """See that what the settings name exists.

    Raises:
        UsageError: A file or a folder does not.
    """
    for setting in ("florence_missions", "florence_scenarios"):
        for path in config.getini(setting):
            if not path.exists():
                raise pytest.UsageError(f"{setting}: there is no file or folder '{path}'")
    for folder in config.getoption("florence_missions"):
        if not Path(folder).is_dir():
            raise pytest.UsageError(f"--missions: there is no folder '{folder}'")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take the scenario files that the project or the command line names."""
    if file_path.suffix not in (".yaml", ".yml"):
        return None
    wanted = parent.config.getini("florence_scenarios")
    named = file_path in wanted
    inside = any(folder in file_path.parents for folder in wanted)
    if parent.config.getoption("florence_test"):
        named, inside = parent.session.isinitpath(file_path), True
    if named or (inside and looks_like_scenarios(file_path)):
        return ScenarioModule.from_parent(parent, path=file_path)
    return None


def looks_like_scenarios(path: Path) -> bool:
    """Tell whether a YAML file in a folder is meant to hold scenarios; one that cannot be read counts too."""
    from florence_bt.core.errors import ConfigError
    from florence_bt.core.text_files import read_bytes

    try:
        data = read_bytes(path)
    except ConfigError:
        return True
    if _MISSION.search(data):
        return _CERTAIN.search(data) is not None
    return _SCENARIOS.search(data) is not None


class ScenarioModule(pytest.File):
    """A scenario file."""

    def collect(self) -> Iterable[pytest.Item]:
        """Yield a test for each scenario, and one for the file when something is wrong with it."""
        from florence_bt.mission_testing.scenarios.scenario_file import read_scenarios
        from florence_bt.trees.checks.report import Excerpts, report_full

        here = Path.cwd()
        path = self.path.relative_to(here) if self.path.is_relative_to(here) else self.path
        read = read_scenarios(path, _libraries(self.config))
        if read.findings:
            report, line = report_full(read.findings, Excerpts()), read.findings[0].line
            name = "the file can be read"
            yield ScenarioItem.from_parent(self, name=name, line=line, problem=lambda: report)
        for scenario in read.scenarios:
            name, line = scenario.name, scenario.position.line
            play = _play(scenario, self.config)
            yield ScenarioItem.from_parent(self, name=name, line=line, problem=play)


class ScenarioError(Exception):
    """A scenario failed, or its file has errors; the message holds everything there is to say."""


class ScenarioItem(pytest.Item):
    """A scenario, or what is wrong with a file."""

    def __init__(self, *, line: int, problem: Callable[[], str], **more: Any) -> None:
        super().__init__(**more)
        self._line = line
        self._problem = problem

    def runtest(self) -> None:
        """Play it.

        Raises:
            ScenarioError: Something does not hold.
        """
        problem = self._problem()
        if problem:
            raise ScenarioError(problem)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the message alone; where in Florence it was raised is of no use."""
        if isinstance(excinfo.value, ScenarioError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return where it stands."""
        return self.path, self._line - 1, self.name


def _play(scenario: Scenario, config: pytest.Config) -> Callable[[], str]:
    """Return a function that runs a scenario and says what does not hold."""

    def play() -> str:
        from florence_bt.mission_testing.scenarios.scenario import run_scenario

        result = run_scenario(scenario)
        coverage = _coverage(config)
        coverage.add_mission(scenario.library.get(scenario.trigger.mission), scenario.library)
        coverage.add_runs(result.runs)
        lines = [f"{scenario.file}:{at.line}:{at.column}: {problem}" for at, problem in result.problems]
        return "" if result.passed else "\n".join([*lines, "", result.report])

    return play


def _libraries(config: pytest.Config) -> Libraries:
    from florence_bt.mission_testing.scenarios.scenario_file import Libraries

    if _LIBRARIES not in config.stash:
        folders = [*config.getini("florence_missions"), *map(Path, config.getoption("florence_missions"))]
        config.stash[_LIBRARIES] = Libraries(tuple(folders))
    return config.stash[_LIBRARIES]


def _coverage(config: pytest.Config) -> Coverage:
    from florence_bt.mission_testing.coverage import Coverage

    return config.stash.setdefault(_COVERAGE, Coverage())


def _coverage_report(config: pytest.Config) -> tuple[str, str]:
    """Return the coverage as text, and what is wrong with it; empty if not wanted or nothing was played."""
    wanted, least = config.getoption("florence_coverage"), config.getoption("florence_min_coverage")
    if (not wanted and least is None) or _COVERAGE not in config.stash:
        return "", ""
    from florence_bt.mission_testing.coverage import coverage_text, total_of

    coverage, libraries = _coverage(config), _libraries(config)
    if not config.getoption("keyword"):
        for mission, library in libraries.own_missions():
            coverage.add_mission(mission, library)
    reports = coverage.report(libraries.declarations)
    share = total_of(reports).percent
    enough = least is None or share >= least
    problem = "" if enough else f"the coverage is {share:.1f} %, below the required {least:g} %"
    return coverage_text(reports, codes=wanted) if wanted or problem else "", problem


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Let the session fail when the coverage is too low."""
    if _coverage_report(session.config)[1] and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Report the coverage."""
    report, problem = _coverage_report(config)
    if report:
        terminalreporter.section("coverage of missions")
        terminalreporter.write_line(report)
    if problem:
        terminalreporter.write_line(problem, red=True)


@pytest.fixture
def florence(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[MissionTester]:
    """Run missions with mocked skills on a clock that is moved by hand."""
    from florence_bt.mission_testing.mission_tester import MissionTester

    folders: Sequence[Path] = request.config.getini("florence_missions")
    tester = MissionTester(folders, scratch=tmp_path)
    failed_before = request.session.testsfailed
    yield tester
    if request.session.testsfailed == failed_before:  # else the test has reported it, or something worse
        tester.check_mocks()
