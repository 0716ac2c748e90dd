"""Verdicts on runs: who was met, who was a mistake, and what is good."""

from __future__ import annotations

from dataclasses import replace

import pytest
from florence_sweep.best_case import BestCase
from florence_sweep.experiment import Case, Setup
from florence_sweep.outcome import is_false, is_polite, judged, met
from florence_sweep.running import run_case

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.closeness import Closeness
from florence_bt.simulation.home.person import PersonSpec
from packages.florence_sweep.tests.case_work import at_once, cases

STANDING = PersonSpec("user", Pose2(1.0, 1.0))
WALKING = PersonSpec("other", Pose2(1.0, 1.0), "walking", ((9.0, 1.0),))


@pytest.mark.parametrize(
    ("end", "best", "polite"),
    [
        (Closeness(0.52, 0.1), BestCase(True, 0.5, 4.5), True),
        (Closeness(0.62, 0.1), BestCase(True, 0.5, 4.5), False),
        (Closeness(0.52, 0.5), BestCase(True, 0.5, 4.5), False),
        (Closeness(0.85, 0.1), BestCase(True, 0.9, 4.5), True),
        (Closeness(0.52, 0.1), BestCase(True, 0.9, 4.5), True),
        (Closeness(1.02, 0.1), BestCase(True, 0.9, 4.5), False),
        (Closeness(0.38, 0.1), BestCase(True, 0.9, 4.5), False),
        (Closeness(0.52, 0.1), BestCase(True, None, None), True),
        (Closeness(0.8, 0.1), BestCase(True, None, None), False),
    ],
)
def test_polite_is_half_a_metre_or_as_near_as_a_robot_gets_and_a_look_at_them(
    end: Closeness, best: BestCase, polite: bool
) -> None:
    assert is_polite(end, best) is polite


@pytest.mark.parametrize(
    ("changes", "criteria", "good"),
    [
        ({"polite": True}, ("succeeded", "polite", "untouched", "no_false_find"), True),
        ({"polite": False}, ("succeeded", "polite"), False),
        ({"polite": None}, ("polite",), False),
        ({"polite": True, "status": "FAILED"}, ("succeeded", "polite"), False),
        ({"contacts": ("sofa",)}, ("succeeded",), True),
        ({"contacts": ("sofa",)}, ("succeeded", "untouched"), False),
        ({"status": "FAILED"}, ("failed", "no_false_find"), True),
        ({"status": "FAILED", "false_find": True}, ("failed", "no_false_find"), False),
        ({"status": "STOPPED"}, ("failed",), False),
        ({"status": "BROKEN"}, ("untouched",), False),
        ({"status": "NOT_RUN"}, (), False),
    ],
)
def test_good_is_all_that_is_asked_for(
    changes: dict[str, object], criteria: tuple[str, ...], good: bool
) -> None:
    outcome = replace(at_once(cases(1)[0]), **changes)  # type: ignore[arg-type]
    assert judged(outcome, criteria).good is good


@pytest.mark.parametrize(
    ("found", "people", "false"),
    [
        (Pose2(1.0, 1.0), [], True),
        (Pose2(1.5, 1.0), [STANDING], False),
        (Pose2(2.5, 1.0), [STANDING], True),
        (Pose2(5.0, 1.5), [WALKING], False),
        (Pose2(5.0, 2.5), [WALKING], True),
        (Pose2(5.0, 1.5), [STANDING, WALKING], False),
        (Pose2(5.0, 2.5), [STANDING, WALKING], True),
    ],
)
def test_a_find_is_false_where_nobody_has_ever_been(
    found: Pose2, people: list[PersonSpec], false: bool
) -> None:
    assert is_false(found, people) is false


@pytest.mark.parametrize(
    ("ends", "who"),
    [
        ({"user": Closeness(0.62, 0.0), "visitor": Closeness(0.61, 1.6)}, "user"),
        ({"user": Closeness(1.5, 0.0), "visitor": Closeness(0.61, 1.6)}, "visitor"),
        ({}, ""),
    ],
)
def test_who_came_up_to_the_robot_is_not_whom_it_met(ends: dict[str, Closeness], who: str) -> None:
    best_cases = {"user": BestCase(True, 0.6, 4.5), "visitor": BestCase(True, 0.5, 4.5)}
    assert met(ends, best_cases) == who


@pytest.mark.slow
def test_a_run_to_somebody_easy_to_find_is_good_and_takes_some_times_the_ideal() -> None:
    setup = Setup("goto_user", home="flat", people="easy", good=("succeeded", "polite", "untouched"))
    outcome = run_case(Case(0, "", 1, setup))
    assert outcome.good and outcome.visible and outcome.ideal
    assert 1.0 < outcome.seconds / outcome.ideal < 20.0


@pytest.mark.slow
def test_of_a_company_all_are_told() -> None:
    outcome = run_case(Case(0, "", 1, Setup("goto_user", people="company", limit=5.0)))
    assert outcome.people.count(";") in (1, 2)
