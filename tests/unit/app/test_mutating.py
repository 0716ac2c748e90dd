"""``florence mutate`` says which small changes of a mission nobody notices, and writes scenarios that do."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.mission_files.mutating import MutateOptions, mutate_mission
from florence_bt.assurance.mutating.scenario_text import MARK
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.language.parse import parse_mission

MISSION = """\
mission: at_the_door
description: Drive to the door, and say so.
tree:
  sequence:
    # It is narrow there.
    - retry: 2
      do:
        navigate_to: {goal: {x: 1 m, y: 2 m, yaw: 0 deg}}
    - succeed:
        wait: 2 s
    - say: {text: I am there.}
"""
SCENARIOS = """\
# It is seldom open.
mission: at_the_door
missions: [..]
given:
  skills:
    navigate_to: running 10 s, then SUCCESS
    say: SUCCESS

scenarios:
  - name: it says that it is there
    then: {status: SUCCEEDED, duration: 12 s, only_calls: [navigate_to, say]}
"""
FAILING = SCENARIOS.replace("12 s", "13 s")
ALL_OF_IT = """
  - name: the second attempt is the last one
    given: {skills: {navigate_to: "running 1 s, then FAILURE blocked"}}
    then: {status: FAILED, called: {navigate_to: 2}, duration: 2 s}

  - name: after a failure it tries again
    given: {skills: {navigate_to: "FAILURE blocked once, then SUCCESS"}}
    then:
      status: SUCCEEDED
      calls: [navigate_to, navigate_to: {goal: {x: 1 m, y: 2 m, yaw: 0 deg}}, say]
      trace: {of: say, lines: ["2 s say: SUCCESS"]}
"""


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    """A mission with a folder of scenarios beside it."""
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "at_the_door.yaml").write_text(SCENARIOS)
    file = tmp_path / "at_the_door.yaml"
    file.write_text(MISSION)
    return file


def scenarios_of(mission: Path) -> Path:
    return mission.parent / "scenarios" / mission.name


def results(mission: Path, text: str = "") -> list[bool]:
    """Play the scenarios of a mission, or of another text in its place."""
    instead = [parse_mission(text, mission)] if text else []
    read = read_scenarios(scenarios_of(mission), Libraries(instead=instead))
    assert not read.findings
    return [run_scenario(each).passed for each in read.scenarios]


def test_what_nobody_notices_is_shown_with_its_line_and_a_diff(mission: Path):
    report, noticed = mutate_mission(str(mission), MutateOptions())
    assert not noticed
    assert f"{mission}:6\n" in report
    assert "    -    - retry: 2\n    +    - retry: 3\n" in report
    assert "`succeed`" not in report  # a pause never fails: that is equivalent


def test_each_change_is_counted_once_under_who_notices_it_first(mission: Path):
    report, _ = mutate_mission(str(mission), MutateOptions())
    head, *_ = [line for line in report.splitlines() if line.startswith("  changed")]
    assert head.split("  ")[-1] == "unnoticed"
    [last] = [line for line in report.splitlines() if line.startswith("  all ")]
    tried, refused, by_scenarios, by_properties, equivalent, not_told, unnoticed = map(int, last.split()[1:])
    assert tried == refused + by_scenarios + by_properties + equivalent + not_told + unnoticed
    assert (by_properties, equivalent, not_told, unnoticed) == (0, 1, 0, 8)


def test_the_manual_shows_this_mission_and_what_is_printed_of_it(mission: Path):
    page = (Path(__file__).parents[3] / "docs" / "manual" / "mutate.md").read_text()
    report, _ = mutate_mission(str(mission), MutateOptions())
    assert MISSION in page
    assert report.split("\n\n  unnoticed")[0] in page
    [change] = [each for each in report.split("\n\n") if each.startswith("  unnoticed: 2 becomes 3")]
    assert change.replace(str(mission), mission.name) in page


def test_a_property_of_the_author_notices(mission: Path):
    text = "properties:\n  - at_most: {navigate_to: 2}\n"
    (mission.parent / "at_the_door.properties.yml").write_text(text)
    report, _ = mutate_mission(str(mission), MutateOptions())
    [last] = [line for line in report.splitlines() if line.startswith("  all ")]
    assert last.split()[4] == "1"
    assert "retry: 3" not in report


def test_written_scenarios_pass_and_notice_what_nobody_noticed(mission: Path):
    report, _ = mutate_mission(str(mission), MutateOptions(write=True))
    assert str(scenarios_of(mission)) in report
    assert scenarios_of(mission).read_text().startswith(SCENARIOS)
    assert all(results(mission))
    for attempts in ("retry: 3", "retry: 1"):
        assert not all(results(mission, MISSION.replace("retry: 2", attempts)))
    report, noticed = mutate_mission(str(mission), MutateOptions())
    assert noticed
    assert report.startswith("at_the_door: 10 small changes, all that make a difference are noticed")


def test_what_is_added_stands_below_a_line_that_says_so(mission: Path):
    mutate_mission(str(mission), MutateOptions(write=True))
    text = scenarios_of(mission).read_text()
    assert text.startswith(f"{SCENARIOS}\n  {MARK}\n\n  - name: ")
    assert text.count(MARK) == 1


def test_an_input_that_is_as_by_default_is_expected_where_the_change_gives_another(mission: Path):
    mission.write_text("mission: at_the_door\ntree:\n  look_for_user: {window: 5 s}\n")
    scenarios_of(mission).unlink()
    mutate_mission(str(mission), MutateOptions(write=True))
    assert "look_for_user: {window: 5 s}" in scenarios_of(mission).read_text()
    assert mutate_mission(str(mission), MutateOptions())[1]


def test_few_scenarios_are_written(mission: Path):
    mutate_mission(str(mission), MutateOptions(write=True))
    assert len(results(mission)) <= 3


def test_a_mission_without_scenarios_gets_a_file(mission: Path):
    shutil.rmtree(mission.parent / "scenarios")
    _, noticed = mutate_mission(str(mission), MutateOptions(write=True))
    assert not noticed
    assert results(mission)
    assert all(results(mission))
    assert mutate_mission(str(mission), MutateOptions())[1]


def test_several_processes_say_the_same(mission: Path):
    assert mutate_mission(str(mission), MutateOptions(jobs=2)) == mutate_mission(
        str(mission), MutateOptions()
    )


def test_a_scenario_that_fails_already_is_an_error(mission: Path):
    scenarios_of(mission).write_text(FAILING)
    with pytest.raises(ConfigError, match="it says that it is there") as failed:
        mutate_mission(str(mission), MutateOptions())
    assert failed.value.line == 10


def test_the_command_ends_with_1_until_all_is_noticed(mission: Path):
    call = ["mutate", str(mission), "--jobs", "1"]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 1
    scenarios_of(mission).write_text(SCENARIOS + ALL_OF_IT)
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output


def test_nothing_is_added_where_scenarios_do_not_come_last(mission: Path):
    head, scenarios = SCENARIOS.split("given:")
    given, scenarios = scenarios.split("scenarios:")
    text = f"{head}scenarios:{scenarios}given:{given}"
    scenarios_of(mission).write_text(text)
    with pytest.raises(ConfigError, match="ends with the list of them"):
        mutate_mission(str(mission), MutateOptions(write=True))
    assert scenarios_of(mission).read_text() == text


@pytest.mark.parametrize("name", ["nosuch", "nosuch.yaml"])
def test_there_is_no_such_mission(name: str):
    with pytest.raises(ConfigError):
        mutate_mission(name, MutateOptions())


def test_there_are_no_such_scenarios(mission: Path):
    with pytest.raises(ConfigError, match="nosuch"):
        mutate_mission(str(mission), MutateOptions(scenarios=(Path("nosuch"),)))
