"""Recorded runs that are run again: the same, or where they differ."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.runs.check_run import check_run, difference_of
from florence_bt.app.runs.recorded_mission import read_recorded_mission
from florence_bt.cli.application import app
from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.run import MissionRequest, RunIds
from florence_bt.trees.language.loader import MissionLibrary
from tests.recorded_runs import MISSIONS, RandomSkill, record_run, resumable_missions
from tests.scripted_skill import ScriptedSkill
from tests.sweeps import sweep
from tests.unit.runtime.conftest import Bench

CHANGES = {
    "goto_user": ("    - get_views: {room: $room}", "    - get_views: {room: kitchen and hall}", "get views"),
    "patrol": (
        "    - battery_above: {charge: $charge}",
        "    - battery_above: {charge: 0.9}",
        "battery above",
    ),
    "remind": ("      - run: find_user\n", "      - say: {text: hello}\n      - run: find_user\n", "say"),
    "night_check": (
        "    - get_user_room:\n",
        "    - start_tracker:\n    - get_user_room:\n",
        "start tracker",
    ),
    "follow_me": ("    - start_tracker:\n", "    - stop_tracker:\n", "stop tracker"),
}
"""Mission -> a line that every run of it comes to, what it is changed to, and what the difference names."""


@pytest.mark.parametrize("mission", MISSIONS)
@pytest.mark.parametrize("first", sweep(range(0, 20, 4), every=5))
def test_recorded_runs_are_run_again_without_a_difference(tmp_path, mission, first):
    """A hundred runs with stops, pauses, overrides and crashes among them; make test-all has all of them."""
    resumable_missions(tmp_path / "missions")
    for seed in range(first, first + 4):
        runs = tmp_path / str(seed)
        run, did = record_run(tmp_path / "missions", runs, mission, seed)
        same, text = check_run(runs, run.run_id)
        assert same, (seed, did, text)


def test_among_them_is_everything_that_can_happen_to_a_run(tmp_path):
    resumable_missions(tmp_path / "missions")
    happened, recovered = set(), 0
    for seed in range(12):
        run, did = record_run(tmp_path / "missions", tmp_path / str(seed), "follow_me", seed)
        happened |= did
        with JournalReader(tmp_path / str(seed)) as reader:
            recovered += any(event.kind == "recovered" for event in reader.events(run.run_id))
    assert happened >= {"pause", "stop", "override", "kill"} and recovered


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_changed_line_is_a_difference_that_names_the_node(tmp_path, mission):
    folder = tmp_path / "missions"
    resumable_missions(folder)
    run, _ = record_run(folder, tmp_path / "runs", mission, 3)
    old, new, named = CHANGES[mission]
    text = (folder / f"{mission}.yaml").read_text()
    assert old in text
    (folder / f"{mission}.yaml").write_text(text.replace(old, new))
    # What the journal has is still the same; what the files have is not.
    assert check_run(tmp_path / "runs", run.run_id)[0]
    difference = difference_of(read_recorded_mission(tmp_path / "runs", run.run_id, [folder]))
    assert difference is not None and named in f"{difference.node} {difference.replayed}", difference
    assert difference.recorded != difference.replayed and difference.tick >= 1 and difference.at >= 0.0


def test_the_command_says_what_differs_by_its_exit_code(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    record_run(folder, runs, "remind", 1)
    arguments = ["replay", "--check", "--folder", str(runs)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    file = folder / "remind.yaml"
    file.write_text(
        file.read_text().replace("      - run: find_user\n", "      - wait: 1 s\n      - run: find_user\n")
    )
    changed = CliRunner().invoke(app, [*arguments, "--missions", str(folder)])
    assert changed.exit_code == 1 and re.search(r"tick +\d+", changed.output), changed.output
    missing = CliRunner().invoke(app, ["replay", "no-such-run", *arguments[1:]])
    assert missing.exit_code == 2 and "no-such-run" in missing.output


def test_what_was_recorded_without_its_texts_is_checked_with_files(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, _ = record_run(folder, runs, "patrol", 2)
    with sqlite3.connect(runs / "journal.sqlite") as journal:
        journal.executescript("DROP TABLE run_texts; DROP TABLE texts;")
    with pytest.raises(ConfigError, match="--missions"):
        check_run(runs, run.run_id)
    assert check_run(runs, run.run_id, [folder])[0]


def test_a_run_with_events_missing_is_refused(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, _ = record_run(folder, runs, "patrol", 2)
    with sqlite3.connect(runs / "journal.sqlite") as journal:
        journal.execute("UPDATE runs SET lost = 3")
    with pytest.raises(ConfigError, match="3 events"):
        check_run(runs, run.run_id)


def test_an_exception_out_of_a_skill_cannot_be_run_again(tmp_path):
    class Broken:
        def start(self, inputs):
            raise RuntimeError("out of order")

    bench = Bench(tmp_path, log=Journal(tmp_path / "runs"))
    bench.skills["work"] = Broken()
    bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(10.0)
    recorded = _of_bench(bench, tmp_path / "runs")
    with pytest.raises(ConfigError, match="exception"):
        difference_of(recorded)


@pytest.mark.parametrize(("catches", "code"), [(False, "timed_out"), (True, "ok")])
def test_what_a_skill_had_fed_back_when_its_time_was_over_is_no_difference(tmp_path, catches, code):
    bench = Bench(tmp_path, log=Journal(tmp_path / "runs"))
    bench.script(Step(None, feedback_at=((0.5, "2 m to go (of 3)"),)))
    late = "{timeout: 3 s, do: {drive: }}"
    tree = f"{{sequence: [{late}], on_failure: {{timed_out: {{work: }}}}}}" if catches else late
    run = bench.run_text(f"tree: {tree}")
    recorded = _of_bench(bench, tmp_path / "runs")
    assert any("2 m to go" in event.reason for event in recorded.events)
    assert run.status.final and run.code == code and difference_of(recorded) is None


def test_an_outcome_that_was_tampered_with_is_a_difference(tmp_path):
    bench = Bench(tmp_path, log=Journal(tmp_path / "runs"))
    bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(10.0)
    assert difference_of(_of_bench(bench, tmp_path / "runs")) is None
    with sqlite3.connect(tmp_path / "runs" / "journal.sqlite") as journal:
        journal.execute("UPDATE events SET new = 'FAILURE', code = 'blocked' WHERE new = 'SUCCESS'")
    assert difference_of(_of_bench(bench, tmp_path / "runs")) is not None


def test_skills_that_files_declare_are_recorded_with_the_run(tmp_path):
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / "garden.skills.yaml").write_text(
        "skills:\n  water: {description: Water the plants, deadline: 5 s, failures: {dry: no water}}\n"
    )
    (folder / "care.yaml").write_text("mission: care\ntree: {sequence: [water: ]}\n")
    library, clock = MissionLibrary.load([folder], built_in=False), ManualClock()
    skills = {"water": ScriptedSkill(library.declarations["water"], clock)}
    executor = Executor(
        library, skills, library.declarations, clock, RunIds("G"), log=Journal(tmp_path / "r")
    )
    run = executor.trigger(MissionRequest("care"))
    clock.advance(1.0)
    for file in folder.iterdir():
        file.unlink()
    assert check_run(tmp_path / "r", run.run_id)[0]
    with JournalReader(tmp_path / "r") as reader:
        assert {file.name for file in reader.texts(run.run_id)} == {"garden.skills.yaml", "care.yaml"}


def test_texts_of_runs_that_are_dropped_are_dropped_too(tmp_path):
    from florence_bt.runtime.journal import JournalParameters

    bench = Bench(tmp_path, log=Journal(tmp_path / "runs", JournalParameters(keep_runs=1)))
    for number in range(4):
        bench.run_text(f"description: number {number}\ntree: {{sequence: [work: ]}}")
    with sqlite3.connect(tmp_path / "runs" / "journal.sqlite") as journal:
        kept = journal.execute("SELECT count(*) FROM runs").fetchone()[0]
        assert journal.execute("SELECT count(*) FROM texts").fetchone()[0] == kept < 4


def _of_bench(bench, runs: Path):
    recorded = read_recorded_mission(runs, "", [bench.folder])
    return type(recorded)(
        recorded.row, recorded.events, recorded.texts, bench.executor.library, bench.declarations
    )


def test_random_skills_answer_as_they_declare():
    # The recorded runs would show little if their skills did what none can do.
    import random

    from florence_bt.trees.language.declarations import collect_declarations

    for declaration in collect_declarations().values():
        skill = RandomSkill(declaration, ManualClock(), random.Random(1))
        for _ in range(20):
            result = skill._result()
            assert result.code == "ok" or result.code in declaration.failures
            assert not result.succeeded or set(result.outputs) == set(declaration.outputs)
