"""Verbs about the robot itself: ``doctor``, ``calibrate``, ``kinect record``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, VerbList, Verbs, app
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE, OUTPUT_FOLDER
from florence_bt.core.errors import ConfigError


@app.command(
    rich_help_panel="The robot",
    epilog=f"Example: florence init my_robot --robot-type create2 --service none\n\n{EXIT_CODES}",
)
def init(
    folder: Annotated[
        Path, typer.Argument(click_type=OUTPUT_FOLDER, help="The robot's folder; is made.")
    ] = Path("my_robot"),
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Ask nothing: the defaults.")] = False,
    emulate: Annotated[
        bool, typer.Option("--emulate", help="For a rehearsal, on emulated devices in the example flat.")
    ] = False,
    robot_type: Annotated[
        str | None, typer.Option(help="The base: create, create2 or roomba.", show_default="asks, create")
    ] = None,
    base: Annotated[
        str | None, typer.Option(metavar="PORT", help="Port of the base.", show_default="asks, /dev/create")
    ] = None,
    laser: Annotated[
        str | None,
        typer.Option(
            metavar="PORT", help="Port or IP address of the laser.", show_default="asks, /dev/hokuyo"
        ),
    ] = None,
    speech: Annotated[
        str | None,
        typer.Option(metavar="PROGRAM", help="print, none, or a command.", show_default="asks, print"),
    ] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map", help="A map of the home.", show_default="none yet")
    ] = None,
    hotspots: Annotated[
        Path | None, typer.Option(help="Rooms and places of the home.", show_default="none yet")
    ] = None,
    service: Annotated[
        str | None,
        typer.Option(help="A systemd unit for: user, system or none.", show_default="asks, user"),
    ] = None,
) -> None:
    """Make the folder of a robot: configuration, udev rules and a systemd unit; says what is left to do.

    Finds the devices by their USB ids and asks them who they are; nothing moves. What is in the folder
    already stays as it is, and is shown where it differs. Nothing outside the folder is changed. Afterwards
    `florence up FOLDER` brings the robot up.
    """
    from florence_bt.app.robot_setup.setup import Given, set_up
    from florence_bt.app.runs.keyboard import in_front

    def ask(question: str, default: str) -> str:
        return default if yes or not in_front() else str(typer.prompt(question, default=default))

    given = Given(robot_type, base, laser, speech, map_file, hotspots, service, emulate)
    set_up(folder, given, ask, typer.echo)


@app.command(
    cls=RosVerb,
    rich_help_panel="The robot",
    epilog=f"Examples: florence doctor my_robot; florence doctor --config my_robot.yaml\n\n{EXIT_CODES}",
)
def doctor(
    robot: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FOLDER]", help="The folder of a robot, made by florence init.", show_default=False
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="The robot's configuration.", show_default="that of the package")
    ] = None,
    hardware: Annotated[bool, typer.Option(help="Whether to look at ports, USB and firmware.")] = True,
    home: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The house's own sensors: asks their MQTT broker too.")
    ] = None,
    hotspots: Annotated[Path | None, typer.Option(help="Hotspots, whose rooms the sensors are in.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(click_type=OUTPUT_FOLDER, help="Folder where runs will go.", show_default="runs"),
    ] = None,
    form: Annotated[str, typer.Option("--format", help="text or json.")] = "text",
) -> None:
    """Check ports, permissions, devices, libraries, clock, ROS and battery, and say what to do.

    Changes nothing and moves nothing. A base that is not in use is put into passive mode for the question.
    With a FOLDER: the robot that its florence.yaml describes; other options go over what stands there.
    """
    if robot is not None:
        from florence_bt.app.bringup.robot_folder import read_robot_folder

        its = read_robot_folder(robot)
        config, home, hotspots = config or its.robot, home or its.home, hotspots or its.hotspots
        out, hardware = out or its.out, hardware and not its.emulate
    if form not in ("text", "json"):
        raise ConfigError(f"unknown format {form!r}", valid=["text", "json"])
    from rich.console import Console

    from florence_bt.app.doctor.examination import examine
    from florence_bt.app.doctor.finding import as_json, healthy, print_table

    runs = out or Path("runs")
    findings = list(examine(config, runs, hardware=hardware, home_file=home, hotspots_file=hotspots))
    if form == "json":
        typer.echo(as_json(findings))
    else:
        print_table(findings, Console())
    raise typer.Exit(OK if healthy(findings) else FAILED)


@app.command(
    cls=RosVerb,
    rich_help_panel="The robot",
    epilog=f"Example: florence calibrate --write my_robot.yaml\n\n{EXIT_CODES}",
)
def calibrate(
    write: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FILE,
            metavar="CONFIG",
            help="Write the new values into this configuration; a copy (.bak) stays.",
        ),
    ] = None,
    rounds: Annotated[int, typer.Option(help="Repeat at most this many times.")] = 5,
    speed: Annotated[
        list[float] | None,
        typer.Option(help="Turning speed in rad/s; several times for several.", show_default="0.3 0.7 1 1.5"),
    ] = None,
    rest: Annotated[
        float | None,
        typer.Option(help="Seconds at rest for the gyro's drift.", show_default="10"),
    ] = None,
) -> None:
    """Calibrate odometry and gyro: the robot turns round in front of a wall, four times a round.

    Put the robot 1 to 2 m in front of a bare, straight wall, with half a metre of room around it; bring the
    system up. Prints what to multiply the two parameters of the base with, and repeats until the factors are
    near 1.00. The base uses new values after its next start. Ctrl-C stops the robot.
    """
    from florence_bt.app.devices.calibration import calibrate as run
    from florence_bt.app.devices.calibration import report_lines, write_config

    if write is not None and not write.is_file():
        raise ConfigError(f"there is no configuration {str(write)!r}", valid=["a copy of config/robot.yaml"])
    calibrated = run(typer.echo, rounds=rounds, speeds=speed or (), rest_s=rest)
    for line in report_lines(calibrated):
        typer.echo(line)
    if write is not None and calibrated.succeeded:
        backup = write_config(calibrated, write)
        typer.echo(f"{write} written; as it was: {backup}; restart the system to use it")
    elif write is not None:
        typer.echo(f"{write} stays as it is")
    raise typer.Exit(OK if calibrated.succeeded else FAILED)


@app.command(
    cls=RosVerb,
    rich_help_panel="The robot",
    epilog=f"Example: florence teleop --speed 0.15\n\n{EXIT_CODES}",
)
def teleop(
    joy: Annotated[
        bool, typer.Option("--joy", help="A gamepad on the topic joy in place of the keys.")
    ] = False,
    speed: Annotated[float, typer.Option(help="Forward speed at the start, m/s.")] = 0.2,
    turn: Annotated[float, typer.Option(help="Turning speed at the start, rad/s.")] = 0.8,
    timeout: Annotated[
        float, typer.Option(help="Seconds after the last key, or message of the pad, until the robot stands.")
    ] = 0.7,
    axis_linear: Annotated[int, typer.Option(help="With --joy: the axis for forward and backward.")] = 1,
    axis_angular: Annotated[int, typer.Option(help="With --joy: the axis for turns.")] = 0,
    enable_button: Annotated[int, typer.Option(help="With --joy: the dead-man button.")] = 4,
    turbo_button: Annotated[
        int, typer.Option(help="With --joy: the dead-man button for twice the speed; -1 for none.")
    ] = 5,
) -> None:
    """Drive the robot by hand, with the keys of this terminal or with a gamepad.

    Takes the robot by the manual override, which ends what it does, and gives it back at the end: Ctrl-C, or
    a closed terminal. The arrows, or i , j l, drive; space stops. Keep a key pressed: the robot stands still
    0.7 s after the last one. A gamepad drives by its left stick while L1 or LB is held.
    """
    from rich.console import Console

    from florence_bt.app.teleop.hands import GamepadLayout, TeleopParameters
    from florence_bt.app.teleop.teleop import drive_with_gamepad, drive_with_keys

    parameters = TeleopParameters(speed=speed, turn=turn, timeout=timeout)
    if joy:
        layout = GamepadLayout(
            axis_linear=axis_linear,
            axis_angular=axis_angular,
            enable_button=enable_button,
            turbo_button=turbo_button,
        )
        drive_with_gamepad(Console(), parameters, layout)
    else:
        drive_with_keys(Console(), parameters)


kinect = VerbList(cls=Verbs, help="The Kinect: record what it sees.", no_args_is_help=True)
app.add_typer(kinect, name="kinect", rich_help_panel="The robot")


@kinect.callback()
def _group() -> None:
    """Record what the Kinect sees."""


@kinect.command(epilog=f"Example: florence kinect record --folder kitchen --seconds 3\n\n{EXIT_CODES}")
def record(
    folder: Annotated[
        Path,
        typer.Option(click_type=OUTPUT_FOLDER, help="Where the recording goes, as kinect.mcap; is made."),
    ],
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
    """Record the Kinect into a file that Foxglove, and our node with `source: recording:FOLDER`, play.

    Ctrl-C ends it early; what came until then can be played.
    """
    from florence_bt.app.devices.kinect_recording import record as run

    made = run(source, folder, seconds, colour=colour, library=library)
    typer.echo(
        f"{folder}: {made.depth_images} depth and {made.colour_images} colour images, "
        f"{made.readings} accelerometer readings in {made.seconds:.1f} s"
    )
    if made.without_motor:
        typer.echo(f"no accelerometer: {made.without_motor}")
    typer.echo(
        f"play it: kinect_node: {{source: 'recording:{folder.resolve()}'}} in the robot's configuration"
    )
    if made.interrupted:
        raise KeyboardInterrupt


@kinect.command(
    name="convert", epilog=f"Example: florence kinect convert kitchen kitchen_fakenect\n\n{EXIT_CODES}"
)
def convert_recording(
    source: Annotated[Path, typer.Argument(help="The folder of a recording, of one or the other kind.")],
    target: Annotated[
        Path, typer.Argument(click_type=OUTPUT_FOLDER, help="The folder of the other kind; may be the same.")
    ],
) -> None:
    """Make a recording of a folder of libfreenect's record, or such a folder of a recording.

    Programs of libfreenect play such folders: fakenect FOLDER freenect-glview.
    """
    from florence_bt.app.devices.kinect_recording import convert

    depth, colour = convert(source, target)
    typer.echo(f"{target}: {depth} depth and {colour} colour images")
