"""Plays scenarios on a stage."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from functools import partial

from florence_bt.core.errors import FlorenceError
from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.play import Unmet
from florence_bt.mission_testing.scenarios._scenario_events import hold, start
from florence_bt.mission_testing.scenarios.scenario import Expectation, MockEntry, Result, Scenario, Scene
from florence_bt.mission_testing.scenarios.scenario_file import Libraries
from florence_bt.mission_testing.stage import Stage

Step = tuple[Position, Callable[[], object]]


def run_scenario(scenario: Scenario, libraries: Libraries, wall_clock: Callable[[], float]) -> Result:
    """Play a scenario.

    Args:
        scenario: The scenario.
        libraries: Its missions and skills.
        wall_clock: Seconds, to time it.

    Returns:
        How it went. Nothing is raised: an error of a mission or of Florence itself is a problem too.
    """
    begun = wall_clock()
    stage = Stage(declarations=libraries.declarations, library=scenario.library, maps=scenario.maps)
    scene = Scene(stage)
    report = ""
    for position, step in _steps(scenario, scene):
        try:
            step()
        except Unmet as error:
            scene.problems.append((position, error.problem))
            break
        except (AssertionError, FlorenceError) as error:
            problem, _, report = str(error).partition("\n\n")
            scene.problems.append((position, problem))
            break
        except Exception as error:
            scene.problems.append((position, f"Florence broke: {type(error).__name__}: {error}"))
            report = traceback.format_exc()
            break
    if scene.problems and not report:
        report = "\n\n".join(play.report() for play in stage.plays)
    return Result(scenario, tuple(scene.problems), report, tuple(stage.plays), wall_clock() - begun)


def _steps(scenario: Scenario, scene: Scene) -> Iterator[Step]:
    """What is done, in order, each with its place in the file."""
    for mock in scenario.mocks:
        yield mock.position, partial(_mock, scene.stage, mock)
    refused = scenario.trigger.refused is not None
    begin = scenario.trigger.position if refused else scenario.position
    yield begin, partial(start, scene, scenario.trigger, "")
    for happening in scenario.when:
        yield happening.position, partial(happening.act, scene)
    yield scenario.position, partial(_run_to_the_end, scenario, scene)
    for name, expectation in {"": scenario.then, **scenario.others}.items():
        yield scenario.position, partial(_expect, scene, name, expectation)


def _mock(stage: Stage, mock: MockEntry) -> None:
    if mock.default:
        stage.defaults({mock.pattern: mock.make()})
    else:
        stage.mock(mock.pattern, mock.make())


def _run_to_the_end(scenario: Scenario, scene: Scene) -> None:
    """Let every run end that is not expected to go on."""
    for name, play in scene.plays.items():
        expected = scenario.then if name == "" else scenario.others.get(name, Expectation())
        if expected.goes_on or play.done:
            continue
        scene.stage.run_until_done(play)


def _expect(scene: Scene, name: str, expectation: Expectation) -> None:
    for check in expectation.checks:
        hold(scene, check, name)
