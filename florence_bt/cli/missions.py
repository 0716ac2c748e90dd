"""Verbs about mission files: ``missions``, ``check``. They need neither ROS nor a robot."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FolderOption, app, errors_to_exit_codes
from florence_bt.cli.exit_codes import FAILED, OK


@app.command(rich_help_panel="Mission files", epilog=f"Example: florence missions\n\n{EXIT_CODES}")
def missions(
    folders: FolderOption = None,
    live: Annotated[bool, typer.Option("--live", help="Those of the running system instead.")] = False,
) -> None:
    """List the missions of this installation with what they take and give."""
    with errors_to_exit_codes():
        if live:
            from florence_bt.app.runs.remote import live_missions

            typer.echo(live_missions())
            return
        from florence_bt.app.mission_files.mission_list import list_missions

        known, wrong = list_missions(folders or [])
        typer.echo(known)
        if wrong:
            typer.echo(wrong, err=True)


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence check my_mission.yaml --hotspots flat.yaml --map map.yaml\n\n{EXIT_CODES}",
)
def check(
    files: Annotated[
        list[Path], typer.Argument(help="Mission files, folders of them, or - for the standard input.")
    ],
    folders: FolderOption = None,
    hotspots: Annotated[
        Path | None,
        typer.Option(
            help="Hotspots of the flat, to check labels against.",
            show_default="those of Florence's own flat; what they lack is a warning",
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option("--map", help="Map of the flat, to check hotspots and poses against."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Compare with the running system too: skills, missions, hotspots.")
    ] = False,
    form: Annotated[str, typer.Option("--format", help="text, json or github.")] = "text",
    strict: Annotated[bool, typer.Option("--strict", help="Warnings count as errors.")] = False,
    stdin_name: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The file that the standard input will become.")
    ] = None,
) -> None:
    """Check mission files: every problem at once, with file:line:column and what would have worked.

    Needs no robot, no ROS and no simulation. All errors and warnings are explained in docs/checking.md.
    """
    with errors_to_exit_codes():
        from florence_bt.app.mission_files.checking import CheckOptions, check_files

        options = CheckOptions(
            hotspots=hotspots,
            map_file=map_file,
            folders=tuple(folders or ()),
            form=form,
            strict=strict,
            colour=sys.stdout.isatty() and "NO_COLOR" not in os.environ,
            stdin_name=stdin_name,
            live=live,
        )
        report, errors = check_files(files, options)
        typer.echo(report)
        raise typer.Exit(FAILED if errors else OK)
