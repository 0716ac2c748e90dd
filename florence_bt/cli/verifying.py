"""Verbs about what is known of a mission before it moves a robot: ``verify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, app
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FOLDER


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence verify goto_user my_mission.yaml\n\n{EXIT_CODES}",
)
def verify(
    missions: Annotated[list[str], typer.Argument(help="Names of missions, mission files, folders of them.")],
    folders: FolderOption = None,
    details: Annotated[bool, typer.Option("--details", help="Show the longest run, too.")] = False,
    table: Annotated[bool, typer.Option("--table", help="Write a table in Markdown instead.")] = False,
    scenarios: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            click_type=OUTPUT_FOLDER,
            help="Write a scenario for each thing that is broken into this folder.",
        ),
    ] = None,
    limit: Annotated[
        float, typer.Option(min=1, help="Seconds for each mission, those that it calls apart.")
    ] = 30.0,
) -> None:
    """Prove what a mission does in every way in which it can go, or show the way in which it does not.

    Needs no robot, no ROS and no simulation. docs/manual/verify.md explains it.
    """
    from florence_bt.app.mission_files.verifying import VerifyOptions, verify_missions

    options = VerifyOptions(tuple(folders or ()), limit, details, table, scenarios)
    report, holds = verify_missions(missions, options)
    typer.echo(report)
    raise typer.Exit(OK if holds else FAILED)
