"""Verbs about the Kinect: ``kinect record``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, app, errors_to_exit_codes

kinect = typer.Typer(help="The Kinect: record what it sees.", no_args_is_help=True)
app.add_typer(kinect, name="kinect", rich_help_panel="The robot")


@kinect.callback()
def _group() -> None:
    """The Kinect: record what it sees."""


@kinect.command(epilog=f"Example: florence kinect record --folder kitchen --seconds 3\n\n{EXIT_CODES}")
def record(
    folder: Annotated[Path, typer.Option(help="Where the recording goes; is made.")],
    seconds: Annotated[float, typer.Option(help="How long.")] = 3.0,
    source: Annotated[
        str,
        typer.Option(
            help="usb, usb:1, usb:SERIAL, recording:FOLDER, or the socket of a simulated Kinect, such as "
            "runs/up/ports/kinect."
        ),
    ] = "usb",
    colour: Annotated[bool, typer.Option(help="Whether to record colour too.")] = True,
    library: Annotated[
        str, typer.Option(help="The file of libfreenect.", show_default="the installed one")
    ] = "",
) -> None:
    """Record the Kinect into a folder that fakenect, and our node with `source: recording:FOLDER`, play.

    A second takes about 20 MB, with colour 45. Pictures are written with 640 x 480 pixels, as fakenect wants.
    Ctrl-C ends it early; what came until then can be played.
    """
    with errors_to_exit_codes():
        from florence_bt.app.devices.kinect_recording import record as run

        made = run(source, folder, seconds, colour=colour, library=library)
        typer.echo(
            f"{folder}: {made.depth_pictures} depth and {made.colour_pictures} colour pictures, "
            f"{made.readings} accelerometer readings in {made.seconds:.1f} s"
        )
        if made.without_motor:
            typer.echo(f"no accelerometer: {made.without_motor}")
        typer.echo(
            f"play it: kinect_node: {{source: 'recording:{folder.resolve()}'}} in the robot's configuration"
        )
        if made.interrupted:
            raise KeyboardInterrupt
