"""The examples of docs/manual/testing.md hold, and its tables name every word there is."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from florence_bt.core.plain_yaml import parse_yaml
from florence_bt.mission_testing.coverage import Coverage
from florence_bt.mission_testing.mocks.scripts import parse_script
from florence_bt.mission_testing.paths import all_declarations, map_mission
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import (
    THEN_KEYS,
    WHEN_KEYS,
    Libraries,
    SourceReader,
    read_mocks,
    read_scenarios,
)
from florence_bt.trees.language.loader import MissionLibrary

PAGE = (Path(__file__).parents[3] / "docs" / "manual" / "testing.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```([a-z ]+)\n(.*?)```", PAGE, re.DOTALL)


def blocks(kind):
    found = [text for name, text in BLOCKS if name.strip() == kind]
    assert found, f"the page has no block of {kind}"
    return found


@pytest.mark.parametrize("text", blocks("yaml scenario"))
def test_the_scenarios_hold(tmp_path, text):
    file = tmp_path / "example.yaml"
    file.write_text(text)
    libraries = Libraries()
    read = read_scenarios(file, libraries)
    assert read.findings == ()
    coverage = Coverage()
    for scenario in read.scenarios:
        result = run_scenario(scenario)
        assert result.passed, (scenario.name, result.problems)
        coverage.add_runs(result.runs)
    assert len(read.scenarios) == 6


@pytest.mark.parametrize("text", blocks("yaml"))
def test_the_mocks_can_be_read(text):
    library = MissionLibrary.load()
    reader = SourceReader(Path("page"), library, None, all_declarations())
    places = map_mission(library.get("goto_room"), library, all_declarations())
    assert read_mocks(reader, parse_yaml(text.encode(), Path("page")), places, default=False)
    assert reader.findings == []


@pytest.mark.slow
@pytest.mark.parametrize("text", blocks("python test"))
def test_the_python_examples_hold(tmp_path, text):
    (tmp_path / "test_page.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", "test_page.py"]
    if "florence_bt.mission_testing.plugin" not in _plugins():
        command += ["-p", "florence_bt.mission_testing.plugin"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{text.count('def test_')} passed" in done.stdout


def test_each_script_of_the_tables_can_be_read():
    table = PAGE[PAGE.index("### What a skill does") : PAGE.index("### Which node")]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    assert len(rows) == 6
    for number, row in enumerate(rows):
        for piece in re.findall(r"`([^`]+)`", row):
            script = piece if number < 3 else f"{piece}, SUCCESS" if number < 5 else f"SUCCESS {piece}"
            assert parse_script(script)


def test_the_page_names_every_word():
    for word in (*THEN_KEYS, *WHEN_KEYS, "refused", "runs", "policy", "priority"):
        assert re.search(rf"`[^`]*\b{word}\b[^`]*`", PAGE), word


def _plugins():
    from importlib.metadata import entry_points

    return [entry.value for entry in entry_points(group="pytest11")]


WATCHING = """\
mission: watching
keys: {distance: {type: length, default: 10 m}}
tree:
  parallel:
    - sequence:
        - look_for_user: {}
          out: {user: user, distance: distance}
        - wait: 1 min
    - wait: 1 min
      while: $distance > 1 m
"""


def test_a_scripted_skill_changes_keys_in_the_middle_of_a_run(stage):
    script = re.search(r"`look_for_user: (running 4 s, then SUCCESS .*?)` writes both keys after 4 s", PAGE)
    assert script is not None, "the page no longer shows how to change a key"
    stage.load(WATCHING)
    stage.mock("look_for_user", script[1])
    play = stage.run("watching")
    play.assert_failed(code="guard_failed", reason="(distance is 0.8 m)")
    play.assert_duration("4 s").assert_keys({"distance": "80 cm", "user": "(3 m, 2 m, 0 deg)"})
