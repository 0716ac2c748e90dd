"""The command ``florence``. Every verb loads only what it needs: ``check`` and ``draw`` work without ROS."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.wiring.signals import all_like_ctrl_c

OK, FAILED, USAGE, NOT_THERE, INTERRUPTED = 0, 1, 2, 3, 130
EXIT_CODES = (
    "Exit codes: 0 done; 1 the mission failed, was refused, or a check found errors; 2 wrong usage or "
    "configuration; 3 the system is not there, did not come up or broke down; 130 interrupted (Ctrl-C)."
)

app = typer.Typer(
    name="florence",
    help="Missions for home robots: behaviour trees in YAML, run on ROS 2.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@contextmanager
def _errors_to_exit_codes() -> Iterator[None]:
    """Turn the errors of Florence into one clear line and an exit code."""
    try:
        with all_like_ctrl_c():
            yield
    except ConfigError as error:
        _fail(str(error), USAGE)
    except FlorenceError as error:
        _fail(str(error), NOT_THERE)
    except ModuleNotFoundError as error:
        _fail(
            f"this verb needs the package {error.name!r}, which is not installed; "
            "run `make setup` in a checkout, or build a ROS workspace with colcon (CONTRIBUTING.md)",
            USAGE,
        )
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)


def _fail(message: str, code: int) -> None:
    typer.echo(f"florence: {message}", err=True)
    raise typer.Exit(code)


PersonOption = Annotated[
    str | None,
    typer.Option(help="Room the person is in, or 'absent' for nobody at home.", show_default="a random room"),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Start of every random generator.")]
SpeedOption = Annotated[float, typer.Option(help="Simulated seconds per wall second aimed at.")]


FolderOption = Annotated[
    list[Path] | None,
    typer.Option("--missions", help="More folders of missions; later ones shadow earlier ones."),
]


@app.command(epilog=f"Example: florence demo --person kitchen --seed 3\n\n{EXIT_CODES}")
def demo(
    person: PersonOption = None,
    seed: SeedOption = 0,
    speed: SpeedOption = 1.0,
    out: Annotated[Path, typer.Option(help="Folder for the logs and the run.")] = Path("runs/demo"),
    headless: Annotated[bool, typer.Option(help="Plain log lines instead of the live tree.")] = False,
) -> None:
    """Show the main job in the simulated flat: find the person and approach to a polite distance.

    Brings up all nodes on ROS 2 over simulated hardware, calls the mission service for goto_user, shows the
    tree live, and ends with the final tree, the reason, the distance to the person, the time and the folder
    of the run.
    """
    with _errors_to_exit_codes():
        from rich.console import Console

        from florence_bt.wiring.demo import print_result, run_demo
        from florence_bt.wiring.options import BringUp

        console = Console()
        options = BringUp(folder=str(out.absolute()), person=person, seed=seed, speed=speed)
        result = run_demo(options, console, headless=headless)
        print_result(result, console)
        raise typer.Exit(OK if result.succeeded else FAILED)


@app.command(epilog=f"Example: florence up --sim --person kitchen\n\n{EXIT_CODES}")
def up(
    sim: Annotated[bool, typer.Option("--sim", help="Simulated hardware instead of the robot's.")] = False,
    robot: Annotated[
        Path | None, typer.Option(metavar="CONFIG", help="Drive the robot that this file configures.")
    ] = None,
    map_file: Annotated[Path | None, typer.Option("--map", help="Map of the flat (map_server YAML).")] = None,
    hotspots: Annotated[Path | None, typer.Option(help="Hotspots of the flat (YAML).")] = None,
    folders: FolderOption = None,
    person: PersonOption = None,
    seed: SeedOption = 0,
    speed: SpeedOption = 1.0,
    out: Annotated[Path, typer.Option(help="Folder for the logs and the runs.")] = Path("runs/up"),
) -> None:
    """Bring the whole system up and keep it running until Ctrl-C."""
    with _errors_to_exit_codes():
        if sim == (robot is not None):
            raise ConfigError("say what to bring up", valid=["--sim", "--robot CONFIG"])
        from florence_bt.wiring.options import BringUp
        from florence_bt.wiring.up import run_up

        run_up(
            BringUp(
                folder=str(out.absolute()),
                simulated=sim,
                config_file=str(robot.absolute()) if robot else None,
                map_file=str(map_file.absolute()) if map_file else None,
                hotspots_file=str(hotspots.absolute()) if hotspots else None,
                mission_folders=tuple(str(folder.absolute()) for folder in folders or ()),
                person=person,
                seed=seed,
                speed=speed,
            )
        )


class PolicyChoice(StrEnum):
    """What to do when another mission is running."""

    reject = "reject"
    queue = "queue"
    preempt = "preempt"


@app.command(epilog=f"Example: florence run goto_room room=kitchen\n\n{EXIT_CODES}")
def run(
    mission: Annotated[str, typer.Argument(help="Name of the mission.")],
    inputs: Annotated[
        list[str] | None, typer.Argument(metavar="KEY=VALUE...", help="Inputs of the mission.")
    ] = None,
    policy: Annotated[
        PolicyChoice, typer.Option(help="When another mission is running.")
    ] = PolicyChoice.reject,
    priority: Annotated[int, typer.Option(help="Higher goes before lower.")] = 0,
    headless: Annotated[bool, typer.Option(help="Plain log lines instead of the live tree.")] = False,
    detach: Annotated[bool, typer.Option(help="Return once the mission is accepted.")] = False,
) -> None:
    """Trigger a mission on the running system and watch it to its end."""
    with _errors_to_exit_codes():
        from rich.console import Console

        from florence_bt.wiring.remote import run_mission

        raise typer.Exit(
            OK
            if run_mission(
                mission,
                _key_values(inputs or []),
                policy=policy.value,
                priority=priority,
                console=Console(),
                headless=headless,
                detach=detach,
            )
            else FAILED
        )


@app.command(epilog=f"Example: florence status --watch\n\n{EXIT_CODES}")
def status(
    run_id: Annotated[
        str, typer.Option("--run", help="A run's id.", show_default="the current or last run")
    ] = "",
    watch: Annotated[bool, typer.Option("--watch", help="Keep showing until Ctrl-C.")] = False,
) -> None:
    """Show the tree of the current or last run as ASCII text, with reasons."""
    with _errors_to_exit_codes():
        from rich.console import Console

        from florence_bt.wiring.remote import show_status

        raise typer.Exit(OK if show_status(run_id, Console(), watch=watch) else FAILED)


@app.command(epilog=f"Example: florence stop\n\n{EXIT_CODES}")
def stop(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
) -> None:
    """Stop the running mission; the robot stands still."""
    with _errors_to_exit_codes():
        from florence_bt.wiring.remote import stop_mission

        success, message = stop_mission(run_id)
        typer.echo(message)
        raise typer.Exit(OK if success else FAILED)


@app.command(epilog=f"Example: florence missions\n\n{EXIT_CODES}")
def missions(folders: FolderOption = None) -> None:
    """List the missions of this installation with their inputs."""
    with _errors_to_exit_codes():
        from florence_bt.trees.loader import MissionLibrary
        from florence_bt.trees.report import report_text

        library = MissionLibrary.load(folders or [])
        for mission in library.missions():
            typer.echo(f"{mission.name:<16} {mission.description}")
            for name, port in mission.inputs.items():
                typer.echo(f"{'':<16}   {name}: {port.kind.value}{' (required)' if port.required else ''}")
        for finding in library.findings:
            typer.echo(report_text([finding]), err=True)


@app.command(epilog=f"Example: florence check my_mission.yaml\n\n{EXIT_CODES}")
def check(
    files: Annotated[list[Path], typer.Argument(help="Mission files, or folders of them.")],
    hotspots: Annotated[
        Path | None, typer.Option(help="Hotspots of the flat, to check labels against.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="text, json or github.")] = "text",
) -> None:
    """Check mission files: every problem at once, with file:line:column and what would have worked."""
    with _errors_to_exit_codes():
        from florence_bt.wiring.files import check_files

        report, errors = check_files(files, hotspots, form)
        typer.echo(report)
        raise typer.Exit(FAILED if errors else OK)


@app.command(epilog=f"Example: florence draw goto_user -o goto_user.svg\n\n{EXIT_CODES}")
def draw(
    mission: Annotated[str, typer.Argument(help="Name of a mission, or a mission file.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File; its ending chooses svg, txt or mermaid.")
    ] = None,
    folders: FolderOption = None,
    expand: Annotated[bool, typer.Option(help="Draw the trees of called missions too.")] = False,
) -> None:
    """Draw the tree of a mission; without a file as text in the terminal."""
    with _errors_to_exit_codes():
        from florence_bt.wiring.files import draw_mission

        text = draw_mission(mission, out, folders or [], expand=expand)
        typer.echo(f"{out} written" if out else text)


def _key_values(pairs: list[str]) -> dict[str, str]:
    values = {}
    for pair in pairs:
        name, separator, value = pair.partition("=")
        if not separator or not name:
            raise ConfigError(f"{pair!r} is not an input", valid=["key=value, e.g. room=kitchen"])
        values[name] = value
    return values


def main() -> None:
    """Entry point of the command."""
    app(prog_name="florence", standalone_mode=True)


if __name__ == "__main__":
    main()
