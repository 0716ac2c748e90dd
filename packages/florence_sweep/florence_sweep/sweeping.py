"""Runs what an experiment has not run yet, and writes each run when it is over."""

from __future__ import annotations

import time
from collections.abc import Callable

from florence_sweep.experiment import Experiment
from florence_sweep.outcome import Outcome
from florence_sweep.store import Results
from florence_sweep.summary import why
from florence_sweep.workers import by_dask, by_processes


def run_all(
    experiment: Experiment, results: Results, jobs: int, dask: str, say: Callable[[str], None]
) -> None:
    """Run what is not there yet, and write each run when it is over.

    Args:
        experiment: What is run.
        results: Where it is written.
        jobs: Processes of this machine.
        dask: The scheduler of a Dask cluster that runs it in their place; empty for none.
        say: Told of each run in a line.

    Raises:
        ConfigError: The runs that are there are of other code.
        FlorenceError: No cluster answers.
    """
    there = {outcome.number for outcome in results.outcomes()}
    cases = list(experiment.cases())
    todo = [case for case in cases if case.number not in there]
    if todo:
        results.refuse_other_code()
    if there and todo:
        say(f"{len(there)} of {len(cases)} runs are there; the others follow")
    outcomes = by_dask(todo, dask) if dask else by_processes(todo, jobs)
    began = time.monotonic()
    for done, outcome in enumerate(outcomes, 1):
        results.add(outcome)
        seconds = time.monotonic() - began
        left = seconds / done * (len(todo) - done)
        pace = f"{60.0 * done / seconds:.0f} a minute, {_time(left)} left"
        say(f"[{len(there) + done}/{len(cases)}] {told(outcome)}; {pace}")


def told(outcome: Outcome) -> str:
    """Write one run in a line."""
    what = ", ".join(filter(None, [outcome.variation, f"seed {outcome.seed}"]))
    away = f", {outcome.distance:.2f} m away" if outcome.distance is not None else ""
    verdict = "good" if outcome.good else f"not good ({why(outcome)})"
    return f"{what}: {verdict}{away}, {outcome.seconds:.0f} s"


def _time(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{seconds:.0f} s"
