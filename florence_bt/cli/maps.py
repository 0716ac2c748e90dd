"""Verbs about maps: ``map build``, ``map save``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, app
from florence_bt.cli.exit_codes import FAILED, INTERRUPTED, OK

maps = typer.Typer(help="Maps: build one from a recording, save the published one.", no_args_is_help=True)
app.add_typer(maps, name="map", rich_help_panel="The robot")


@maps.callback()
def _group() -> None:
    """Build and save maps."""


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


@maps.command(
    cls=RosVerb,
    epilog="Examples: florence map build --out maps/home.yaml; "
    f"florence map build --log drive.mcap --out maps/home.yaml\n\n{EXIT_CODES}",
)
def build(
    out: Annotated[Path, typer.Option(help="The YAML file of the map; its other files get the same name.")],
    log: Annotated[
        Path | None,
        typer.Option(
            help="The recording: an MCAP, db3 or ROS 1 bag file, the folder of a rosbag2, a log of CARMEN.",
            show_default="the map that the running system makes",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files of this name.")] = False,
    resumed: Annotated[
        Path | None,
        typer.Option(
            "--continue",
            metavar="FILE.drive",
            help="Go on with a drive that was built before, near where it ended.",
        ),
    ] = None,
    scan: Annotated[str | None, typer.Option(metavar="TOPIC", help="The laser, of more than one.")] = None,
    odom: Annotated[
        str | None,
        typer.Option(metavar="TOPIC", help="The odometry, of more than one; without any, tf is taken."),
    ] = None,
    odom_frame: Annotated[str, typer.Option(metavar="FRAME", help="The odometry's frame in tf.")] = "odom",
    base_frame: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME", help="The robot's frame: that of the odometry, base_footprint or base_link."
        ),
    ] = None,
    mount: Annotated[
        str | None,
        typer.Option(
            metavar="'X Y Z ROLL PITCH YAW'",
            help="Where the laser is on the robot, metres and degrees (roll 180: upside down), "
            "when the recording does not tell.",
        ),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A description of the robot that tells it.")
    ] = None,
    resolution: Annotated[float, typer.Option(metavar="METRES", help="Of a cell of the map.")] = 0.05,
    laser_range: Annotated[
        float, typer.Option(metavar="METRES", help="Leave out longer beams; 0 for the laser's own limit.")
    ] = 0.0,
) -> None:
    """Build a map from the recording of a drive, or while you drive, with laser and odometry alone.

    Without --log it shows how far the map of the running system is (florence up --mapping), until Ctrl-C
    writes it; the options about recordings mean nothing then.

    Places that the robot came back to are recognised, and the map is bent to fit. Beside the map there are a
    picture of it with the way of the robot (.drive.png), and the drive itself (.drive), for --continue.
    Ctrl-C leaves the map of what was read.
    """
    if log is None:
        from rich.console import Console

        from florence_bt.app.maps.explore import build_by_hand
        from florence_bt.app.maps.watching import MapFiles

        files = MapFiles.beside(out)
        files.check(overwrite=overwrite)
        build_by_hand(files, Console(stderr=True))
        raise typer.Exit(OK)
    from florence_bt.app.maps.build import build_map, output_files, write_built
    from florence_bt.app.maps.recordings.recording import Choices
    from florence_bt.app.maps.told import MapProgress, mount_from_text, tell_built
    from florence_bt.core.errors import ConfigError
    from florence_bt.skills.navigation.map_server.map_writer import check_target
    from florence_bt.skills.navigation.mapping.parameters import SlamParameters

    for file in output_files(out):
        if file.exists() and not overwrite:
            raise ConfigError(f"there is a file {str(file)!r}", valid=["another name", "--overwrite"])
    check_target(output_files(out)[0])
    choices = Choices(scan, odom, odom_frame, base_frame, mount_from_text(mount) if mount else None, urdf)
    parameters = SlamParameters(resolution=resolution, laser_max_range=laser_range)
    with MapProgress(log.name) as progress:
        built = build_map(log, choices, parameters, resumed=resumed, tell=progress.tell)
    tell_built(built, write_built(built, out))
    if isinstance(built.problem, KeyboardInterrupt):
        raise typer.Exit(INTERRUPTED)
    if built.problem is not None:
        raise typer.Exit(FAILED)
