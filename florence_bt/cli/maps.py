"""Verbs about maps: make them, save them, change them, propose their rooms."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, VerbList, Verbs, app
from florence_bt.cli.exit_codes import FAILED, INTERRUPTED
from florence_bt.cli.output_paths import OUTPUT_FILE
from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import refuse_existing

if TYPE_CHECKING:
    from florence_bt.core.sensing import OccupancyGrid
    from florence_bt.skills.navigation.mapping.editing import Edited

maps = VerbList(
    cls=Verbs, help="Maps: build, explore, save, clean, crop, rotate, edit; rooms.", no_args_is_help=True
)
app.add_typer(maps, name="map", rich_help_panel="The robot")


@maps.callback()
def _group() -> None:
    """Build a map, save the one that is published, change the files of a map, propose its rooms.

    What changes a map keeps its last 20 versions beside it, in NAME.versions; --undo goes back step by step.
    Coordinates are metres in the frame of the map, as in hotspot files.
    """


MapArgument = Annotated[Path, typer.Argument(metavar="MAP", help="The YAML file of the map.")]
OutOption = Annotated[
    Path | None,
    typer.Option(
        click_type=OUTPUT_FILE,
        metavar="FILE",
        help="Write another map.",
        show_default="the map itself is changed",
    ),
]
HotspotsOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The hotspots and zones of the map: they are turned with it."),
]
PoseOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The saved pose of the robot (pose.json of the bring-up): it is kept."),
]
PictureOption = Annotated[
    Path | None,
    typer.Option(
        click_type=OUTPUT_FILE, metavar="FILE", help="Draw the map and what has changed, .png or .svg."
    ),
]
UndoOption = Annotated[bool, typer.Option("--undo", help="Take back the last change of this map instead.")]
OverwriteOption = Annotated[
    bool, typer.Option("--overwrite", help="With --undo: also when a file was changed since by other means.")
]

LogOption = Annotated[
    Path | None,
    typer.Option(
        help="The recording: an MCAP, db3 or ROS 1 bag file, the folder of a rosbag2, a log of CARMEN.",
        show_default="the map that the running system makes",
    ),
]
ResumedOption = Annotated[
    Path | None,
    typer.Option(
        "--continue",
        metavar="FILE.drive",
        help="Go on with a drive that was built before, near where it ended.",
    ),
]
OdomOption = Annotated[
    str | None,
    typer.Option(metavar="TOPIC", help="The odometry, of more than one; without any, tf is taken."),
]
BaseFrameOption = Annotated[
    str | None,
    typer.Option(
        metavar="FRAME", help="The robot's frame: that of the odometry, base_footprint or base_link."
    ),
]
MountOption = Annotated[
    str | None,
    typer.Option(
        metavar="'X Y Z ROLL PITCH YAW'",
        help="Where the laser is on the robot, metres and degrees (roll 180: upside down), "
        "when the recording does not tell.",
    ),
]

Change = tuple[Callable[["OccupancyGrid"], "Edited"], str]
"""A change of a map, and its name in the map's versions."""


def _change(
    change: Change,
    file: MapArgument,
    out: OutOption = None,
    hotspots: HotspotsOption = None,
    pose: PoseOption = None,
    picture: PictureOption = None,
    undo: UndoOption = False,
    overwrite: OverwriteOption = False,
) -> None:
    from florence_bt.app.maps.change import ChangedFiles, change_map
    from florence_bt.app.maps.change import undo as undo_last

    if undo:
        typer.echo(undo_last(file, overwrite=overwrite))
        return
    for line in change_map(ChangedFiles(file, out, hotspots, pose, picture), *change):
        typer.echo(line)


def _changes_map(make: Callable[..., Change]) -> Callable[..., None]:
    """Make a verb of a function that takes its own options and says how the map is changed.

    It gets the map and the options of :func:`_change`, too.
    """
    _, *shared = inspect.signature(_change, eval_str=True).parameters.values()
    own = inspect.signature(make, eval_str=True).parameters

    @functools.wraps(make)
    def verb(**given: Any) -> None:
        change = make(**{name: given[name] for name in own})
        _change(change, **{each.name: given[each.name] for each in shared})

    parameters = [shared[0], *own.values(), *(each for each in shared[1:] if each.name not in own)]
    keyword_only = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters]
    verb.__signature__ = inspect.Signature(keyword_only)  # type: ignore[attr-defined]
    verb.__annotations__ = {each.name: each.annotation for each in parameters}
    return verb


@maps.command(
    epilog=f"Examples: florence map clean maps/home.yaml --picture home.png; "
    f"florence map clean maps/home.yaml --undo\n\n{EXIT_CODES}"
)
@_changes_map
def clean(
    speck: Annotated[
        float, typer.Option(metavar="METRES", help="The largest size of a speck; 0 leaves all.")
    ] = 0.1,
) -> Change:
    """Remove specks, holes in the floor and islands behind walls; close small holes in straight walls.

    Every cell becomes free, occupied or unknown. The legs of tables stay.
    """
    from florence_bt.skills.navigation.mapping.editing import clean as clean_grid

    return lambda grid: clean_grid(grid, speck), "clean"


@maps.command(
    epilog="Examples: florence map crop maps/home.yaml; "
    f'florence map crop maps/home.yaml --box "[[0, 0], [9.5, 7]]"\n\n{EXIT_CODES}'
)
@_changes_map
def crop(
    box: Annotated[
        str | None,
        typer.Option(
            metavar="POINTS", help="Two opposite corners of what stays.", show_default="what is known"
        ),
    ] = None,
    margin: Annotated[
        float, typer.Option(metavar="METRES", help="Unknown ground that stays around it, without --box.")
    ] = 0.25,
) -> Change:
    """Cut a map down to what is known, or to a rectangle; places keep their coordinates."""
    from florence_bt.app.maps.change import points
    from florence_bt.skills.navigation.mapping.editing import crop as crop_grid

    corners = None if box is None else points(box, "--box")
    if corners is not None and len(corners) != 2:
        raise ConfigError(f"--box: {len(corners)} points", valid=["two opposite corners: [[0, 0], [9.5, 7]]"])
    kept = None if corners is None else (corners[0], corners[1])
    return lambda grid: crop_grid(grid, kept, margin), "crop"


@maps.command(
    epilog="Examples: florence map rotate maps/home.yaml --hotspots hotspots/home.yaml; "
    f'florence map rotate maps/home.yaml --by "90 deg"\n\n{EXIT_CODES}'
)
@_changes_map
def rotate(
    by: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE",
            help="Counter-clockwise, with its unit.",
            show_default="walls become parallel to the axes",
        ),
    ] = None,
) -> Change:
    """Turn a map about the origin of its frame, so that its walls run along the axes, or by an angle.

    No wall is lost, however thin. What is known stays, the rest is cut off.
    """
    from florence_bt.app.maps.change import turn_of
    from florence_bt.skills.navigation.mapping.editing import rotate as rotate_grid

    return lambda grid: rotate_grid(grid, turn_of(by, grid)), "rotate"


@maps.command(
    epilog='Examples: florence map edit maps/home.yaml wall="[[1, 2], [3, 2]]"; '
    f'florence map edit maps/home.yaml free="[[0, 0], [2, 1]]" unknown="[[5, 5], [6, 5], [6, 7]]"'
    f"\n\n{EXIT_CODES}"
)
@_changes_map
def edit(
    edits: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="WHAT=POINTS...",
            help="wall='[[1, 2], [3, 2]]': from point to point; free=, unknown=, occupied=: two opposite "
            "corners of a rectangle, or the corners of a polygon. One after the other.",
        ),
    ] = None,
    thickness: Annotated[float, typer.Option(metavar="METRES", help="Of walls.")] = 0.1,
    undo: UndoOption = False,
) -> Change:
    """Draw walls, free what is not there, make unknown what nobody should drive to."""
    from florence_bt.app.maps.change import edits as read_edits
    from florence_bt.skills.navigation.mapping.editing import draw

    drawn = read_edits(edits or [])
    if bool(drawn) == undo:
        raise ConfigError("either something to draw, or --undo", valid=["wall='[[1, 2], [3, 2]]'", "--undo"])
    return lambda grid: draw(grid, drawn, thickness), f"edit {' '.join(edits or [])}"


@maps.command(
    epilog="Example: florence map rooms maps/home.yaml --out hotspots/home.yaml; then florence hotspot name "
    f"--hotspots hotspots/home.yaml\n\n{EXIT_CODES}"
)
def rooms(
    file: MapArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FILE,
            metavar="FILE",
            help="The hotspot file to write.",
            show_default="they are only listed",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FILE,
            metavar="FILE",
            help="The picture, .png or .svg.",
            show_default="beside --out",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a hotspot file of this name.")
    ] = False,
) -> None:
    """Propose the rooms of a map: what is divided by doors, with a place for the robot in each.

    They are called room_1, room_2, ..., the largest first; florence hotspot name gives them their names.
    """
    from florence_bt.app.maps.proposal import proposed_hotspots, rooms_text
    from florence_bt.app.mission_files.output import write_outputs
    from florence_bt.app.places.draw import check_form, draw
    from florence_bt.app.places.listing import as_table
    from florence_bt.skills.locator.hotspots import Hotspots
    from florence_bt.skills.navigation.map_server.map_file import load_map

    if out is not None:
        refuse_existing(out, overwrite=overwrite)
    shown = picture or (out.with_suffix(".png") if out is not None else None)
    if shown is not None:
        check_form(shown)
    grid = load_map(file, lambda sentence: typer.echo(f"{file}: {sentence}", err=True))
    found = Hotspots(proposed_hotspots(grid))
    typer.echo(as_table(found) if len(found) else "no room in which the robot could stand")
    files: dict[Path, bytes] = {}
    if shown is not None:
        files[shown] = draw(found, grid, shown.suffix, f"{file}: rooms")
    if out is not None:
        files[out] = rooms_text(found).encode()
    write_outputs(files)
    if out is not None:
        typer.echo(f"{out} written; florence hotspot name --hotspots {out} gives the rooms their names")
    if shown is not None:
        typer.echo(f"{shown} written")


@maps.command(
    cls=RosVerb, epilog=f"Example: florence map save maps/home.yaml --image-format png\n\n{EXIT_CODES}"
)
def save(
    file: Annotated[
        Path, typer.Argument(click_type=OUTPUT_FILE, help="The YAML file; the image gets the same name.")
    ],
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
    out: Annotated[
        Path,
        typer.Option(
            click_type=OUTPUT_FILE, help="The YAML file of the map; its other files get the same name."
        ),
    ],
    log: LogOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files of this name.")] = False,
    resumed: ResumedOption = None,
    scan: Annotated[str | None, typer.Option(metavar="TOPIC", help="The laser, of more than one.")] = None,
    odom: OdomOption = None,
    odom_frame: Annotated[str, typer.Option(metavar="FRAME", help="The odometry's frame in tf.")] = "odom",
    base_frame: BaseFrameOption = None,
    mount: MountOption = None,
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
        _build_by_hand(out, overwrite=overwrite)
        return
    from florence_bt.app.maps.build import build_map, output_files, write_built
    from florence_bt.app.maps.recordings.recording import Choices
    from florence_bt.app.maps.told import MapProgress, mount_from_text, tell_built
    from florence_bt.skills.navigation.map_server.map_writer import check_target
    from florence_bt.skills.navigation.mapping.parameters import SlamParameters

    files = output_files(out)
    refuse_existing(*files, overwrite=overwrite)
    check_target(files[0])
    choices = Choices(scan, odom, odom_frame, base_frame, mount_from_text(mount) if mount else None, urdf)
    parameters = SlamParameters(resolution=resolution, laser_max_range=laser_range)
    with MapProgress(log.name) as progress:
        built = build_map(log, choices, parameters, resumed=resumed, tell=progress.tell)
    tell_built(built, write_built(built, out))
    if built.problem is not None:
        raise typer.Exit(INTERRUPTED if isinstance(built.problem, KeyboardInterrupt) else FAILED)


def _build_by_hand(out: Path, *, overwrite: bool) -> None:
    """Show the map of the running system until Ctrl-C, which writes it."""
    from rich.console import Console

    from florence_bt.app.maps.explore import build_by_hand
    from florence_bt.app.maps.watching import MapFiles

    files = MapFiles.beside(out)
    files.check(overwrite=overwrite)
    build_by_hand(files, Console(stderr=True))
