"""The command that this package adds to ``florence``."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, Verb, VerbList
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE
from florence_bt.core.errors import ConfigError

if TYPE_CHECKING:
    from florence_sweep.experiment import Experiment
    from florence_sweep.outcome import Outcome
    from florence_sweep.store import Results

app = VerbList()
_RESULTS = ".sqlite"
_MARK = b"<h1>"


@app.command(
    cls=Verb,
    rich_help_panel="Mission files",
    epilog="Examples: florence sweep goto_user --runs 20 --vary people=sitting,lying; "
    "florence sweep experiments/people.yaml --html people.html; "
    "florence sweep sweeps/new.sqlite --beside sweeps/old.sqlite\n\n" + EXIT_CODES,
)
def sweep(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT", help="An experiment file (YAML), a mission, or the results of a sweep (.sqlite)."
        ),
    ],
    runs: Annotated[
        int | None,
        typer.Option(min=1, help="Runs of each variation.", show_default="as the file says, or 10"),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,...", help="With a mission: what is varied, such as people=sitting,lying."
        ),
    ] = None,
    folders: FolderOption = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes.", show_default="one for each core")
    ] = None,
    dask: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Run on the workers of this Dask scheduler.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            click_type=OUTPUT_FILE,
            help="The results; a sweep that is there goes on.",
            show_default="sweeps/NAME.sqlite",
        ),
    ] = None,
    beside: Annotated[
        Path | None, typer.Option(help="Results of other code, or of another mission, on the same seeds.")
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option("--html", click_type=OUTPUT_FILE, help="Write a page, with pictures of the worst runs."),
    ] = None,
    case: Annotated[
        int | None, typer.Option(min=0, metavar="NUMBER", help="Run this one alone, and draw it.")
    ] = None,
) -> None:
    """Run a mission over many simulated homes, people, sensors and faults; tell what came of it."""
    from florence_sweep.store import Results
    from florence_sweep.sweeping import run_all

    results = Results(Path(what)) if what.endswith(_RESULTS) else None
    experiment = _experiment_in(results) if results is not None else _experiment(what, vary or [], folders)
    if runs is not None:
        experiment = replace(experiment, runs=runs)
    _check(experiment)
    if case is not None:
        raise typer.Exit(_run_one(experiment, case))
    if results is None:
        results = Results.of(experiment, out or Path("sweeps") / f"{experiment.name}{_RESULTS}")
        run_all(experiment, results, jobs or len(os.sched_getaffinity(0)), dask, typer.echo)
    other = Results(beside) if beside is not None else None
    _print_tables(experiment, results, other)
    if page is not None:
        _write_page(page, experiment, results, other)
    broken = [each for each in results.outcomes() if each.status == "BROKEN"]
    raise typer.Exit(FAILED if broken else OK)


def _check(experiment: Experiment) -> None:
    from florence_sweep.running import refuse_what_does_not_exist

    for setup in experiment.variations.values():
        refuse_what_does_not_exist(setup)


def _experiment(what: str, vary: list[str], folders: list[Path] | None) -> Experiment:
    """Read an experiment's file, or make one of a mission and what is varied.

    Raises:
        ConfigError: It is neither, or wrong.
    """
    from florence_sweep.experiment import load_experiment, read_experiment

    if what.endswith((".yaml", ".yml")):
        if vary or folders:
            valid = ["vary: and missions: in the file"]
            raise ConfigError("--vary and --missions go with the name of a mission", valid=valid)
        return load_experiment(Path(what))
    lines = [f"mission: {what}"]
    lines += [f"missions: {json.dumps([str(folder.resolve()) for folder in folders])}"] if folders else []
    lines += ["vary:"] if vary else []
    for each in vary:
        key, sign, values = each.partition("=")
        if not sign or not values:
            raise ConfigError(f"--vary {each} names no values", valid=["--vary people=sitting,lying"])
        lines.append(f"  {key}: [{values}]")
    return read_experiment("\n".join([*lines, ""]), Path(f"{what}.yaml"))


def _experiment_in(results: Results) -> Experiment:
    from florence_sweep.experiment import read_experiment

    experiment = read_experiment(results.experiment, results.place)
    seeds = [outcome.seed for outcome in results.outcomes()] or [experiment.seed]
    return replace(experiment, runs=max(seeds) - experiment.seed + 1)


def _run_one(experiment: Experiment, number: int) -> int:
    from florence_sweep.pictures import drawn
    from florence_sweep.sweeping import told

    cases = list(experiment.cases())
    if number >= len(cases):
        raise ConfigError(f"there is no run {number}", valid=[f"0 to {len(cases) - 1}"])
    file = Path("sweeps") / f"{experiment.name}_{number}.png"
    outcome = drawn(cases[number], file)
    typer.echo(f"{told(outcome)}\n{file}")
    return OK if outcome.good else FAILED


def _print_tables(experiment: Experiment, results: Results, beside: Results | None) -> None:
    from florence_sweep import summary
    from florence_sweep.experiment import DRAWN, DRAWN_TEXT

    outcomes = results.outcomes()
    tables = [
        summary.table_of_experiment(experiment, outcomes),
        summary.measures_of(experiment, outcomes),
        *summary.comparisons_along(experiment, outcomes),
    ]
    if beside is not None:
        typer.echo(f"first: {beside.file}, second: {results.file}")
        tables.append(summary.comparison_of(beside.outcomes(), outcomes))
    tables.append(summary.reasons_of(outcomes))
    for head, lines in tables:
        if lines:
            typer.echo("\n" + "\n".join(_aligned([head, *lines])))
    if any(setup.detections == DRAWN for setup in experiment.variations.values()):
        typer.echo(f"\n{DRAWN_TEXT}")
    typer.echo(f"\n{results.file}: {len(outcomes)} runs, table runs of SQLite")


def _aligned(lines: list[list[str]]) -> Iterable[str]:
    """Write the lines of a table with columns as wide as they must be."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        yield "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()


def _write_page(page: Path, experiment: Experiment, results: Results, beside: Results | None) -> None:
    from florence_bt.app.mission_files.output import write_output
    from florence_sweep.report import report

    def command(outcome: Outcome) -> str:
        return f"florence sweep {shlex.quote(str(results.file))} --case {outcome.number}"

    text = report(results, experiment, command, beside, typer.echo)
    write_output(page, text, make_folder=True, mark=_MARK)
    typer.echo(str(page))
