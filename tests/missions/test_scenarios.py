"""The scenarios of the missions of the package: all hold, and they see every outcome of every node."""

from pathlib import Path

import pytest

from florence_bt.mission_testing.coverage import Coverage, coverage_text
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.language.loader import BUILT_IN

pytestmark = pytest.mark.xdist_group("scenarios")  # they share what they have seen

FOLDER = Path(__file__).parents[2] / "scenarios"
LIBRARIES = Libraries()
READS = [read_scenarios(file, LIBRARIES) for file in sorted(FOLDER.glob("*.yaml"))]
SCENARIOS = [
    pytest.param(scenario, id=f"{read.file.stem}: {scenario.name}")
    for read in READS
    for scenario in read.scenarios
]


def test_the_files_have_no_errors():
    assert [finding for read in READS for finding in read.findings] == []


@pytest.fixture(scope="module")
def coverage():
    """What was seen so far, and which scenarios were added."""
    return Coverage(), set()


def add(coverage, scenario):
    """Run a scenario and add what it sees."""
    seen, added = coverage
    result = run_scenario(scenario)
    seen.add_mission(scenario.library.get(scenario.trigger.mission), scenario.library)
    seen.add_runs(result.runs)
    added.add(id(scenario))
    return result


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_scenario(scenario, coverage):
    result = add(coverage, scenario)
    assert result.passed, "\n".join([*(problem for _, problem in result.problems), "", result.report])
    assert all(call.ended is not None for run in result.runs for call in run.calls()), (
        "a goal was left behind"
    )


def test_every_outcome_of_every_node_of_every_mission_is_seen(coverage):
    seen, added = coverage
    for read in READS:
        for scenario in read.scenarios:
            if id(scenario) not in added:  # this test was chosen alone
                add(coverage, scenario)
    reports = seen.report(LIBRARIES.declarations)
    assert {report.name for report in reports} >= {path.stem for path in BUILT_IN.glob("*.yaml")}
    percent = [(report.outcomes_seen.percent, report.codes_seen.percent) for report in reports]
    assert percent == [(100.0, 100.0)] * len(reports), coverage_text(reports, codes=True)
