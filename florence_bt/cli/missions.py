"""Verbs about mission files: ``missions``, ``check``, ``draw``. They need neither ROS nor a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FAILED, OK, FolderOption, app, errors_to_exit_codes


@app.command(epilog=f"Example: florence missions\n\n{EXIT_CODES}")
def missions(folders: FolderOption = None) -> None:
    """List the missions of this installation with their inputs."""
    with errors_to_exit_codes():
        from florence_bt.trees.loader import MissionLibrary
        from florence_bt.trees.report import report_text

        library = MissionLibrary.load(folders or [])
        for mission in library.missions():
            typer.echo(f"{mission.name:<16} {mission.description}")
            for name, port in mission.inputs.items():
                typer.echo(f"{'':<16}   {name}: {port.kind.value}{' (required)' if port.required else ''}")
        for finding in library.findings:
            typer.echo(report_text([finding]), err=True)


@app.command(epilog=f"Example: florence check my_mission.yaml\n\n{EXIT_CODES}")
def check(
    files: Annotated[list[Path], typer.Argument(help="Mission files, or folders of them.")],
    hotspots: Annotated[
        Path | None, typer.Option(help="Hotspots of the flat, to check labels against.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="text, json or github.")] = "text",
) -> None:
    """Check mission files: every problem at once, with file:line:column and what would have worked."""
    with errors_to_exit_codes():
        from florence_bt.wiring.files import check_files

        report, errors = check_files(files, hotspots, form)
        typer.echo(report)
        raise typer.Exit(FAILED if errors else OK)


@app.command(epilog=f"Example: florence draw goto_user -o goto_user.svg\n\n{EXIT_CODES}")
def draw(
    mission: Annotated[str, typer.Argument(help="Name of a mission, or a mission file.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File; its ending chooses svg, txt or mermaid.")
    ] = None,
    folders: FolderOption = None,
    expand: Annotated[bool, typer.Option(help="Draw the trees of called missions too.")] = False,
) -> None:
    """Draw the tree of a mission; without a file as text in the terminal."""
    with errors_to_exit_codes():
        from florence_bt.wiring.files import draw_mission

        text = draw_mission(mission, out, folders or [], expand=expand)
        typer.echo(f"{out} written" if out else text)
