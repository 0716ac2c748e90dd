"""Shares with their intervals, and whether two sweeps differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from florence_sweep.outcome import NOT_RUN, Outcome
from florence_sweep.statistics import mcnemar, wilson
from florence_sweep.summary import compared, comparison_of, reasons_of, table_of, worst_of
from scipy import stats

from packages.florence_sweep.tests.case_work import at_once, cases


@pytest.mark.parametrize(("hits", "of"), [(0, 10), (18, 20), (10, 10), (161, 200), (1, 3)])
def test_the_interval_is_that_of_the_literature(hits: int, of: int) -> None:
    expected = stats.binomtest(hits, of).proportion_ci(0.95, "wilson")
    assert wilson(hits, of) == pytest.approx((expected.low, expected.high))


def test_nothing_tried_says_nothing() -> None:
    assert wilson(0, 0) == (0.0, 1.0) and mcnemar(0, 0) == 1.0


@pytest.mark.parametrize(("gained", "lost"), [(26, 18), (10, 1), (0, 6), (5, 5)])
def test_pairs_that_differ_are_judged_by_the_binomial_test(gained: int, lost: int) -> None:
    assert mcnemar(gained, lost) == pytest.approx(stats.binomtest(gained, gained + lost).pvalue)


def outcomes(good: str) -> list[Outcome]:
    """One for each letter: good, bad, or not run."""
    of = [at_once(case) for case in cases(len(good))]
    states = {"g": {}, "b": {"good": False, "status": "FAILED", "code": "lost"}, "n": {"status": NOT_RUN}}
    return [replace(each, **states[letter]) for each, letter in zip(of, good, strict=True)]


def test_pairs_are_those_of_one_seed_that_both_have_run() -> None:
    found = compared(outcomes("ggbbgn"), outcomes("gbgbng")[::-1], lambda each: each.seed)
    assert (found.both, found.gained, found.lost, found.neither) == (1, 1, 1, 1)


def test_the_most_frequent_reason_comes_first_with_a_run_to_look_at() -> None:
    of = outcomes("gbbgb")
    of[4] = replace(of[4], contacts=("lamp",))
    _, lines = reasons_of(of)
    assert [line[:3] for line in lines] == [
        ["2", "FAILED lost", "1"],
        ["1", "touched lamp; FAILED lost", "4"],
    ]


def test_the_run_that_touched_is_worse_than_one_that_failed_and_good_ones_are_not_shown() -> None:
    of = outcomes("bgbn")
    of[2] = replace(of[2], contacts=("lamp",))
    assert [each.number for each in worst_of(of)] == [2, 0]


def test_tables_count_what_was_run() -> None:
    rng = np.random.default_rng(1)
    of = [
        replace(each, variation=name)
        for name in ("a", "b")
        for each in outcomes("".join(rng.choice(list("gbn"), 50)))
    ]
    _, lines = table_of(of)
    assert [line[0] for line in lines] == ["a", "b", "all"]
    run = [each for each in of if each.status != NOT_RUN]
    assert lines[-1][1].startswith(f"{sum(each.good for each in run)} of {len(run)} ")
    _, sides = comparison_of(of, of)
    assert all(line[3:5] == ["0", "0"] for line in sides) and len(sides) == 3
