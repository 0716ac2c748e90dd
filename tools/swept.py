"""Tables in the docs of what sweeps of the experiments in ``experiments/`` have shown.

``python tools/swept.py goto_user --write docs/notes/trials.md`` runs what is not in
``sweeps/goto_user.sqlite`` yet, as ``florence sweep experiments/goto_user.yaml`` does.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_sweep.experiment import DRAWN, DRAWN_TEXT, Experiment, load_experiment
from florence_sweep.outcome import Outcome
from florence_sweep.store import Results
from florence_sweep.summary import Table, comparisons_along, measures_of, reasons_of, table_of_experiment
from florence_sweep.sweeping import run_all

from florence_bt.core.errors import FlorenceError
from tools.tables import ROOT, RowTable, command_of, table

EXPERIMENTS = ROOT / "experiments"


def text_of(name: str, outcomes: Sequence[Outcome]) -> str:
    """Write what came of an experiment as Markdown: by what varied, along what is compared, and why not."""
    experiment = load_experiment(EXPERIMENTS / f"{name}.yaml")
    tables = (
        table_of_experiment(experiment, outcomes),
        measures_of(experiment, outcomes),
        *comparisons_along(experiment, outcomes),
        reasons_of(outcomes),
    )
    return "\n\n".join([*(_markdown(each) for each in tables if each[1]), _sum_of(experiment, outcomes)])


def _markdown(of: Table) -> str:
    head, lines = of
    return table(head, [[cell.replace("|", r"\|") for cell in line] for line in lines])


def _sum_of(experiment: Experiment, outcomes: Sequence[Outcome]) -> str:
    simulated, wall = sum(each.seconds for each in outcomes), sum(each.wall for each in outcomes)
    seeds = {each.seed for each in outcomes}
    total = (
        f"{len(outcomes)} runs on the seeds {min(seeds)} to {max(seeds)}: {simulated:.0f} simulated seconds "
        f"in {wall:.0f} seconds of runs, beside whatever else the machine did."
    )
    drawn = any(setup.detections == DRAWN for setup in experiment.variations.values())
    return f"{total} {DRAWN_TEXT}" if drawn else total


GOTO_USER = RowTable("goto_user", Outcome, partial(text_of, "goto_user"))
FOLLOW_ME = RowTable("follow_me", Outcome, partial(text_of, "follow_me"))
EXPLORE = RowTable("explore", Outcome, partial(text_of, "explore"))
TABLES = {each.name: each for each in (GOTO_USER, FOLLOW_ME, EXPLORE)}
"""Experiment -> its table; both have one name."""


def _small(experiment: Experiment) -> Experiment:
    """Return an experiment of seconds that goes through the same code."""
    few = dict(islice(experiment.variations.items(), 3))
    return replace(experiment, runs=1, variations={name: replace(of, limit=5.0) for name, of in few.items()})


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing and write the tables; exit code 2 when it cannot be run."""
    parser = argparse.ArgumentParser(description="Sweeps of experiments/, as tables in the docs")
    parser.add_argument("name", choices=TABLES, metavar="NAME", help=f"experiment: {', '.join(TABLES)}")
    parser.add_argument("--runs", type=int, help="runs of each variation, in place of the file's number")
    parser.add_argument("--results", type=Path, help="file of the runs, in place of sweeps/NAME.sqlite")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, each on a core")
    parser.add_argument("--small", action="store_true", help="some seconds of a few runs, kept nowhere")
    parser.add_argument(
        "--made-on", metavar="COMMIT", default="", help="the commit of the runs, where it is not this one"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    experiment = load_experiment(EXPERIMENTS / f"{given.name}.yaml")
    experiment = replace(experiment, runs=given.runs or experiment.runs)
    with tempfile.TemporaryDirectory() as folder:
        file = given.results or ROOT / "sweeps" / f"{given.name}.sqlite"
        if given.small:
            experiment, file = _small(experiment), Path(folder) / "small.sqlite"
        try:
            results = Results.of(experiment, file)
            run_all(experiment, results, given.jobs, "", partial(print, flush=True))
        except FlorenceError as error:
            print(error, file=sys.stderr)
            return 2
        outcomes = results.outcomes()
    command = command_of("tools/swept.py", arguments)
    TABLES[given.name].publish(outcomes, given.write, command, given.made_on)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
