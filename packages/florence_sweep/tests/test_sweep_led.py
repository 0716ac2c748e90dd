"""Verdicts on who follows a person, on made-up tracks, and a run in which the robot stands."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from florence_sweep.experiment import Case, Setup, read_experiment
from florence_sweep.led import Sample, measures, watch
from florence_sweep.outcome import KEPT, Outcome, judged
from florence_sweep.running import run_case
from florence_sweep.store import Results
from florence_sweep.summary import measures_of, why

from florence_bt.app.demo.rigs import make_rig
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.situations import led_walk
from packages.florence_sweep.tests.case_work import at_once


def track(
    *leader: float, visitor: float = 5.0, running: bool = True, after: tuple[float, ...] = (1.0,)
) -> list[Sample]:
    """Samples of a walk and of what follows it."""
    walk = [Sample(distance, visitor, True, running) for distance in leader]
    return walk + [Sample(distance, visitor, False, running) for distance in after]


def test_who_keeps_one_metre_is_kept_without_an_error() -> None:
    found = measures(track(1.0, 1.0, 1.0))
    assert found["walk over"] and found[KEPT] and not found["followed the other"]
    assert (found["mean error (m)"], found["times lost"], found["lost (s)"]) == (0.0, 0, 0.0)
    assert (found["smallest distance (m)"], found["to the other person (m)"]) == (1.0, 5.0)


def test_the_error_counts_both_ways_and_only_during_the_walk() -> None:
    found = measures(track(0.8, 1.4, after=(0.5, 9.0)))
    assert found["mean error (m)"] == pytest.approx(0.3) and found["smallest distance (m)"] == 0.5


@pytest.mark.parametrize(
    ("samples", "over", "kept"),
    [
        (track(1.0, 1.0, after=(3.0, 1.4)), True, True),
        (track(1.0, 1.0, after=(3.0, 1.6)), True, False),
        (track(1.0, 1.0, running=False), True, False),
        (track(1.0, 1.0, after=()), False, False),
    ],
)
def test_kept_means_near_and_running_when_the_walk_is_over(
    samples: list[Sample], over: bool, kept: bool
) -> None:
    found = measures(samples)
    assert (found["walk over"], found[KEPT]) == (over, kept)


def test_each_time_the_person_gets_far_is_a_loss() -> None:
    found = measures(track(2.1, 2.2, 1.0, 2.5, 1.9, after=(5.0,)))
    assert found["times lost"] == 2 and found["lost (s)"] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("leader", "visitor", "followed"), [(1.0, 1.2, False), (4.0, 1.2, True), (4.0, 1.6, False)]
)
def test_whoever_else_is_nearest_in_the_end_was_followed(
    leader: float, visitor: float, followed: bool
) -> None:
    assert measures(track(1.0, visitor=visitor, after=(leader,)))["followed the other"] is followed


def led(case: Case, *samples: Sample) -> Outcome:
    outcome = replace(at_once(case), status="STOPPED", measures=measures(samples))
    return judged(outcome, ("kept", "untouched"))


def test_measures_are_kept_with_the_run_and_have_a_table_of_their_own(tmp_path: Path) -> None:
    experiment = read_experiment("mission: follow_me\nruns: 2\npeople: leading\n", tmp_path / "walks.yaml")
    results = Results.of(experiment, tmp_path / "walks.sqlite")
    good, lost = experiment.cases()
    results.add(led(good, *track(1.0, 1.2)))
    results.add(led(lost, *track(3.0, after=(9.0,))))
    outcomes = results.outcomes()
    assert [each.good for each in outcomes] == [True, False]
    assert why(outcomes[1]) == "was not with the person in the end"
    head, ((_, *cells),) = measures_of(experiment, outcomes)
    found = dict(zip(head[1:], cells, strict=True))
    assert found[KEPT] == "1 of 2 (9 to 91 %)" and found["mean error (m)"] == "1.05 (0.10 to 2.00)"
    assert measures_of(experiment, [replace(each, measures={}) for each in outcomes])[1] == []


@pytest.mark.slow
def test_a_robot_that_stands_still_loses_the_person() -> None:
    flat = load_flat()
    walk = led_walk(flat, np.random.default_rng(1), 8.0)
    rig = make_rig(person=walk.leader, others=[walk.visitor], start=walk.start, flat=flat)
    samples = watch(
        rig, walk, MissionRun("x", MissionRequest("follow_me"), {}, RunStatus.RUNNING), limit=600.0
    )
    assert samples[0].leader == pytest.approx(1.2, abs=0.06)
    found = measures(samples)
    assert found["walk over"] and not found[KEPT]
    assert found["times lost"] >= 1 and found["lost (s)"] > 1.0


@pytest.mark.slow
def test_a_walk_that_is_not_over_in_time_is_stopped_and_not_kept() -> None:
    setup = Setup("follow_me", home="flat", people="leading", limit=8.0, good=("kept",))
    outcome = run_case(Case(0, "", 1, setup))
    assert outcome.status == "STOPPED" and outcome.polite is None and not outcome.good
    assert outcome.measures["walk over"] is False and outcome.measures["smallest distance (m)"] < 1.5
