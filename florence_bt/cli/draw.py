"""``florence draw``: pictures of missions. It needs neither ROS nor a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FolderOption, app, errors_to_exit_codes


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence draw goto_user -o goto_user.svg\n\n{EXIT_CODES}",
)
def draw(
    mission: Annotated[str, typer.Argument(help="Name of a mission, or a mission file.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File; its ending chooses svg, png, txt or mermaid.")
    ] = None,
    folders: FolderOption = None,
    expand: Annotated[bool, typer.Option("--expand", help="Draw the trees of called missions too.")] = False,
    width: Annotated[
        int | None, typer.Option(min=400, max=20_000, help="Widest the picture may be, in pixels.")
    ] = None,
) -> None:
    """Draw the tree of a mission; without a file as text in the terminal."""
    with errors_to_exit_codes():
        from florence_bt.app.mission_files.draw import draw_mission

        text = draw_mission(mission, out, folders or [], expand=expand, width=width)
        typer.echo(f"{out} written" if out else text)
