"""Verbs on recorded runs: ``runs``. They need no running system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, app, errors_to_exit_codes


@app.command(
    rich_help_panel="Runs",
    epilog=f"Example: florence runs --mission goto_user --state failed\n\n{EXIT_CODES}",
)
def runs(
    mission: Annotated[str, typer.Option(help="Only runs of this mission.", show_default="all")] = "",
    state: Annotated[
        str, typer.Option(help="Only runs in this state, e.g. succeeded or failed.", show_default="all")
    ] = "",
    limit: Annotated[int, typer.Option(help="Show at most so many, the latest first.")] = 20,
    folder: Annotated[
        Path | None,
        typer.Option(help="Folder of the runs.", show_default="the one used last below ./runs"),
    ] = None,
) -> None:
    """List recorded runs, the latest first; no system needs to be up."""
    with errors_to_exit_codes():
        from florence_bt.app.runs.journal_view import runs_table

        for line in runs_table(folder, mission=mission, state=state, limit=limit):
            typer.echo(line)
