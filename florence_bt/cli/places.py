"""Verbs about places: ``hotspot``, ``hotspot zone`` and ``where``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, VerbList, Verbs, app, key_values, tell
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE
from florence_bt.core.errors import ConfigError

if TYPE_CHECKING:
    from florence_bt.skills.locator.hotspot_file import HotspotFile

hotspot = VerbList(
    cls=Verbs, help="Rooms, objects and zones: list, teach, change, check, draw.", no_args_is_help=True
)
app.add_typer(hotspot, name="hotspot", rich_help_panel="The robot")
zone = VerbList(
    cls=Verbs, help="Zones: where the robot does not drive, or drives slowly.", no_args_is_help=True
)
hotspot.add_typer(zone, name="zone")

HotspotsOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The hotspot file.", show_default="that of the running system"),
]
MapOption = Annotated[Path | None, typer.Option("--map", metavar="FILE", help="The YAML file of the map.")]
LabelArgument = Annotated[str, typer.Argument(help="The label.")]
_VALUES = "KEY=VALUE..."


@hotspot.callback()
def _group() -> None:
    """Rooms, objects and zones: list, teach, change, check, draw.

    Without --hotspots the commands are about the running system: they change its file, of which a copy (.bak)
    stays, and it uses the change at once. Comments and the order of a file stay.
    """


@zone.callback()
def _zones() -> None:
    """Zones: where the robot does not drive, or drives slowly."""


@hotspot.command(
    "list",
    cls=RosVerb,
    epilog=f"Example: florence hotspot list --hotspots hotspots/flat.yaml\n\n{EXIT_CODES}",
)
def list_places(
    hotspots: HotspotsOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON; angles in degrees.")] = False,
) -> None:
    """List hotspots and zones."""
    from florence_bt.app.places import listing
    from florence_bt.app.places.target import PlacesTarget

    with PlacesTarget(hotspots) as target:
        places = target.hotspots()
    typer.echo(listing.as_json(places) if as_json else listing.as_table(places))


@hotspot.command(
    cls=RosVerb, epilog=f'Example: florence hotspot add sofa x=1.5 y=2 yaw="90 deg"\n\n{EXIT_CODES}'
)
def add(
    label: LabelArgument,
    values: Annotated[
        list[str],
        typer.Argument(metavar=_VALUES, help="x, y, yaw; kind=object or kind=room; polygon='[[0, 0], ...]'."),
    ],
    hotspots: HotspotsOption = None,
) -> None:
    """Add a hotspot: where the robot is to stand, and which way it looks there.

    Angles have a unit, as in missions; metres need none. Without a kind a hotspot that is called like a room
    (kitchen, bedroom 2) is one, another one is an object. A file that does not exist is made.
    """
    from florence_bt.app.places.target import add_hotspot

    _change(hotspots, partial(add_hotspot, label=label, values=key_values(values)), create=True)


@hotspot.command(cls=RosVerb, epilog=f"Example: florence hotspot here sofa\n\n{EXIT_CODES}")
def here(
    label: LabelArgument,
    values: Annotated[
        list[str] | None, typer.Argument(metavar=_VALUES, help="kind=object or kind=room; polygon=...")
    ] = None,
    hotspots: HotspotsOption = None,
) -> None:
    """Add a hotspot where the robot is now, or move one there; needs a running system.

    Drive the robot to the place, by hand or with a mission, and turn it as it is to stand.
    """
    from florence_bt.app.places.target import PlacesTarget, put_here

    given = key_values(values or [])
    with PlacesTarget(hotspots) as target:
        edit = partial(put_here, label=label, pose=target.robot_pose(), values=given)
        _tell(target.change(edit, create=True, stands=True))


@hotspot.command(cls=RosVerb, epilog=f'Example: florence hotspot move sofa yaw="-90 deg"\n\n{EXIT_CODES}')
def move(
    label: LabelArgument,
    values: Annotated[
        list[str], typer.Argument(metavar=_VALUES, help="What changes: x, y, yaw, kind, polygon.")
    ],
    hotspots: HotspotsOption = None,
) -> None:
    """Change some values of a hotspot; the others stay."""
    from florence_bt.app.places.target import move_hotspot

    _change(hotspots, partial(move_hotspot, label=label, values=key_values(values)))


@hotspot.command(cls=RosVerb, epilog=f"Example: florence hotspot rename sofa settee\n\n{EXIT_CODES}")
def rename(
    label: LabelArgument,
    new: Annotated[str, typer.Argument(help="The new label.")],
    hotspots: HotspotsOption = None,
) -> None:
    """Give a hotspot another label; missions that name it must be changed, too: florence check finds them."""
    from florence_bt.app.places.target import rename_hotspot

    _change(hotspots, partial(rename_hotspot, old=label, new=new))


@hotspot.command(
    cls=RosVerb,
    epilog="Examples: florence hotspot name --hotspots hotspots/home.yaml; "
    f"florence hotspot name room_1=kitchen room_2=hall\n\n{EXIT_CODES}",
)
def name(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="ROOM=NAME...", help="room_1=kitchen; without any each room is asked for."),
    ] = None,
    hotspots: HotspotsOption = None,
) -> None:
    """Give the rooms that were proposed (room_1, room_2, ...) their names, by the picture beside the file.

    An empty answer leaves a room as it is. A name with blanks needs quotes: room_1="living room".
    """
    from florence_bt.app.maps.proposal import ask_names, name_rooms
    from florence_bt.app.places.target import PlacesTarget

    with PlacesTarget(hotspots) as target:
        given = key_values(names or [])
        if not names:
            places = target.hotspots()
            given = ask_names(places.rooms(), places.labels(), _ask)
        if not given:
            raise ConfigError("no room was given a name", valid=["room_1=kitchen", "florence hotspot rename"])
        _tell(target.change(name_rooms(given)))


def _ask(question: str) -> str:
    answer: str = typer.prompt(question, default="", show_default=False)
    return answer


@hotspot.command(cls=RosVerb, epilog=f"Example: florence hotspot remove sofa\n\n{EXIT_CODES}")
def remove(label: LabelArgument, hotspots: HotspotsOption = None) -> None:
    """Remove a hotspot."""
    from florence_bt.app.places.target import remove_hotspot

    _change(hotspots, partial(remove_hotspot, label=label))


@hotspot.command(
    cls=RosVerb,
    epilog="Example: florence hotspot check --hotspots hotspots/flat.yaml --map maps/flat.yaml"
    f"\n\n{EXIT_CODES}",
)
def check(
    hotspots: HotspotsOption = None,
    map_file: MapOption = None,
    form: Annotated[str, typer.Option("--format", help="text, json or github.")] = "text",
) -> None:
    """Tell everything that is wrong with a hotspot file; with --map also which hotspots are in walls."""
    from florence_bt.app.places.check import check_places
    from florence_bt.app.places.target import PlacesTarget

    with PlacesTarget(hotspots) as target:
        report, wrong = check_places(target.file, map_file, form)
    typer.echo(report)
    raise typer.Exit(FAILED if wrong else OK)


@hotspot.command(
    cls=RosVerb,
    epilog="Example: florence hotspot draw --hotspots hotspots/flat.yaml --map maps/flat.yaml"
    f"\n\n{EXIT_CODES}",
)
def draw(
    hotspots: HotspotsOption = None,
    map_file: MapOption = None,
    out: Annotated[
        Path, typer.Option(click_type=OUTPUT_FILE, metavar="FILE", help="The picture, .png or .svg.")
    ] = Path("places.png"),
) -> None:
    """Draw rooms, hotspots with their directions, and zones on the map.

    A running system tells its map itself.
    """
    from florence_bt.app.mission_files.output import write_output
    from florence_bt.app.places.draw import check_form
    from florence_bt.app.places.draw import draw as draw_places
    from florence_bt.app.places.target import PlacesTarget

    check_form(out)
    with PlacesTarget(hotspots) as target:
        places, file = target.hotspots(), target.file
        grid = target.published_map() if map_file is None else None
    if map_file is not None:
        from florence_bt.skills.navigation.map_server.map_file import load_map

        grid = load_map(map_file, lambda sentence: typer.echo(f"{map_file}: {sentence}", err=True))
    write_output(out, draw_places(places, grid, out.suffix, str(file)), make_folder=True)
    typer.echo(f"{out} written")


@zone.command(
    "add",
    cls=RosVerb,
    epilog="Examples: florence hotspot zone add stairs kind=keep_out polygon='[[1, 0], [2, 0], [2, 1]]'; "
    "florence hotspot zone add rug kind=slow speed_limit='0.2 m/s' polygon='[[3, 0], [4, 0], [4, 2]]'"
    f"\n\n{EXIT_CODES}",
)
def add_zone(
    label: LabelArgument,
    values: Annotated[
        list[str],
        typer.Argument(
            metavar=_VALUES,
            help="kind=keep_out or kind=slow; polygon='[[0, 0], ...]'; speed_limit='0.2 m/s' or '50 %'.",
        ),
    ],
    hotspots: HotspotsOption = None,
) -> None:
    """Add a zone, or replace the one with this label; the running system keeps to it at once."""
    from florence_bt.app.places import target

    _change(hotspots, partial(target.add_zone, label=label, values=key_values(values)), create=True)


@zone.command("remove", cls=RosVerb, epilog=f"Example: florence hotspot zone remove stairs\n\n{EXIT_CODES}")
def remove_zone(label: LabelArgument, hotspots: HotspotsOption = None) -> None:
    """Remove a zone."""
    from florence_bt.app.places import target

    _change(hotspots, partial(target.remove_zone, label=label))


@app.command(
    cls=RosVerb,
    rich_help_panel="The robot",
    epilog=f"Examples: florence where; florence where --watch\n\n{EXIT_CODES}",
)
def where(
    watch: Annotated[bool, typer.Option("--watch", help="Keep showing until Ctrl-C.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="As JSON: known, text and values for each line.")
    ] = False,
) -> None:
    """Show where the robot is, how sure that is, its goal, its mission, its battery, and who is seen.

    What is not known says why.
    """
    from rich.console import Console

    from florence_bt.app.runs.where import show_where

    show_where(Console(), watch=watch, json_lines=as_json)


def _change(hotspots: Path | None, edit: Callable[[HotspotFile], str], *, create: bool = False) -> None:
    from florence_bt.app.places.target import PlacesTarget

    with PlacesTarget(hotspots) as target:
        _tell(target.change(edit, create=create))


def _tell(lines: list[str]) -> None:
    for line in lines:
        tell(line)
