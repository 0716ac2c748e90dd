"""Verbs about recordings: ``record``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, app
from florence_bt.cli.output_paths import OUTPUT_FOLDER
from florence_bt.core.errors import ConfigError


@app.command(
    cls=RosVerb,
    rich_help_panel="The robot",
    epilog=f"Example: florence record --exclude '*costmap*' my_recordings\n\n{EXIT_CODES}",
)
def record(
    folder: Annotated[
        Path | None,
        typer.Argument(
            click_type=OUTPUT_FOLDER,
            help="Where the files go.",
            show_default="recordings/ in the folder of the running system",
        ),
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Only topics like this, e.g. /scan; may be repeated."),
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="PATTERN", help="Leave out topics like this.")
    ] = None,
    pictures: Annotated[bool, typer.Option("--pictures", help="Also images and clouds of points.")] = False,
    file_size: Annotated[
        float, typer.Option(metavar="MB", help="Size of one file; then the next one begins.")
    ] = 256.0,
    total_size: Annotated[
        float,
        typer.Option(metavar="MB", help="Size of all recordings in the folder; the oldest go."),
    ] = 4096.0,
    max_age: Annotated[
        float, typer.Option(metavar="DAYS", help="Recordings in the folder that are older are removed.")
    ] = 30.0,
    foxglove: Annotated[
        int, typer.Option(metavar="PORT", help="Show the topics to Foxglove at this port, e.g. 8765.")
    ] = 0,
    foxglove_origin: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ORIGIN",
            help="Let a web site look there, too, e.g. https://app.foxglove.dev; may be repeated.",
        ),
    ] = None,
) -> None:
    """Record what the running system, or any other robot, publishes, until Ctrl-C.

    The files are MCAP of ROS 2: Foxglove, ros2 bag and florence map build read them.
    """
    from florence_bt.app.bringup.locks import running_folder
    from florence_bt.app.recording.record import run_recorder

    if folder is None:
        here = running_folder()
        folder = here / "recordings" if here else Path("recordings")
    if folder.suffix:
        raise ConfigError(f"{str(folder)!r} is to be a folder", valid=[f"florence record {folder.stem}"])
    parameters = {
        "folder": str(folder.absolute()),
        "topics": topic,
        "exclude": exclude,
        "pictures": pictures,
        "file_size": file_size,
        "total_size": total_size,
        "max_age": max_age,
        "foxglove_port": foxglove,
        "foxglove_origins": foxglove_origin or [],
    }
    raise typer.Exit(run_recorder(parameters))
