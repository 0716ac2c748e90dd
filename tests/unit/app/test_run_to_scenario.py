"""Recorded runs as scenarios: they pass, and fail when a line of the mission is another one."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.runs.run_to_scenario import run_to_scenario
from florence_bt.cli.application import app
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.mission_testing.scenarios.from_run import scenario_of
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.run import MissionRequest, RunIds
from florence_bt.trees.language.loader import MissionLibrary
from tests.recorded_runs import MISSIONS, record_run, resumable_missions
from tests.scripted_skill import ScriptedSkill
from tests.unit.app.test_check_run import CHANGES


def play(file):
    """Play the only scenario of a file, with the missions as they are now."""
    read = read_scenarios(file, Libraries())
    return [run_scenario(scenario).passed for scenario in read.scenarios], read.findings


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_recorded_run_is_a_scenario_that_notices_a_changed_line(tmp_path, mission):
    """Twenty runs in all: four of each mission."""
    folder = tmp_path / "missions"
    resumable_missions(folder)
    files = []
    for seed in (1, 2, 3, 5):
        runs = tmp_path / f"runs{seed}"
        run, _ = record_run(folder, runs, mission, seed)
        files.append(tmp_path / f"{seed}_scenarios.yaml")
        run_to_scenario(runs, run.run_id, files[-1])
    assert [play(file) for file in files] == [([True], ())] * 4
    old, new, _ = CHANGES[mission]
    text = (folder / f"{mission}.yaml").read_text()
    (folder / f"{mission}.yaml").write_text(text.replace(old, new))
    assert not any(all(passed) and passed for passed, _ in map(play, files))


def test_the_command_writes_a_file_that_the_command_test_plays(tmp_path):
    folder, runs, file = tmp_path / "missions", tmp_path / "runs", tmp_path / "it_scenarios.yaml"
    resumable_missions(folder)
    record_run(folder, runs, "remind", 3)
    arguments = ["replay", "--folder", str(runs), "--to-scenario", str(file)]
    written = CliRunner().invoke(app, arguments)
    assert written.exit_code == 0, written.output
    assert CliRunner().invoke(app, ["test", str(file)]).exit_code == 0
    # It is written again, but nothing that is no such file is replaced.
    assert CliRunner().invoke(app, arguments).exit_code == 0
    file.write_text("my own text\n")
    assert CliRunner().invoke(app, arguments).exit_code == 2
    assert file.read_text() == "my own text\n"


def test_what_was_edited_since_the_run_is_told(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, _ = record_run(folder, runs, "patrol", 3)
    (folder / "patrol.yaml").write_text((folder / "patrol.yaml").read_text() + "# edited\n")
    assert "patrol.yaml" in run_to_scenario(runs, run.run_id, tmp_path / "scenarios.yaml")


GIVES = SkillDeclaration(
    "give",
    "Give all kinds of values",
    inputs={"word": Port(Kind.TEXT, "a word", default="")},
    outputs={
        "word": Port(Kind.TEXT, "a text"),
        "words": Port(Kind.LIST_OF_TEXT, "texts"),
        "place": Port(Kind.POSE, "a pose"),
        "places": Port(Kind.LIST_OF_POSE, "poses"),
        "angle": Port(Kind.ANGLE, "an angle"),
        "speed": Port(Kind.SPEED, "a speed"),
        "good": Port(Kind.BOOLEAN, "yes or no"),
    },
)
TAKES_ALL = """mission: takes
description: Takes all kinds of values.
tree:
  sequence:
    - give:
      out: {word: word, words: words, place: place, places: places, angle: angle, speed: speed, good: good}
    - condition: $angle > 1.234567 rad
    - give: {word: $word}
"""


def scenario_with(folder: Path, word: str) -> str:
    """Record a run whose skill gives a word, and other values; the text of its scenario."""
    (folder / "missions").mkdir()
    (folder / "missions" / "takes.yaml").write_text(TAKES_ALL)
    library, clock = MissionLibrary.load([folder / "missions"], built_in=False), ManualClock(12.3)
    values = {
        "word": word,
        "words": ("a, b", "c"),
        "place": Pose2(1.0 / 3.0, -2.0, 3.0),
        "places": (Pose2(0.0, 0.1, 0.2), Pose2(1.0, 1.0, -1.0)),
        "angle": 1.2345678,
        "speed": 0.1,
        "good": True,
    }
    skills = {"give": ScriptedSkill(GIVES, clock, [Step(success(**values), after=0.1)])}
    declarations = {"give": GIVES}
    log = Journal(folder / "runs")
    run = Executor(library, skills, declarations, clock, RunIds("G"), log=log).trigger(
        MissionRequest("takes")
    )
    clock.advance(5.0)
    assert run.status.final and run.code == "ok", run.reason
    with JournalReader(folder / "runs") as reader:
        row, events = reader.run(run.run_id), reader.events(run.run_id)
    assert row is not None
    return scenario_of(row, events, library, declarations, Known(declarations, folder / "missions"), folder)


class Known(Libraries):
    """Missions with skills that are only known here."""

    def __init__(self, declarations, folder):
        super().__init__((folder,))
        self.declarations = {**self.declarations, **declarations}


@pytest.mark.parametrize("word", ["yes", "it's", 'a "word"', "a, b (c) {d}: [e]", "ä\u00df then FAILURE"])
def test_values_of_every_kind_come_back_as_they_were(tmp_path, word):
    assert "takes" in scenario_with(tmp_path, word)


def test_a_text_that_no_script_can_hold_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="quotes"):
        scenario_with(tmp_path, 'it\'s a "word"')
