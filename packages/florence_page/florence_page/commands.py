"""The command that this package adds to ``florence``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, VerbList

app = VerbList()


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog="Examples: florence page; florence page --token run; florence page --missions robot/missions\n\n"
    + EXIT_CODES,
)
def page(
    host: Annotated[
        str, typer.Option(help="The address; 0.0.0.0 for the network, which needs a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="The TCP port.")] = 8080,
    folder: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="The folder of recorded runs.", show_default="that of the running system"
        ),
    ] = None,
    token: Annotated[
        str,
        typer.Option(
            metavar="ROLE",
            help="Make a token and end: look sees, run also starts and stops, edit also writes missions.",
        ),
    ] = "",
    missions: Annotated[
        list[Path] | None,
        typer.Option(
            "--missions",
            help="Folders of missions for the editor; the last one is written to.",
            show_default="those of the running system, else missions",
        ),
    ] = None,
) -> None:
    """Show the robot in a browser: where it is, what it sees and does; start, stop and write missions."""
    from florence_page.access import make_token, tokens_file, user_access

    if token:
        typer.echo(f"token, shown only now: {make_token(token, tokens_file())}")
        typer.echo("open the page as http://ROBOT:8080/?token=TOKEN")
        return
    from florence_page.server import serve_page

    serve_page(host, port, user_access(), folder, missions or [])
