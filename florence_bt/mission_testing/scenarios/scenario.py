"""A scenario as read from its file, and how a mission tester runs it."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.mission_tester import MissionTester
from florence_bt.mission_testing.mocks.scripts import Script
from florence_bt.mission_testing.paths import MissionMaps
from florence_bt.mission_testing.test_run import ExpectationFailed, TestRun
from florence_bt.trees.language.loader import MissionLibrary


@dataclass(frozen=True, slots=True)
class MockEntry:
    """A mock of a scenario.

    Attributes:
        pattern: Whom it answers.
        make: Makes the script; once for each scenario, because a script may count its calls.
        default: Whether it was given for the whole file.
        position: Where it stands.
    """

    pattern: str
    make: Callable[[], Script]
    default: bool
    position: Position


@dataclass(frozen=True, slots=True)
class ScenarioStep:
    """An event while a mission runs.

    Attributes:
        kind: The key under ``when``.
        act: Lets it happen.
        position: Where it stands.
    """

    kind: str
    act: Callable[[ScenarioRun], None]
    position: Position


@dataclass(frozen=True, slots=True)
class Check:
    """One check of a scenario.

    Attributes:
        assertion: Raises an AssertionError when it does not.
        position: Where it stands.
    """

    assertion: Callable[[TestRun], object]
    position: Position


@dataclass(frozen=True, slots=True)
class Trigger:
    """The start of a mission.

    Attributes:
        mission: Its name.
        inputs: Its inputs, as texts.
        options: Policy, priority and caller, as far as they are given.
        refused: What the refusal must contain; None when it must be accepted.
        position: Where it stands.
    """

    mission: str
    inputs: Mapping[str, Any]
    options: Mapping[str, Any]
    refused: str | None
    position: Position


@dataclass(frozen=True, slots=True)
class Expectation:
    """The checks of one run at its end.

    Attributes:
        checks: The checks in the order of the file.
        goes_on: Whether the run is not expected to have ended.
    """

    checks: tuple[Check, ...] = ()
    goes_on: bool = False


@dataclass(frozen=True, slots=True)
class Scenario:
    """One case.

    Attributes:
        name: What it is about.
        file: The file.
        position: Where it begins.
        trigger: How its mission is started.
        mocks: The mocks.
        when: What happens meanwhile.
        then: What must hold in the end of each run, by the names that ``as`` gave them; the scenario's own
            mission has the empty name.
        library: The missions.
        maps: Their maps.
        declarations: The skills by name.
    """

    name: str
    file: Path
    position: Position
    trigger: Trigger
    mocks: tuple[MockEntry, ...]
    when: tuple[ScenarioStep, ...]
    then: Mapping[str, Expectation]
    library: MissionLibrary
    maps: MissionMaps
    declarations: Mapping[str, SkillDeclaration]


@dataclass(slots=True)
class ScenarioRun:
    """A scenario that is being played.

    Attributes:
        tester: Runs the missions.
        runs: The runs by name; the scenario's own mission has the empty name.
        problems: What did not hold so far, with its place in the file.
    """

    tester: MissionTester
    runs: dict[str, TestRun] = field(default_factory=dict)
    problems: list[tuple[Position, str]] = field(default_factory=list)

    @property
    def test_run(self) -> TestRun:
        """The run of the scenario's own mission.

        Raises:
            AssertionError: It was refused.
        """
        if "" not in self.runs:
            raise AssertionError("the mission was refused, so there is no run")
        return self.runs[""]

    def start(self, trigger: Trigger, name: str) -> None:
        """Start a mission and keep its run under a name.

        Raises:
            AssertionError: It was accepted although it should have been refused, or the other way round.
        """
        try:
            test_run = self.tester.start(trigger.mission, trigger.inputs, **trigger.options)
        except FlorenceError as error:
            if trigger.refused is None:
                raise AssertionError(f"{trigger.mission} was refused: {error}") from error
            if trigger.refused not in str(error):
                problem = f"the refusal does not contain {trigger.refused!r}; it is: {str(error)!r}"
                raise AssertionError(problem) from error
            return
        self.runs[name] = test_run
        if trigger.refused is not None:
            raise AssertionError(f"{trigger.mission} was accepted, but should have been refused")

    def expect(self, expectation: Expectation, name: str = "") -> None:
        """See whether everything holds of a run, and note what does not."""
        for check in expectation.checks:
            test_run = self.runs.get(name)
            if test_run is None:
                problem = f"there is no run {name!r}: it was refused or never started"
                self.problems.append((check.position, problem))
                continue
            try:
                check.assertion(test_run)
            except ExpectationFailed as error:
                self.problems.append((check.position, error.problem))
            except ConfigError as error:
                self.problems.append((check.position, str(error)))

    def run_to_the_end(self, expectations: Mapping[str, Expectation]) -> None:
        """Let every run end that is expected to end."""
        for name, test_run in self.runs.items():
            if not test_run.done and not expectations.get(name, Expectation()).goes_on:
                self.tester.run_until_done(test_run)


@dataclass(frozen=True, slots=True)
class ScenarioResult:
    """The result of a scenario.

    Attributes:
        scenario: The scenario.
        problems: Where and what did not hold.
        report: The tree and the calls, for the reader of the problems.
        runs: The runs, for the coverage.
    """

    scenario: Scenario
    problems: tuple[tuple[Position, str], ...]
    report: str
    runs: tuple[TestRun, ...]

    @property
    def passed(self) -> bool:
        """Tell whether everything held."""
        return not self.problems


def run_scenario(scenario: Scenario) -> ScenarioResult:
    """Play a scenario.

    Returns:
        How it went. Nothing is raised: an error of a mission or of Florence itself is a problem too.
    """
    tester = MissionTester(declarations=scenario.declarations, library=scenario.library, maps=scenario.maps)
    run = ScenarioRun(tester)
    report = ""
    for position, step in _steps(scenario, run):
        try:
            step()
            continue
        except ExpectationFailed as error:
            run.problems.append((position, error.problem))
        except (AssertionError, FlorenceError) as error:
            problem, _, report = str(error).partition("\n\n")
            run.problems.append((position, problem))
        except Exception as error:
            run.problems.append((position, f"Florence broke: {type(error).__name__}: {error}"))
            report = traceback.format_exc()
        break
    if run.problems and not report:
        report = "\n\n".join(test_run.report() for test_run in tester.runs)
    return ScenarioResult(scenario, tuple(run.problems), report, tuple(tester.runs))


def _steps(scenario: Scenario, run: ScenarioRun) -> Iterator[tuple[Position, Callable[[], object]]]:
    """Yield what is done, in order, each with its place in the file."""
    for mock in scenario.mocks:
        yield mock.position, partial(_mock, run.tester, mock)
    refused = scenario.trigger.refused is not None
    begin = scenario.trigger.position if refused else scenario.position
    yield begin, partial(run.start, scenario.trigger, "")
    for happening in scenario.when:
        yield happening.position, partial(happening.act, run)
    yield scenario.position, partial(run.run_to_the_end, scenario.then)
    for name, expectation in scenario.then.items():
        yield scenario.position, partial(run.expect, expectation, name)


def _mock(tester: MissionTester, mock: MockEntry) -> None:
    if mock.default:
        tester.defaults({mock.pattern: mock.make()})
    else:
        tester.mock(mock.pattern, mock.make())
