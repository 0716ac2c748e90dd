"""The verb ``schema``: what editors need to complete and check mission files while they are written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FolderOption, app, errors_to_exit_codes


@app.command(
    rich_help_panel="Mission files", epilog=f"Example: florence schema -o mission.schema.json\n\n{EXIT_CODES}"
)
def schema(
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write.", show_default="the terminal")
    ] = None,
    folders: FolderOption = None,
    hotspots: Annotated[
        Path | None, typer.Option(help="Hotspots of the flat: editors complete their labels.")
    ] = None,
    scenarios: Annotated[
        bool, typer.Option("--scenarios", help="The schema of scenario files (florence test) instead.")
    ] = False,
) -> None:
    """Write the JSON Schema of mission files: node kinds, skills with their inputs, missions, codes.

    An editor with a YAML language server completes and checks a mission that begins with the line
    `# yaml-language-server: $schema=mission.schema.json` (docs/checking.md).
    """
    with errors_to_exit_codes():
        from florence_bt.app.mission_files.schema_file import scenario_schema_text, schema_text, write_schema

        text = scenario_schema_text(folders or []) if scenarios else schema_text(folders or [], hotspots)
        if out is None:
            typer.echo(text, nl=False)
        else:
            write_schema(out, text)
            typer.echo(f"{out} written")
