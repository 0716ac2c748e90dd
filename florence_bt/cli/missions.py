"""Verbs about mission files: missions, check, draw, schema. They need no ROS and no robot."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, RosVerb, app, tell
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE


@app.command(
    cls=RosVerb, rich_help_panel="Mission files", epilog=f"Example: florence missions\n\n{EXIT_CODES}"
)
def missions(
    folders: FolderOption = None,
    live: Annotated[bool, typer.Option("--live", help="Those of the running system instead.")] = False,
) -> None:
    """List the missions of this installation with their inputs and outputs."""
    if live:
        from florence_bt.app.runs.remote import live_missions

        tell(live_missions())
        return
    from florence_bt.app.mission_files.mission_list import list_missions

    known, wrong = list_missions(folders or [])
    tell(known)
    if wrong:
        typer.echo(wrong, err=True)


@app.command(
    cls=RosVerb,
    rich_help_panel="Mission files",
    epilog=f"Example: florence check my_mission.yaml --hotspots flat.yaml --map map.yaml\n\n{EXIT_CODES}",
)
def check(
    files: Annotated[
        list[Path],
        typer.Argument(help="Mission files, files of skills, folders of them, or - for the standard input."),
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
        Path | None, typer.Option(metavar="FILE", help="The file name to assume for the standard input.")
    ] = None,
) -> None:
    """Check mission files: every problem at once, with file:line:column and what would have worked.

    Needs no robot, no ROS and no simulation. docs/manual/checking.md explains all errors and warnings.
    """
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


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence draw goto_user -o goto_user.svg\n\n{EXIT_CODES}",
)
def draw(
    mission: Annotated[str, typer.Argument(help="Name of a mission, or a mission file.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", click_type=OUTPUT_FILE, help="File; its ending chooses svg, png, txt or mermaid."
        ),
    ] = None,
    folders: FolderOption = None,
    expand: Annotated[bool, typer.Option("--expand", help="Draw the trees of called missions too.")] = False,
    width: Annotated[
        int | None, typer.Option(min=400, max=20_000, help="Greatest width of the picture, in pixels.")
    ] = None,
) -> None:
    """Draw the tree of a mission; without a file as text in the terminal."""
    from florence_bt.app.mission_files.draw import draw_mission

    text = draw_mission(mission, out, folders or [], expand=expand, width=width)
    typer.echo(f"{out} written" if out else text)


@app.command(
    rich_help_panel="Mission files", epilog=f"Example: florence schema -o mission.schema.json\n\n{EXIT_CODES}"
)
def schema(
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", click_type=OUTPUT_FILE, help="File to write.", show_default="the terminal"
        ),
    ] = None,
    folders: FolderOption = None,
    hotspots: Annotated[
        Path | None, typer.Option(help="Hotspots of the flat: editors complete their labels.")
    ] = None,
) -> None:
    """Write the JSON Schema of mission files: node kinds, skills with their inputs, missions, codes.

    An editor with a YAML language server completes and checks a mission that begins with the line
    `# yaml-language-server: $schema=mission.schema.json` (docs/manual/checking.md).
    """
    from florence_bt.app.mission_files.output import write_output
    from florence_bt.app.mission_files.schema_file import schema_text

    text = schema_text(folders or [], hotspots)
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_output(out, text)
        typer.echo(f"{out} written")
