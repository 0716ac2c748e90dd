"""Experiments: what their files say, and what is told of mistakes."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from florence_sweep.experiment import Experiment, SkillFault, read_experiment

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.rig.wires import Link

FILE = Path("experiments/people.yaml")


def read(text: str) -> Experiment:
    return read_experiment(text, FILE)


def test_a_mission_alone_is_an_experiment() -> None:
    experiment = read("mission: goto_user\n")
    assert (experiment.name, experiment.runs, experiment.seed) == ("people", 10, 1)
    assert [case.seed for case in experiment.cases()] == list(range(1, 11))
    assert {case.variation for case in experiment.cases()} == {""}


def test_every_combination_of_what_varies_has_the_same_seeds_one_seed_after_the_other() -> None:
    experiment = read(
        """
mission: goto_user
runs: 2
seed: 7
vary:
  people: [sitting, lying]
  links:
    perfect: {}
    late: {links: {/tf: {delay: 150 ms}}}
"""
    )
    cases = list(experiment.cases())
    assert [case.number for case in cases] == list(range(8))
    assert [case.seed for case in cases] == [7] * 4 + [8] * 4
    assert [case.variation for case in cases[:4]] == [
        "people=sitting, links=perfect",
        "people=sitting, links=late",
        "people=lying, links=perfect",
        "people=lying, links=late",
    ]
    assert [case.setup.people for case in cases[:4]] == ["sitting"] * 2 + ["lying"] * 2
    assert cases[1].setup.links == {"/tf": Link(delay=0.15)} and not cases[2].setup.links


def test_a_run_has_a_value_of_each_factor_and_some_factors_are_compared() -> None:
    text = "mission: goto_user\nvary: {people: [easy, lying], battery: [20 %, 90 %]}\ncompare: "
    experiment = read(f"{text}battery\n")
    assert experiment.factors == {
        "people": ("people=easy", "people=lying"),
        "battery": ("battery=20 %", "battery=90 %"),
    }
    assert experiment.values()["people=lying, battery=20 %"] == ("people=lying", "battery=20 %")
    assert list(experiment.values()) == list(experiment.variations)
    assert experiment.compare == ("battery",)
    assert read(f"{text}[battery, people]\n").compare == ("battery", "people")


def test_more_runs_leave_the_numbers_of_the_others_alone() -> None:
    text = "mission: goto_user\nruns: {}\nvary: {{people: [sitting, lying]}}\n"
    few, more = (list(read(text.format(runs)).cases()) for runs in (2, 5))
    assert more[: len(few)] == few


def test_all_that_a_run_can_be_set_up_with() -> None:
    setup = read(
        """
experiment: everything
description: All of it.
mission: patrol
inputs: {rooms: "kitchen, hall"}
home: flat
people: nobody
limit: 2 min
battery: 25 %
links: {scan: {delay: 0.1 s, drops: 5 %}, "*": {silent_from: 3 s, silent_for: 2 s}}
sensors: {base: {slip_sigma: 0.01}, kinect: {raw_noise: 1.2, pitch: 2}}
faults: [{skill: navigate_to, code: blocked, from: 10 s, for: 5 s}, {skill: say, code: unavailable}]
detections: drawn
good: [failed, untouched]
"""
    ).variations[""]
    assert (setup.limit, setup.battery, setup.home, setup.people) == (120.0, 0.25, "flat", "nobody")
    assert setup.links["scan"] == Link(delay=0.1, drops=0.05)
    assert setup.links["*"] == Link(silent_from=3.0, silent_for=2.0)
    assert setup.detections == "drawn"
    assert setup.sensors == {"base": {"slip_sigma": 0.01}, "kinect": {"raw_noise": 1.2, "pitch": 2.0}}
    assert setup.faults == (
        SkillFault("navigate_to", "blocked", 10.0, 5.0),
        SkillFault("say", "unavailable", 0.0, math.inf),
    )
    assert setup.good == ("failed", "untouched") and setup.inputs == {"rooms": "kitchen, hall"}


@pytest.mark.parametrize(
    ("line", "place", "works"),
    [
        ("peple: sitting", "2:1", "people"),
        ("runs: 0", "2:7", "1 or more"),
        ("runs: 2.5", "2:7", "whole"),
        ("limit: 10", "2:8", "10 s"),
        ("battery: 120 %", "2:10", "20 %"),
        ("links: {scan: {dely: 1 s}}", "2:16", "delay"),
        ("links: {scan: {delay: -1 s}}", "2:23", "10 s"),
        ("sensors: {laser: {noise: 3}}", "2:19", "noise_mm"),
        ("sensors: {lazer: {}}", "2:11", "laser"),
        ("faults: [{skill: say}]", "2:10", "code: ..."),
        ("detections: drwn", "2:13", "drawn"),
        ("good: [suceeded]", "2:8", "succeeded"),
        ("vary: [sitting]", "2:7", "vary: {people"),
        ("vary: {people: []}", "2:8", "people: [A, B]"),
        ("vary: {people: {}}", "2:8", "people: [A, B]"),
        ("vary: {peple: [sitting]}", "2:8", "people"),
        ("vary: {who: {a: {peple: sitting}}}", "2:18", "people"),
        ("compare: people", "2:10", "factor of vary cannot be"),
        ("vary: {people: [easy]}\ncompare: peple", "3:10", "people"),
        ("home: nowhere.yaml", "2:7", "generated"),
    ],
)
def test_a_mistake_is_told_with_its_place_and_what_works(line: str, place: str, works: str) -> None:
    with pytest.raises(ConfigError) as told:
        read(f"mission: goto_user\n{line}\n")
    assert f"people.yaml:{place}:" in str(told.value) and works in str(told.value)


def test_all_mistakes_are_told_at_once() -> None:
    with pytest.raises(ConfigError) as told:
        read("runs: no\nlimit: 5\ngood: [nice]\n")
    assert len(told.value.mistakes) == 4, "the mission is missing, too"
