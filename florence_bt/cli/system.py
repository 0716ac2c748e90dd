"""Verbs that bring the system up: ``demo``, ``up``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, RosVerb, app
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FOLDER
from florence_bt.core.errors import ConfigError
from florence_bt.ros.arguments import namespace, ros_arguments

if TYPE_CHECKING:
    from florence_bt.app.bringup.robot_folder import RobotFolder

PersonOption = Annotated[
    str | None,
    typer.Option(
        help="Room the person is in; or what they do: standing, sitting, lying, walking, aided, leading; "
        "'company' for two or three people, 'absent' for nobody.",
        show_default="a random room",
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of every random generator.")]
WorldOption = Annotated[
    Path | None,
    typer.Option("--world", help="The simulated home: its source file, or a map."),
]
WorldSeedOption = Annotated[
    int | None,
    typer.Option("--world-seed", metavar="SEED", min=0, help="Generate the simulated home from a seed."),
]
SpeedOption = Annotated[float, typer.Option(help="Simulated seconds per wall second to aim at.")]

# Those of up alone.
FolderArgument = Annotated[
    Path | None, typer.Argument(help="The folder of a robot, made by florence init.", show_default=False)
]
SimOption = Annotated[bool, typer.Option("--sim", help="Simulated hardware instead of the robot's.")]
RobotOption = Annotated[
    Path | None, typer.Option(metavar="CONFIG", help="Drive the robot that this file configures.")
]
EmulateOption = Annotated[
    bool,
    typer.Option("--emulate", help="With --robot: a rehearsal, on emulated devices in the flat."),
]
MapFileOption = Annotated[Path | None, typer.Option("--map", help="Map of the flat (map_server YAML).")]
HotspotsOption = Annotated[Path | None, typer.Option(help="Hotspots of the flat (YAML).")]
MappingOption = Annotated[
    bool, typer.Option("--mapping", help="Make a map while the robot drives, in place of a known one.")
]
ResumedOption = Annotated[
    Path | None,
    typer.Option(
        "--continue",
        metavar="FILE.drive",
        help="With --mapping: go on with that drive, near where it ended; mapping.drive in the folder of "
        "a bring-up has its own.",
    ),
]
HomeOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="The house's own sensors, like config/home.yaml.")
]
SpeechOption = Annotated[
    str | None,
    typer.Option(
        metavar="PROGRAM",
        help="What speaks: espeak-ng, or another command that reads sentences; print: they are only "
        "shown; none: a program of your own serves 'speak'.",
        show_default="that of the configuration, else print",
    ),
]
ConfigOption = Annotated[
    Path | None, typer.Option(help="Parameters of the simulated robot's nodes, like config/robot.yaml.")
]
NavOption = Annotated[
    str, typer.Option(help="own: Florence's navigation; nav2: a Nav2 that is already running.")
]
BaseOption = Annotated[
    str, typer.Option(help="own: Florence's drivers; running: base and sensors have their own.")
]
MissionsOnlyOption = Annotated[
    bool,
    typer.Option(
        "--missions-only",
        help="Only the mission server and the places, beside a robot that runs already.",
    ),
]
ParamsFileOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="Parameter file of ROS 2, over those of the configuration; later ones go over earlier ones.",
    ),
]
StartOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,YAW", help="Simulated only: where the robot starts, metres and degrees on the map."
    ),
]
RecordOption = Annotated[
    bool,
    typer.Option("--record", help="Record what is published, into recordings/ in the folder for the logs."),
]
FoxgloveOption = Annotated[
    int,
    typer.Option(
        metavar="PORT",
        min=0,
        max=65535,
        help="Show what is published to Foxglove at this port, e.g. 8765.",
    ),
]
PageOption = Annotated[
    bool, typer.Option("--page", help="Show the robot in a browser, as florence page does.")
]
PagePortOption = Annotated[int, typer.Option(min=1, max=65535, help="With --page: its TCP port.")]
PageHostOption = Annotated[
    str, typer.Option(help="With --page: the address; 0.0.0.0 for the network, which needs a token.")
]
SplitOption = Annotated[
    bool,
    typer.Option("--split", help="A process for each node, to look for what is wrong; takes more memory."),
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        click_type=OUTPUT_FOLDER,
        help="Folder for the logs and the runs.",
        show_default="runs/up; runs/up_robot1 for /robot1",
    ),
]


@app.command(
    cls=RosVerb,
    rich_help_panel="The system",
    epilog=f"Example: florence demo --person kitchen --seed 3\n\n{EXIT_CODES}",
)
def demo(
    person: PersonOption = None,
    world: WorldOption = None,
    world_seed: WorldSeedOption = None,
    seed: SeedOption = 0,
    speed: SpeedOption = 1.0,
    out: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FOLDER,
            help="Folder for the logs and the run.",
            show_default="runs/demo; runs/demo_robot1 for /robot1",
        ),
    ] = None,
    headless: Annotated[bool, typer.Option(help="Plain log lines instead of the live tree.")] = False,
    whole: Annotated[
        bool, typer.Option("--all", help="In the final tree also the nodes that were not reached.")
    ] = False,
) -> None:
    """Show the main job in the simulated flat: find the person and approach to a polite distance.

    Brings up all nodes on ROS 2 over simulated hardware, calls the mission service for goto_user, shows the
    tree live, and ends with the final tree, the reason, the distance to the person, the time and the folder
    of the run. q and Ctrl-C stop the mission and end all.
    """
    from florence_bt.app.bringup.fork_server import ForkServer
    from florence_bt.app.bringup.options import BringUp

    options = BringUp(
        folder=str(_folder(out, "runs/demo").absolute()),
        person=person,
        world_file=_absolute(world),
        world_seed=world_seed,
        seed=seed,
        speed=speed,
    )
    with ForkServer(Path(options.folder)) as fork_server:  # imports, while this process does
        from rich.console import Console

        from florence_bt.app.demo.demo import print_result, run_demo

        console = Console()
        result = run_demo(options, console, fork_server, headless=headless)
    print_result(result, console, whole=whole)
    raise typer.Exit(OK if result.succeeded else FAILED)


@app.command(
    cls=RosVerb,
    rich_help_panel="The system",
    epilog=f"Example: florence up --sim --person kitchen\n\n{EXIT_CODES}",
)
def up(
    folder: FolderArgument = None,
    sim: SimOption = False,
    robot: RobotOption = None,
    emulate: EmulateOption = False,
    map_file: MapFileOption = None,
    hotspots: HotspotsOption = None,
    mapping: MappingOption = False,
    resumed: ResumedOption = None,
    home: HomeOption = None,
    speech: SpeechOption = None,
    config: ConfigOption = None,
    nav: NavOption = "own",
    base: BaseOption = "own",
    missions_only: MissionsOnlyOption = False,
    params_file: ParamsFileOption = None,
    folders: FolderOption = None,
    person: PersonOption = None,
    start: StartOption = None,
    world: WorldOption = None,
    world_seed: WorldSeedOption = None,
    seed: SeedOption = 0,
    speed: SpeedOption = 1.0,
    record: RecordOption = False,
    foxglove: FoxgloveOption = 0,
    page: PageOption = False,
    page_port: PagePortOption = 8080,
    page_host: PageHostOption = "127.0.0.1",
    split: SplitOption = False,
    out: OutOption = None,
) -> None:
    """Bring the whole system up and keep it running until Ctrl-C.

    With a FOLDER: the robot that its florence.yaml describes; other options go over what stands there.
    """
    if folder is not None:
        its = _robot_folder(folder, alone=not sim and not missions_only, mapping=mapping)
        robot, emulate, out = robot or its.robot, emulate or its.emulate, out or its.out
        map_file, hotspots, home = map_file or its.map, hotspots or its.hotspots, home or its.home
        folders, speech = folders or list(its.missions), speech or its.speech
        if map_file is None and not mapping:
            typer.echo(
                f"{folder} has no map of its home yet: navigation uses that of the example flat; "
                f"florence up {folder} --mapping makes one"
            )
    _check_choice(sim=sim, robot=robot is not None, emulate=emulate, missions_only=missions_only)
    if robot and (config or (start and not emulate)):
        raise ConfigError("--config and --start are for the simulated robot", valid=["--robot CONFIG"])
    if emulate and speed != 1.0:
        raise ConfigError("--emulate rehearses a robot in real time", valid=["--robot CONFIG --emulate"])
    from florence_bt.app.bringup.fork_server import ForkServer
    from florence_bt.app.bringup.options import BringUp, parse_start

    options = BringUp(
        folder=str(_folder(out, "runs/up").absolute()),
        simulated=sim,
        emulated=emulate,
        config_file=_absolute(robot or config),
        map_file=_absolute(map_file),
        hotspots_file=_absolute(hotspots),
        mapping=mapping,
        resumed_drive=_absolute(resumed),
        home_file=_absolute(home),
        speech=speech,
        nav="nav2" if missions_only else nav,
        base="running" if missions_only else base,
        missions_only=missions_only,
        mission_folders=tuple(str(folder.absolute()) for folder in folders or ()),
        person=person,
        start=parse_start(start) if start else None,
        world_file=_absolute(world),
        world_seed=world_seed,
        seed=seed,
        speed=speed,
        record=record,
        foxglove_port=foxglove,
        page_port=page_port if page else 0,
        page_host=page_host,
        split=split,
        ros_arguments=(
            *(word for file in params_file or () for word in ("--params-file", str(file.absolute()))),
            *ros_arguments(),
        ),
    )
    with ForkServer(Path(options.folder)) as fork_server:  # imports, while this process does
        from florence_bt.app.bringup.up import run_up

        run_up(options, fork_server)


def _robot_folder(folder: Path, *, alone: bool, mapping: bool) -> RobotFolder:
    """Read the folder of a robot; while a map is made, its places are those of another one and left out."""
    from florence_bt.app.bringup.robot_folder import read_robot_folder

    if not alone:
        raise ConfigError(
            "a robot's folder says what to bring up", valid=["florence up FOLDER", "--sim alone"]
        )
    its = read_robot_folder(folder)
    return replace(its, map=None, hotspots=None) if mapping else its


def _check_choice(*, sim: bool, robot: bool, emulate: bool, missions_only: bool) -> None:
    """Check that one thing is to be brought up."""
    if missions_only and (sim or emulate):
        raise ConfigError("--missions-only is for a robot that runs already", valid=["--missions-only alone"])
    if not missions_only and sim == robot:
        raise ConfigError(
            "choose what to bring up", valid=["FOLDER", "--sim", "--robot CONFIG", "--missions-only"]
        )
    if emulate and sim:
        raise ConfigError("--emulate rehearses a robot in real time", valid=["--robot CONFIG --emulate"])


@app.command(
    cls=RosVerb,
    rich_help_panel="The system",
    epilog=f"Example: florence logs -f --level warn navigation\n\n{EXIT_CODES}",
)
def logs(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Only these processes or nodes.")
    ] = None,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Go on with what comes, until Ctrl-C.")
    ] = False,
    level: Annotated[str, typer.Option(help="The least level: debug, info, warn, error or fatal.")] = "info",
    last: Annotated[
        int | None, typer.Option("--last", "-n", min=0, help="Only the last so many.", show_default="all")
    ] = None,
    whole: Annotated[
        bool, typer.Option("--all", help="Also of earlier bring-ups in the same folder.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The folder of the bring-up, or of a robot.", show_default="the one that runs, or ran last"
        ),
    ] = None,
) -> None:
    """Show the logs of all processes together, by time: of the system that runs, or of the last one.

    Needs no running system: it reads files, also after a crash.
    """
    from rich.console import Console

    from florence_bt.app.logs.logs import LogPrinter, LogReader, log_folder, show_logs

    console = Console()
    folder = log_folder(out)
    reader = LogReader(folder, names or [], level, whole=whole)
    printer = LogPrinter(folder, lambda text: console.print(text, soft_wrap=True))
    show_logs(reader, printer, follow=follow, last=last)


def _folder(out: Path | None, usual: str) -> Path:
    """Return the folder of a bring-up; without one given, robots in two namespaces have two."""
    return out or Path(usual + namespace().replace("/", "_"))


def _absolute(path: Path | None) -> str | None:
    """Make a path that other processes can use, too."""
    return str(path.absolute()) if path else None
