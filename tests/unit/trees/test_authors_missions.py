"""The missions in examples/missions hold, and the tutorial shows them and the commands as they are."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import is_skills_file
from florence_bt.trees.language.loader import MissionLibrary

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples" / "missions"
FOLDERS = (EXAMPLES, EXAMPLES / "first_steps")
FILES = [path for folder in FOLDERS for path in sorted(folder.glob("*.yaml"))]
MISSIONS = [path for path in FILES if not is_skills_file(path)]
DECLARATIONS = own_declarations()
LIBRARY = MissionLibrary.load(list(FOLDERS), third_party=False)
LIBRARIES = Libraries()
READS = {
    path.stem: read_scenarios(path, LIBRARIES) for path in sorted((EXAMPLES / "scenarios").glob("*.yaml"))
}
SCENARIOS = [
    pytest.param(scenario, id=f"{name}: {scenario.name}")
    for name, read in READS.items()
    for scenario in read.scenarios
]

TUTORIAL = (ROOT / "docs" / "manual" / "tutorial.md").read_text()
SHOWN = re.findall(r"```yaml (examples/\S+)\n(.*?)```", TUTORIAL, re.DOTALL)
COMMANDS = re.findall(r"```console\n\$ florence (\w+) (.*?)\n(.*?)```", TUTORIAL, re.DOTALL)


@pytest.mark.parametrize("file", MISSIONS, ids=lambda file: file.stem)
def test_a_mission_passes_the_check(file):
    mission = LIBRARY.get(file.stem)
    findings = check(mission, LIBRARY, DECLARATIONS)
    # An own skill is declared, and nobody has programmed it yet.
    assert [str(finding) for finding in findings if "(no_skill)" not in finding.message] == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_mission_is_short(file):
    lines = [line for line in file.read_text().splitlines() if not line.lstrip().startswith("#")]
    assert len(lines) <= 30


def test_every_mission_has_scenarios_of_success_and_of_failure():
    assert [finding for read in READS.values() for finding in read.findings] == []
    assert sorted(READS) == sorted(file.stem for file in MISSIONS)
    assert all(len(read.scenarios) >= 2 for read in READS.values())


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_scenario(scenario):
    result = run_scenario(scenario)
    assert result.passed, "\n".join([*(problem for _, problem in result.problems), "", result.report])


def test_the_tutorial_shows_every_mission_as_it_is():
    shown = dict(SHOWN)
    assert {ROOT / name for name in shown} >= set(MISSIONS)
    for name, text in shown.items():
        assert text == (ROOT / name).read_text(), name


@pytest.mark.parametrize(
    ("command", "words", "output"),
    [each for each in COMMANDS if each[0] in ("check", "draw")],
    ids=lambda text: text.splitlines()[0],
)
def test_the_tutorial_shows_what_the_commands_say(command, words, output, monkeypatch):
    monkeypatch.chdir(ROOT)
    done = CliRunner().invoke(app, [command, *words.split()], catch_exceptions=False)
    assert [line.rstrip() for line in done.stdout.splitlines()] == output.splitlines()


@pytest.mark.parametrize(
    ("words", "output"),
    [each[1:] for each in COMMANDS if each[0] == "test"],
    ids=lambda text: text.splitlines()[0],
)
def test_the_tutorial_shows_how_many_scenarios_pass(words, output):
    path = ROOT / words.split()[0]
    reads = READS.values() if path.is_dir() else [READS[path.stem]]
    scenarios = [scenario for read in reads for scenario in read.scenarios]
    assert re.search(rf"\b{len(scenarios)} passed", output)
    if "-v" in words:
        assert re.findall(r"::(.*) PASSED", output) == [scenario.name for scenario in scenarios]
