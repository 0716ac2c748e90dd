"""The verb ``map explore``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.maps import maps
from florence_bt.cli.output_paths import OUTPUT_FILE, OUTPUT_FOLDER
from florence_bt.cli.system import SeedOption, SpeedOption, WorldOption, WorldSeedOption


@maps.command(
    cls=RosVerb,
    epilog="Examples: florence map explore maps/home.yaml; florence map explore maps/home.yaml --sim "
    f"--world-seed 31\n\n{EXIT_CODES}",
)
def explore(
    out: Annotated[
        Path,
        typer.Argument(
            click_type=OUTPUT_FILE, help="The YAML file of the map; its other files get the same name."
        ),
    ],
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files of this name.")] = False,
    sim: Annotated[
        bool,
        typer.Option(
            "--sim",
            help="Bring the simulated robot up for it, and take it down again; otherwise the system runs "
            "already (florence up --mapping).",
        ),
    ] = False,
    world: WorldOption = None,
    world_seed: WorldSeedOption = None,
    seed: SeedOption = 0,
    speed: SpeedOption = 1.0,
    folder: Annotated[
        Path, typer.Option(click_type=OUTPUT_FOLDER, help="With --sim: the folder for the logs and the run.")
    ] = Path("runs/explore"),
) -> None:
    """Let the robot map the home by itself: it drives wherever it gets to until it has seen everything.

    It is the mission explore; it ends where it began. Beside the map there are a picture of it with the way
    of the robot (.drive.png) and the rooms that the map seems to have (.hotspots.yaml).

    florence override or florence teleop takes the robot over at any moment; after florence release the same
    command goes on with the same map. Ctrl-C stops the robot and leaves the map of what was seen.
    """
    from rich.console import Console

    from florence_bt.app.bringup.options import ABSENT, BringUp
    from florence_bt.app.maps.explore import explore_home
    from florence_bt.app.maps.watching import MapFiles
    from florence_bt.core.errors import ConfigError

    if not sim and (world or world_seed is not None):
        raise ConfigError("--world and --world-seed are simulated homes", valid=["--sim"])
    files = MapFiles.beside(out)
    files.check(overwrite=overwrite)
    system = None
    if sim:
        system = BringUp(
            folder=str(folder.absolute()),
            mapping=True,
            person=ABSENT,
            world_file=str(world.absolute()) if world else None,
            world_seed=world_seed,
            seed=seed,
            speed=speed,
        )
    raise typer.Exit(OK if explore_home(files, Console(stderr=True), system) else FAILED)
