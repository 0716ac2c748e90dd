"""Verbs about what is known of a mission before it moves a robot: ``verify`` and ``mutate``."""

from __future__ import annotations

import os
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


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence mutate my_mission.yaml --write\n\n{EXIT_CODES}",
)
def mutate(
    mission: Annotated[str, typer.Argument(help="The name of a mission, or its file.")],
    folders: FolderOption = None,
    scenarios: Annotated[
        list[str] | None,
        typer.Option(metavar="PATH", help="A scenario file, or a folder of them (may be repeated)."),
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Add scenarios that notice what nobody notices.")
    ] = False,
    limit: Annotated[
        float, typer.Option(min=1, help="Seconds for which the verifier looks at one change.")
    ] = 10.0,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Changes that are looked at at a time; all cores by default.")
    ] = None,
) -> None:
    """Change a mission in small ways, and show which changes neither scenarios nor properties notice.

    Needs no robot, no ROS and no simulation. docs/manual/mutate.md explains it.
    """
    from florence_bt.app.mission_files.mutating import MutateOptions, mutate_mission

    cores = jobs or os.cpu_count() or 1
    options = MutateOptions(tuple(folders or ()), tuple(map(Path, scenarios or ())), limit, cores, write)
    report, all_noticed = mutate_mission(mission, options)
    typer.echo(report)
    raise typer.Exit(OK if all_noticed else FAILED)
