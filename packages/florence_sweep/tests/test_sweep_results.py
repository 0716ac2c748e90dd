"""The file of results: runs that are there stay, and those of other experiments or code do not mix."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest
from florence_sweep import store
from florence_sweep.experiment import Experiment, read_experiment
from florence_sweep.store import Results

from florence_bt.core.errors import ConfigError
from packages.florence_sweep.tests.case_work import at_once


def experiment(text: str = "mission: goto_user\n") -> Experiment:
    return read_experiment(text, Path("round.yaml"))


def test_what_is_written_is_read_again_with_every_number_as_it_was(tmp_path: Path) -> None:
    results = Results.of(experiment(), tmp_path / "new" / "round.sqlite")
    (case, *_) = experiment().cases()
    outcome = replace(
        at_once(case),
        contacts=("books", "a lamp's foot"),
        distance=0.1 + 0.2,
        polite=False,
        visible=True,
        wall=1.5,
    )
    results.add(outcome)
    assert Results(results.file).outcomes() == [outcome]


def test_a_run_that_is_there_is_not_written_twice(tmp_path: Path) -> None:
    results = Results.of(experiment(), tmp_path / "round.sqlite")
    (case, *_) = experiment().cases()
    results.add(at_once(case))
    results.add(replace(at_once(case), reason="another time"))
    assert [each.reason for each in results.outcomes()] == [""]


@pytest.mark.parametrize("line", ["seed: 2", "people: lying", "vary: {battery: [20 %]}"])
def test_results_of_another_experiment_are_left_alone(line: str, tmp_path: Path) -> None:
    results = Results.of(experiment(), tmp_path / "round.sqlite")
    with pytest.raises(ConfigError, match=r"another experiment.*--out"):
        Results.of(experiment(f"mission: goto_user\n{line}\n"), results.file)
    assert Results(results.file).experiment == experiment().text


def test_runs_of_other_code_do_not_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "round.sqlite"
    results = Results.of(experiment(), file)
    results.refuse_other_code()
    monkeypatch.setattr(store, "code_version", lambda: "0.0.1 abc")
    with pytest.raises(ConfigError, match=r"other code.*--out"):
        results.refuse_other_code()


def test_what_is_good_and_compared_can_change_without_running_anything_again(tmp_path: Path) -> None:
    before = experiment("mission: goto_user\n")
    results = Results.of(before, tmp_path / "round.sqlite")
    for case in before.cases():
        results.add(replace(at_once(case), contacts=("lamp",) if case.number % 2 else ()))
    changed = experiment("mission: goto_user\nruns: 12\ngood: [untouched]  # alone\n")
    again = Results.of(changed, results.file)
    assert [each.good for each in again.outcomes()] == [True, False] * 5
    assert Results(results.file).experiment == changed.text


@pytest.mark.parametrize("content", [b"", b"no database", None])
def test_what_is_no_file_of_results_is_told(tmp_path: Path, content: bytes | None) -> None:
    file = tmp_path / "odd.sqlite"
    if content is None:
        with sqlite3.connect(file) as database:
            database.execute("CREATE TABLE other (a)")
    else:
        file.write_bytes(content)
    with pytest.raises(ConfigError, match=r"odd\.sqlite: is no file of results"):
        Results(file)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no such file"):
        Results(tmp_path / "none.sqlite")
