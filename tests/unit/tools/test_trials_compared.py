"""Runs of the same seeds against each other."""

from __future__ import annotations

from florence_bt.runtime.run import RunStatus
from tests.unit.tools.test_trials import trial
from tools.trials_compared import HEAD, line, pairs_of, table_of


def test_only_runs_of_the_same_class_and_seed_are_a_pair() -> None:
    before = [trial(seed=1), trial(seed=2), trial(seed=1, situation="lying")]
    changed = [trial(seed=1, status=RunStatus.FAILED), trial(seed=3), trial(seed=1, situation="sitting")]
    assert pairs_of(before, changed) == [(before[0], changed[0])]


def test_a_line_tells_how_often_something_holds_and_where_only_once() -> None:
    good, bad = trial(), trial(status=RunStatus.FAILED)
    pairs = [(good, good), (good, bad), (good, bad), (bad, good), (bad, bad)]
    told = line("some", pairs, lambda each: each.polite)
    assert told[:-1] == ["some", "5", "3", "2", "2", "1"]
    assert float(told[-1]) == 1.0
    assert len(told) == len(HEAD)
    assert "| some" not in table_of(pairs) and "approached politely | 5 | 3 | 2 | 2 | 1" in table_of(pairs)
