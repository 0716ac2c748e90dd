"""Scenario files as pytest files: each scenario is a test. The plugin loads this when a project wants it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from florence_bt.mission_testing.known import all_declarations
from florence_bt.mission_testing.scenarios.scenario import Scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, ScenarioFile, read_scenarios
from florence_bt.mission_testing.scenarios.scenario_run import run_scenario
from florence_bt.trees.checks.report import Excerpts, report_full

_LIBRARIES = pytest.StashKey[Libraries]()


class ScenarioError(Exception):
    """A scenario failed, or its file has errors; the message says it all."""


class ScenarioModule(pytest.File):
    """A scenario file."""

    def collect(self) -> Iterable[pytest.Item]:
        """One test for each scenario, and one for the file when something is wrong with it."""
        libraries = _libraries(self.config)
        read = read_scenarios(_nearest(self.path), libraries)
        if read.findings:
            yield BadFile.from_parent(self, name="the file can be read", read=read)
        for scenario in read.scenarios:
            yield ScenarioItem.from_parent(self, name=scenario.name, scenario=scenario)


class ScenarioItem(pytest.Item):
    """A scenario."""

    def __init__(self, *, scenario: Scenario, **more: Any) -> None:
        super().__init__(**more)
        self._scenario = scenario

    def runtest(self) -> None:
        """Play it.

        Raises:
            ScenarioError: Something in it does not hold.
        """
        result = run_scenario(self._scenario, _libraries(self.config), time.perf_counter)
        if not result.passed:
            file = self._scenario.file
            lines = [f"{file}:{at.line}:{at.column}: {problem}" for at, problem in result.problems]
            raise ScenarioError("\n".join([*lines, "", result.report]))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The message alone; where in Florence it was raised says nothing."""
        return _told(self, excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where the scenario stands."""
        return self.path, self._scenario.position.line - 1, self.name


class BadFile(pytest.Item):
    """What is wrong with a scenario file."""

    def __init__(self, *, read: ScenarioFile, **more: Any) -> None:
        super().__init__(**more)
        self._read = read

    def runtest(self) -> None:
        """Tell it.

        Raises:
            ScenarioError: Always.
        """
        raise ScenarioError(report_full(self._read.findings, Excerpts()))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The message alone."""
        return _told(self, excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where the first error is."""
        return self.path, self._read.findings[0].line - 1, self.name


def _told(item: pytest.Item, excinfo: pytest.ExceptionInfo[BaseException], style: Any) -> Any:
    if isinstance(excinfo.value, ScenarioError):
        return str(excinfo.value)
    return pytest.Item.repr_failure(item, excinfo, style)


def _libraries(config: pytest.Config) -> Libraries:
    if _LIBRARIES not in config.stash:
        config.stash[_LIBRARIES] = Libraries(tuple(config.getini("florence_missions")), all_declarations())
    return config.stash[_LIBRARIES]


def _nearest(path: Path) -> Path:
    """A path as people write it: relative when it is below the current folder."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
