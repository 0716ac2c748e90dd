"""Processes that do the runs of a sweep, and what becomes of the runs when they die."""

from pathlib import Path

import pytest
from florence_sweep.outcome import BROKEN
from florence_sweep.workers import by_processes

from packages.florence_sweep.tests.case_work import at_once, cases, third_dies, third_dies_once


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_every_case_is_run_once(jobs: int) -> None:
    outcomes = sorted(by_processes(cases(9), jobs, at_once), key=lambda each: each.number)
    assert [each.number for each in outcomes] == list(range(9))
    assert all(each.good and each.seconds == each.seed / 3.0 for each in outcomes)


@pytest.mark.slow
def test_a_process_that_dies_takes_no_other_run_along(tmp_path: Path) -> None:
    outcomes = list(by_processes(cases(8, str(tmp_path / "died")), 2, third_dies_once))
    assert sorted(each.number for each in outcomes) == list(range(8))
    assert all(each.good for each in outcomes)


@pytest.mark.slow
def test_a_run_that_kills_its_process_each_time_is_told_and_the_others_go_on() -> None:
    outcomes = {each.number: each for each in by_processes(cases(8), 2, third_dies)}
    assert sorted(outcomes) == list(range(8))
    assert [number for number, each in outcomes.items() if each.status == BROKEN] == [3]
    assert "dies" in outcomes[3].reason
