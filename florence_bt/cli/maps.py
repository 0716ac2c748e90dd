"""Verbs about maps: ``map save``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, app

maps = typer.Typer(help="Maps: save the published one.", no_args_is_help=True)
app.add_typer(maps, name="map", rich_help_panel="The robot")


@maps.callback()
def _group() -> None:
    """Save the published map."""


@maps.command(
    cls=RosVerb, epilog=f"Example: florence map save maps/home.yaml --image-format png\n\n{EXIT_CODES}"
)
def save(
    file: Annotated[Path, typer.Argument(help="The YAML file; the image gets the same name.")],
    topic: Annotated[str, typer.Option(help="Where the map is published.")] = "map",
    mode: Annotated[
        str, typer.Option(help="trinary (free, occupied, unknown), scale (steps between) or raw.")
    ] = "trinary",
    image_format: Annotated[str, typer.Option(help="pgm, png or bmp.")] = "pgm",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files of this name.")] = False,
    wait: Annotated[float, typer.Option(metavar="SECONDS", help="How long to wait for the map.")] = 10.0,
) -> None:
    """Write the map of the running system, or of a program that makes one, into files of map_server.

    Other robots and RViz read them, and florence up --map.
    """
    from florence_bt.app.maps.save import save_published_map

    written, grid = save_published_map(
        file, topic=topic, mode=mode, form=image_format, overwrite=overwrite, patience_s=wait
    )
    rows, columns = grid.cells.shape
    typer.echo(f"{written}: {columns} x {rows} cells of {grid.resolution:g} m")
