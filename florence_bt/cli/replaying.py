"""Verbs about recorded runs that are run again or compared: replay, diff."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, app, tell
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE
from florence_bt.core.errors import ConfigError

RunsFolder = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the runs.", show_default="the running system's, or the one used last below ./runs"
    ),
]


@app.command(
    rich_help_panel="Runs",
    epilog="Examples: florence replay; florence replay --check; "
    f"florence replay --check --missions my_missions\n\n{EXIT_CODES}",
)
def replay(
    run: Annotated[str, typer.Argument(help="A run's id.", show_default="the latest run")] = "",
    check: Annotated[
        bool,
        typer.Option("--check", help="Run the mission again on what its skills answered; say what differs."),
    ] = False,
    to_scenario: Annotated[
        Path | None,
        typer.Option(
            "--to-scenario", click_type=OUTPUT_FILE, help="Write a scenario that does what the run did."
        ),
    ] = None,
    missions: FolderOption = None,
    folder: RunsFolder = None,
) -> None:
    """Run a recorded mission again, on what its skills answered then, and show it step by step.

    In a terminal keys go forwards and backwards, and to the failures; elsewhere the steps are printed.
    """
    if check and to_scenario is not None:
        raise ConfigError("--check and --to-scenario are two commands", valid=["one of them"])
    if to_scenario is not None:
        from florence_bt.app.runs.run_to_scenario import run_to_scenario

        tell(run_to_scenario(folder, run, to_scenario, missions or ()))
        raise typer.Exit(OK)
    if check:
        from florence_bt.app.runs.check_run import check_run

        same, text = check_run(folder, run, missions or ())
        tell(text)
        raise typer.Exit(OK if same else FAILED)
    from rich.console import Console

    from florence_bt.app.runs.film import Film
    from florence_bt.app.runs.film_screen import show_film
    from florence_bt.app.runs.recorded_mission import read_recorded_mission

    show_film(Film(read_recorded_mission(folder, run, missions or ())), Console())


@app.command(
    rich_help_panel="Runs",
    epilog="Example: florence diff 20240501T101500Z-003-goto_user 20240501T111500Z-004-goto_user\n\n"
    f"{EXIT_CODES}",
)
def diff(
    first: Annotated[str, typer.Argument(metavar="RUN", help="A run's id.")],
    second: Annotated[str, typer.Argument(metavar="RUN", help="Another run's id.")],
    folder: RunsFolder = None,
) -> None:
    """Say where two recorded runs part, and why."""
    from florence_bt.app.runs.diff_runs import diff_runs

    same, text = diff_runs(folder, first, second)
    tell(text)
    raise typer.Exit(OK if same else FAILED)
