"""The experiments of the repository, and their tables in the docs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from florence_sweep.experiment import Experiment, load_experiment
from florence_sweep.outcome import Outcome, judged
from florence_sweep.running import refuse_what_does_not_exist, without_run

from tools.swept import EXPERIMENTS, TABLES, text_of

FILES = sorted(EXPERIMENTS.glob("*.yaml"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_an_experiment_names_what_exists_and_has_its_table(file: Path) -> None:
    experiment = load_experiment(file)
    for setup in experiment.variations.values():
        refuse_what_does_not_exist(setup)
    assert experiment.name == file.stem and experiment.name in TABLES


def test_a_text_has_what_came_of_it_what_is_compared_why_not_and_the_seeds() -> None:
    experiment = replace(load_experiment(EXPERIMENTS / "goto_user.yaml"), runs=2)
    text = text_of("goto_user", outcomes_of(experiment))
    assert text.startswith("| with links=at_once and detections=network | runs | good |")
    assert "| people=nobody | 2 | 2 of 2 (34 to 100 %) |" in text
    assert "| links=late beside links=at_once |" in text
    assert "| good with detections=drawn | 16 of 16 (81 to 100 %) | 0 of 16 (0 to 19 %) | 0 | 16 |" in text
    assert r"| touched a \| b" in text, "a bar in a cell is none of the table"
    assert "64 runs on the seeds 995001 to 995002: 640 simulated seconds" in text
    assert "was drawn from how often it was right" in text


def outcomes_of(experiment: Experiment) -> list[Outcome]:
    """Outcomes of which each one with late messages has touched something."""
    found: list[Outcome] = []
    for case in experiment.cases():
        status = "FAILED" if case.setup.people == "nobody" else "SUCCEEDED"
        polite = None if case.setup.people == "nobody" else True
        outcome = replace(without_run(case, status, ""), seconds=10.0, polite=polite)
        touched = ("a | b",) if case.setup.links else ()
        found.append(judged(replace(outcome, contacts=touched), case.setup.good))
    return found
