"""Shares with their intervals, and whether two sweeps differ."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from florence_sweep.experiment import Experiment, read_experiment
from florence_sweep.outcome import NOT_RUN, Outcome
from florence_sweep.statistics import mcnemar, wilson
from florence_sweep.summary import (
    chance,
    compared,
    comparison_of,
    comparisons_along,
    pairs_of,
    reasons_of,
    table_of,
    table_of_experiment,
    worst_of,
)
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
    found = compared(pairs_of(outcomes("ggbbgn"), outcomes("gbgbng")[::-1], lambda each: each.seed))
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
    assert lines[-1][1] == str(len(run)) and lines[-1][2].startswith(
        f"{sum(each.good for each in run)} of {len(run)} "
    )
    _, sides = comparison_of(of, of)
    assert all(line[3:5] == ["0", "0"] for line in sides) and len(sides) == 3


FACTORS = """
mission: goto_user
runs: 2
good: [succeeded, untouched]
vary:
  people:
    easy: {people: easy}
    nobody: {people: nobody, good: [failed]}
  links:
    at_once: {}
    late: {links: {scan: {delay: 1 s}}}
    later: {links: {scan: {delay: 2 s}}}
"""


def of_factors(text: str, good: str) -> tuple[Experiment, list[Outcome]]:
    """Outcomes of an experiment, a letter for each run as above."""
    experiment = read_experiment(text, Path("factors.yaml"))
    of = [
        replace(each, variation=case.variation, seed=case.seed)
        for case, each in zip(experiment.cases(), outcomes(good.replace(" ", "")), strict=True)
    ]
    return experiment, of


def test_each_value_of_a_factor_counts_over_the_values_of_the_others() -> None:
    experiment, of = of_factors(FACTORS, "gbb ggn gbb bgb")
    _, lines = table_of_experiment(experiment, of)
    assert [(line[0], line[1], line[2].partition(" (")[0]) for line in lines] == [
        ("people=easy", "6", "2 of 6"),
        ("people=nobody", "5", "3 of 5"),
        ("links=at_once", "4", "3 of 4"),
        ("links=late", "4", "2 of 4"),
        ("links=later", "3", "0 of 3"),
        ("all", "11", "5 of 11"),
    ]


def test_a_factor_that_is_compared_keeps_its_first_value_in_the_table_of_the_others() -> None:
    experiment, of = of_factors(FACTORS + "compare: links\n", "gbb ggn gbb bgb")
    head, lines = table_of_experiment(experiment, of)
    assert head[0] == "with links=at_once"
    assert [(line[0], line[2].partition(" (")[0]) for line in lines] == [
        ("people=easy", "2 of 2"),
        ("people=nobody", "1 of 2"),
        ("all", "3 of 4"),
    ]


def test_values_are_beside_the_first_with_the_same_seed_and_the_other_factors_equal() -> None:
    experiment, of = of_factors(FACTORS, "gbb ggn gbb bgb")
    ((_, lines),) = comparisons_along(experiment, of)
    assert [(line[0], *line[3:5]) for line in lines] == [
        ("people=nobody beside people=easy", "2", "1"),
        ("links=late beside links=at_once", "1", "2"),
        ("links=later beside links=at_once", "0", "2"),
    ]


def test_a_factor_that_is_compared_is_shown_by_what_is_asked_and_by_the_other_factors() -> None:
    experiment, of = of_factors(FACTORS + "compare: links\n", "gbb ggn gbb bgb")
    (head, lines), (_, later) = comparisons_along(experiment, of)
    assert head[0] == "links=late beside links=at_once"
    assert [(line[0], *line[3:5]) for line in lines] == [
        ("good", "1", "2"),
        ("succeeded", "0", "2"),  # of the runs with people alone: with nobody they are to fail
        ("untouched", "0", "0"),
        ("failed", "0", "1"),
        ("good with people=easy", "0", "2"),
        ("good with people=nobody", "1", "0"),
    ]
    assert later[0][1].startswith("2 of 3")


def test_what_has_no_run_yet_has_no_line() -> None:
    experiment, of = of_factors(FACTORS, "gbb ggn gbb bgb")
    begun = of[:2]
    assert [line[0] for line in table_of_experiment(experiment, begun)[1]] == [
        "people=easy", "links=at_once", "links=late", "all",
    ]  # fmt: skip
    ((_, lines),) = comparisons_along(experiment, begun)
    assert [line[0] for line in lines] == ["links=late beside links=at_once"]


def test_without_anything_varied_nothing_is_compared() -> None:
    experiment, of = of_factors("mission: goto_user\nruns: 2\n", "gb")
    assert comparisons_along(experiment, of) == []
    assert [line[0] for line in table_of_experiment(experiment, of)[1]] == ["runs"]


@pytest.mark.parametrize(
    ("probability", "told"),
    [(1.0, "100 %"), (0.38, "38 %"), (0.042, "4.2 %"), (0.001, "0.1 %"), (0.0004, "below 0.1 %")],
)
def test_a_small_chance_is_not_told_as_none(probability: float, told: str) -> None:
    assert chance(probability) == told
