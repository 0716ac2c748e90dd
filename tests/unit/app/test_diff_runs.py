"""Two recorded runs: where they part, and why."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from florence_bt.app.runs.diff_runs import diff_runs
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.run import MissionRequest
from tests.unit.runtime.conftest import Bench


def run_with(bench, *, drive, work=None, acts=(), mission="drive_and_work"):
    """Run a mission with other skills; the id of the run."""
    bench.script(drive)
    bench.script_work(work or Step(success(pay=7), after=1.0))
    run = bench.executor.trigger(MissionRequest(mission))
    for seconds, act in acts:
        bench.clock.advance(seconds)
        getattr(bench.executor, act)("a visitor")
    bench.clock.advance(100.0)
    return run.run_id


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, log=Journal(tmp_path / "runs"))


@pytest.fixture
def diff(tmp_path):
    return lambda *run_ids: diff_runs(tmp_path / "runs", *run_ids)


def test_runs_that_do_the_same_at_other_times_do_not_part(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(after=7.5))
    same, text = diff(first, second)
    assert same and first in text and second in text


def test_the_first_thing_that_differs_is_told_with_its_reason_and_time(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(failure("blocked", "a chair"), after=3.0))
    same, text = diff(first, second)
    parted = text.partition("Then:")[2].splitlines()
    of_a, of_b = (next(line for line in parted if line.startswith(f"  {letter} ")) for letter in "AB")
    assert not same and "tick 2, 2.0 s" in of_a and "ok" in of_a
    assert "tick 2, 3.0 s" in of_b and "a chair" in of_b and "drive" in text


def test_a_skill_that_took_too_long_is_the_reason_of_its_node(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(None))
    _, text = diff(first, second)
    assert "timed_out" in text.partition("Then:")[2]


def test_what_people_did_parts_runs_too(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(after=2.0), acts=[(1.0, "stop")])
    same, text = diff(first, second)
    assert not same and "a visitor" in text.partition("Then:")[2]


def test_values_that_differ_before_are_told_and_part_nothing(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(after=2.0), work=Step(success(pay=9), after=1.0))
    same, text = diff(first, second)
    assert same and "pay=7" in text and "pay=9" in text


def test_another_mission_parts_at_once(bench, diff):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(after=2.0), mission="work_with_limit")
    assert not diff(first, second)[0]


def test_the_exit_code_tells_whether_they_part(bench, tmp_path):
    first = run_with(bench, drive=Step(after=2.0))
    second = run_with(bench, drive=Step(failure("blocked", "a chair"), after=3.0))
    codes = [
        CliRunner().invoke(app, ["diff", one, other, "--folder", str(tmp_path / "runs")]).exit_code
        for one, other in ((first, first), (first, second), (first, "no-such-run"))
    ]
    assert codes == [0, 1, 2]


def test_a_run_that_is_not_there_is_said(bench, diff):
    run_id = run_with(bench, drive=Step(after=2.0))
    with pytest.raises(ConfigError, match="nothing"):
        diff(run_id, "nothing")
